"""Light of the scene: lamps and their field, and what it does to a surface or a figure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.errors import ConfigError
from sdt_tools.scene.layout import Sun, Wall

_DEEP_INSIDE: Final = 0.07
"""The share of daylight far from every opening of a roofed place."""
_FALLS_OFF_M: Final = 1.1
"""How far from an opening it has fallen to 1/e of what it was."""


@dataclass(frozen=True)
class LightKind:
    """A kind of light. ``ambient`` is what comes from everywhere, ``direct`` what comes from lamps or the sun."""

    ambient: float
    direct: float
    gain: float
    """How much light there is, beside a well-lit office."""
    tint_bgr: tuple[float, float, float]
    noise_codes: float
    """Standard deviation of the noise of a middle grey, in steps of 8 bits."""
    outdoors: bool = False


KINDS: Final = {
    "indoor": LightKind(0.45, 0.60, 1.0, (1.0, 1.0, 1.0), 2.0),
    "artificial": LightKind(0.30, 0.75, 0.7, (0.72, 0.96, 1.08), 3.2),
    "dim": LightKind(0.50, 0.45, 0.25, (0.85, 0.95, 1.05), 5.0),
    "sunlight": LightKind(0.45, 1.30, 2.0, (0.93, 0.99, 1.05), 1.6, outdoors=True),
    "overcast": LightKind(0.95, 0.12, 1.6, (1.03, 1.0, 0.96), 1.8, outdoors=True),
}


@dataclass(frozen=True, eq=False)
class Roof:
    """A roof over x0, y0, x1, y1: daylight comes in through those of its four sides that no wall closes."""

    rectangle_m: tuple[float, float, float, float]
    open_sides: tuple[bool, bool, bool, bool]
    """Towards x0, y0, x1, y1."""

    def daylight(self, points_m: Float64[np.ndarray, "points 3"]) -> Float64[np.ndarray, "points"]:
        """The share of the daylight that reaches each point: 1 outside, falling off with the way from an open side."""
        x0, y0, x1, y1 = self.rectangle_m
        x, y = points_m[:, 0], points_m[:, 1]
        ways = (x - x0, y - y0, x1 - x, y1 - y)
        inside = np.minimum.reduce(ways) > -0.01
        to_opening = np.full(len(points_m), np.inf)
        for way, is_open in zip(ways, self.open_sides, strict=True):
            if is_open:
                to_opening = np.minimum(to_opening, way)
        falls_off = np.exp(-np.maximum(to_opening, 0.0) / _FALLS_OFF_M)
        share: Float64[np.ndarray, "points"] = np.where(inside, _DEEP_INSIDE + (1.0 - _DEEP_INSIDE) * falls_off, 1.0)
        return share

    def covers(self, x_m: float, y_m: float) -> bool:
        """Whether the point lies under the roof."""
        x0, y0, x1, y1 = self.rectangle_m
        return bool(x0 < x_m < x1 and y0 < y_m < y1)


@dataclass(frozen=True, eq=False)
class Light:
    """Lamps at fixed places (or one sun, as a lamp that is far away) over an even ambient light."""

    kind: LightKind
    lamps_m: Float64[np.ndarray, "lamps 3"]
    power: float
    roof: Roof | None = None

    @property
    def sun(self) -> Float64[np.ndarray, "3"]:
        """The unit direction to the sun; meaningless indoors."""
        towards: Float64[np.ndarray, "3"] = self.lamps_m[0] / np.linalg.norm(self.lamps_m[0])
        return towards

    def ambient_at(self, point_m: Float64[np.ndarray, "3"]) -> float:
        """What comes from everywhere at ``point_m``."""
        if self.roof is None:
            return self.kind.ambient
        return self.kind.ambient * float(self.roof.daylight(point_m[None])[0])

    def at(
        self, points_m: Float64[np.ndarray, "points 3"], normals: Float64[np.ndarray, "points 3"]
    ) -> Float64[np.ndarray, "points"]:
        """Light on surfaces at ``points_m`` that face along unit ``normals``; 1 on a well-lit floor.

        Lamps shine downwards; their light falls with the square of the distance, and nothing casts a shadow.
        """
        sky = self.kind.ambient * (0.8 + 0.2 * normals[:, 2])
        direct = np.zeros(len(points_m))
        if self.kind.outdoors:
            direct += np.maximum(normals @ self.sun, 0.0)
            if self.roof is None:
                return sky + self.power * direct
            # A wall's two sides stand on one line: what faces inwards is inside.
            share = self.roof.daylight(points_m + 0.02 * normals)
            lit: Float64[np.ndarray, "points"] = sky * share + self.power * direct * (share >= 1.0)
            return lit
        for lamp in self.lamps_m:
            way = lamp - points_m
            square = np.maximum((way**2).sum(axis=1), 0.25)
            # Both cosines carry a 1/distance; the lamp's own falls off downwards only.
            direct += np.maximum((way * normals).sum(axis=1), 0.0) * np.maximum(way[:, 2], 0.0) / square**2
        return sky + self.power * direct

    def around(self, point_m: Float64[np.ndarray, "3"]) -> tuple[Float64[np.ndarray, "3"], float]:
        """The one direction and strength of light that stands for all lamps on a small body at ``point_m``."""
        if self.kind.outdoors:
            shaded = self.roof is not None and self.roof.covers(float(point_m[0]), float(point_m[1]))
            return self.sun, 0.0 if shaded else self.power
        way = self.lamps_m - point_m
        square = np.maximum((way**2).sum(axis=1), 0.25)
        pull = (way * (np.maximum(way[:, 2], 0.05) / square**2)[:, None]).sum(axis=0)
        strength = float(np.linalg.norm(pull))
        return (pull / strength if strength > 0 else np.array([0.0, 0.0, 1.0])), self.power * strength


def roof_over(walls: Sequence[Wall]) -> Roof:
    """The roof of the garage that ``walls`` make."""
    ends = np.array([[(wall.x0_m, wall.y0_m), (wall.x1_m, wall.y1_m)] for wall in walls]).reshape(-1, 2, 2)
    x0, y0 = ends.min(axis=(0, 1)).tolist()
    x1, y1 = ends.max(axis=(0, 1)).tolist()

    def is_open(axis: int, at: float) -> bool:
        low, high = (x0, x1) if axis == 1 else (y0, y1)
        along = ends[np.all(np.abs(ends[:, :, axis] - at) < 0.1, axis=1)][:, :, 1 - axis]
        closed_m = float(np.abs(along[:, 1] - along[:, 0]).sum())
        return closed_m < 0.6 * float(high - low)

    return Roof((x0, y0, x1, y1), (is_open(0, x0), is_open(1, y0), is_open(0, x1), is_open(1, y1)))


def light_over(
    name: str,
    bounds_m: Float64[np.ndarray, "4"],
    ceiling_m: float,
    rng: np.random.Generator,
    sun: Sun | None = None,
    roof: Roof | None = None,
) -> Light:
    """The light called ``name`` over the area x0, y0, x1, y1: rows of lamps under the ceiling, or a sun.

    Raises ConfigError for an unknown name.
    """
    kind = KINDS.get(name)
    if kind is None:
        raise ConfigError(f"unknown light '{name}'; known are {', '.join(KINDS)}")
    if kind.outdoors:
        azimuth, elevation = rng.uniform(0, 2 * math.pi), math.radians(rng.uniform(25, 60))
        if sun is not None:
            azimuth, elevation = sun.azimuth_rad, sun.elevation_rad
        flat = math.cos(elevation)
        towards = (flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation))
        return Light(kind, 1e6 * np.array([towards]), kind.direct, roof)
    spacing = rng.uniform(2.4, 3.4, 2)
    x0, y0, x1, y1 = bounds_m
    offset = rng.uniform(0, spacing)
    xs = np.arange(x0 - spacing[0] + offset[0], x1 + spacing[0], spacing[0])
    ys = np.arange(y0 - spacing[1] + offset[1], y1 + spacing[1], spacing[1])
    lamps = np.array([(x, y, ceiling_m - 0.02) for x in xs for y in ys])
    unit = Light(kind, lamps, 1.0)
    middle = np.array([[(x0 + x1) / 2 + dx, (y0 + y1) / 2 + dy, 0.0] for dx in (-1, 0, 1) for dy in (-1, 0, 1)])
    up = np.tile([0.0, 0.0, 1.0], (len(middle), 1))
    field = float(np.mean(unit.at(middle, up))) - kind.ambient
    return Light(kind, lamps, kind.direct / field)
