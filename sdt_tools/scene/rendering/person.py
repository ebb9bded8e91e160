"""What the operator looks like: body, clothes, skin, hair, and how he makes his gestures. Drawn once from the seed."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from sdt_tools.scene.rendering.paint import Color, color_hsv

Hair = Literal["short", "long", "bald", "cap"]
Pattern = Literal["plain", "stripes", "checks", "print"]

_SKINS_BGR: Final = np.array(
    [(176, 204, 242), (150, 185, 232), (122, 163, 218), (96, 138, 198), (72, 108, 168), (50, 80, 132), (38, 58, 96)],
    dtype=np.float64,
)
"""From fair to dark."""


@dataclass(frozen=True)
class GestureStyle:
    """One person's way of making the gestures, which no two people share. Angles in radians."""

    left_handed: bool
    """Whether `enable` raises the left arm."""
    raise_rad: float
    """`enable`: how far the upper arm rises above the horizontal, sideways."""
    elbow_in_rad: float
    """`enable`: how far the forearm leans inwards from straight up."""
    forward_rad: float
    """How far raised or spread arms point ahead."""
    spread_rad: float
    """`disable`: how far the arms rise above the horizontal (may be negative)."""
    palm_rad: float
    """`disable`: how far the palms turn down from facing ahead."""
    sway_hz: float
    sway_phase_rad: float


@dataclass(frozen=True, eq=False)
class Person:
    """An operator. Lengths in metres; ``girth`` and ``shoulders`` are factors on an average body of that height."""

    height_m: float
    girth: float
    shoulders: float
    belly: float
    stance_m: float
    """Between the middles of the legs."""
    leg_radius_m: float
    skin: Color
    hair_color: Color
    shirt: Color
    shirt_accent: Color
    trousers: Color
    shoes: Color
    pattern: Pattern
    long_sleeves: bool
    open_jacket: bool
    hair: Hair
    beard: bool
    glasses: bool
    mask: Color | None
    style: GestureStyle


def draw_person(rng: np.random.Generator, stance_m: float, leg_radius_m: float, mask: bool | None = None) -> Person:
    """A person from ``rng``, with the legs that the LiDAR sees; ``mask`` forces or forbids a surgical mask."""
    skin = _SKINS_BGR[rng.integers(len(_SKINS_BGR))] * rng.uniform(0.94, 1.05)
    wears_mask = bool(rng.random() < 0.12)
    mask_color = np.array([225.0, 205.0, 165.0]) if rng.random() < 0.7 else color_hsv(rng.uniform(0, 360), 0.1, 0.93)
    style = GestureStyle(
        left_handed=bool(rng.random() < 0.4),
        raise_rad=float(rng.uniform(0.15, 0.8)),
        elbow_in_rad=float(rng.uniform(-0.15, 0.35)),
        forward_rad=float(rng.uniform(-0.05, 0.3)),
        spread_rad=float(rng.uniform(-0.1, 0.16)),
        palm_rad=float(rng.uniform(0.0, 1.5)),
        sway_hz=float(rng.uniform(0.15, 0.35)),
        sway_phase_rad=float(rng.uniform(0, 2 * np.pi)),
    )
    hair: Hair = ("short", "long", "bald", "cap")[int(rng.choice(4, p=(0.5, 0.28, 0.1, 0.12)))]
    pattern: Pattern = ("plain", "stripes", "checks", "print")[int(rng.choice(4, p=(0.5, 0.2, 0.12, 0.18)))]
    long_sleeves = bool(rng.random() < 0.6)
    return Person(
        height_m=float(np.clip(rng.normal(1.73, 0.09), 1.54, 1.94)),
        girth=float(rng.uniform(0.9, 1.22)),
        shoulders=float(rng.uniform(0.93, 1.08)),
        belly=float(max(0.0, rng.normal(0.1, 0.35))),
        stance_m=stance_m,
        leg_radius_m=leg_radius_m,
        skin=skin,
        hair_color=_hair_color(rng),
        shirt=_cloth_color(rng),
        shirt_accent=_cloth_color(rng),
        trousers=_trouser_color(rng),
        shoes=color_hsv(rng.uniform(0, 360), rng.uniform(0, 0.4), rng.choice([0.14, 0.25, 0.85])),
        pattern=pattern,
        long_sleeves=long_sleeves,
        open_jacket=bool(rng.random() < 0.4) and long_sleeves,
        hair=hair,
        beard=bool(rng.random() < 0.2) and hair != "long",
        glasses=bool(rng.random() < 0.25),
        mask=mask_color if (wears_mask if mask is None else mask) else None,
        style=style,
    )


def _hair_color(rng: np.random.Generator) -> Color:
    if rng.random() < 0.15:
        return color_hsv(30.0, rng.uniform(0, 0.1), rng.uniform(0.5, 0.8))
    return color_hsv(rng.uniform(12, 36), rng.uniform(0.3, 0.7), rng.choice([0.1, 0.16, 0.3, 0.62]))


def _cloth_color(rng: np.random.Generator) -> Color:
    if rng.random() < 0.3:
        return color_hsv(rng.uniform(0, 360), rng.uniform(0, 0.12), rng.uniform(0.12, 0.95))
    return color_hsv(rng.uniform(0, 360), rng.uniform(0.35, 0.9), rng.uniform(0.3, 0.9))


def _trouser_color(rng: np.random.Generator) -> Color:
    if rng.random() < 0.5:
        return color_hsv(rng.uniform(208, 225), rng.uniform(0.35, 0.65), rng.uniform(0.25, 0.55))
    return color_hsv(rng.uniform(15, 50), rng.uniform(0.02, 0.35), rng.uniform(0.12, 0.7))
