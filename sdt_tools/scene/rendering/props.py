"""What the operator may hold: a phone, a cup, a box. Each is carried by a bone, as his skin is."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from sdt_tools.scene.layout import Behaviour
from sdt_tools.scene.rendering import paint
from sdt_tools.scene.rendering.decor import box_pictures
from sdt_tools.scene.rendering.person import Person
from sdt_tools.scene.rendering.skeleton import Bone, Joints
from sdt_tools.scene.rendering.skin import Ring, Skin, tube
from sdt_tools.scene.rendering.texture import TextureBank

_UP: Final = (0.0, 0.0, 1.0)
_AHEAD: Final = (1.0, 0.0, 0.0)
_LEFT: Final = (0.0, 1.0, 0.0)
_RIGHT: Final = (0.0, -1.0, 0.0)

HANDY: Final = frozenset({Behaviour.PHONE_CALL, Behaviour.PHONE_TEXT, Behaviour.DRINK, Behaviour.CARRY_BOX})
"""What cannot be done with empty hands."""

Props = Mapping[tuple[Behaviour, bool], Skin]
"""What is held while doing something, with the left hand or else the right one."""


def build_props(person: Person, joints: Joints, bank: TextureBank, rng: np.random.Generator) -> Props:
    """All that ``person`` may hold, in the rest posture."""
    phone = bank.add_color(paint.color_hsv(rng.uniform(0, 360), rng.uniform(0, 0.5), rng.choice([0.1, 0.15, 0.8])))
    cup = bank.add_color(paint.color_hsv(rng.uniform(0, 360), rng.uniform(0, 0.7), rng.uniform(0.4, 0.95)))
    side_picture, _ = box_pictures(rng)
    carton = bank.add(side_picture)
    props: dict[tuple[Behaviour, bool], Skin] = {}
    half_m = (rng.uniform(0.045, 0.09), rng.uniform(0.085, 0.1), rng.uniform(0.05, 0.11))
    for left in (True, False):
        props[Behaviour.PHONE_CALL, left] = _phone(person, joints, phone, left)
        props[Behaviour.PHONE_TEXT, left] = props[Behaviour.PHONE_CALL, left]
        props[Behaviour.DRINK, left] = _cup(person, joints, cup, left)
        props[Behaviour.CARRY_BOX, left] = _carton(person, carton, half_m)
    return props


def _phone(person: Person, joints: Joints, texture: int, left: bool) -> Skin:
    """Flat in the palm, longer than the palm is wide."""
    h, bone = person.height_m, (Bone.HAND_LEFT if left else Bone.HAND_RIGHT)
    side = 1.0 if left else -1.0
    x, y, z = joints.at_m[bone].tolist()
    thick, wide = 0.0045 * h, 0.021 * h
    at = [(out, 1.0 if 0.02 < out < 0.1 else 0.0) for out in (0.0199, 0.02001, 0.0999, 0.1001)]
    rings = [
        Ring((x + 0.016 * h, y + side * out * h, z), thick * full, wide * full, bone, openness=0.9) for out, full in at
    ]
    return tube(rings, _LEFT if left else _RIGHT, _AHEAD, texture, sides=8, squareness=8.0)


def _cup(person: Person, joints: Joints, texture: int, left: bool) -> Skin:
    """Upright across the palm."""
    h, bone = person.height_m, (Bone.HAND_LEFT if left else Bone.HAND_RIGHT)
    side = 1.0 if left else -1.0
    x, y, z = joints.at_m[bone].tolist()
    shape = [(-0.030, 0.0), (-0.0299, 0.019), (0.0299, 0.024), (0.030, 0.021), (0.0, 0.015)]
    rings = [
        Ring((x + 0.034 * h, y + side * 0.045 * h, z + up * h), radius * h, radius * h, bone) for up, radius in shape
    ]
    return tube(rings, _UP, _AHEAD, texture, sides=10)


def _carton(person: Person, texture: int, half: tuple[float, float, float]) -> Skin:
    """Before the belly, where both hands hold it; ``half`` its sizes ahead, aside and up."""
    h = person.height_m
    middle = (0.075 + half[0] + 0.03, 0.0, 0.65 + half[2] / 2)
    rings = [
        Ring(
            (middle[0] * h, 0.0, (middle[2] + up * half[2]) * h),
            half[0] * h * full,
            half[1] * h * full,
            Bone.CHEST,
        )
        for up, full in ((-1.0, 0.0), (-0.9999, 1.0), (0.9999, 1.0), (1.0, 0.0))
    ]
    return tube(rings, _UP, _AHEAD, texture, sides=16, squareness=12.0)
