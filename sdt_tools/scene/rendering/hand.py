"""An open hand: a palm, four fingers a little curled, a thumb."""

import math

from sdt_tools.scene.rendering.mesh import Vector
from sdt_tools.scene.rendering.person import Person
from sdt_tools.scene.rendering.skeleton import Bone, Joints
from sdt_tools.scene.rendering.skin import Ring, Skin, join_skins, tube

_AHEAD = (1.0, 0.0, 0.0)
# Shares of the height. Of the palm: way along the hand, half thickness, half width.
_PALM = (
    (-0.004, 0.010, 0.013),
    (0.008, 0.0105, 0.017),
    (0.028, 0.0095, 0.024),
    (0.050, 0.0085, 0.025),
    (0.060, 0.007, 0.023),
    (0.063, 0.003, 0.019),
)
# Of each finger, from the index finger on: how far up it begins, its length; and its fan, in radians.
_FINGERS = ((0.0185, 0.041, 0.10), (0.0065, 0.046, 0.03), (-0.0055, 0.043, -0.04), (-0.0170, 0.034, -0.12))


def build_hand(person: Person, joints: Joints, texture: int, left: bool) -> Skin:
    """The hand at rest: stretched out sideways, palm ahead, thumb up."""
    bone = Bone.HAND_LEFT if left else Bone.HAND_RIGHT
    side, h = (1.0 if left else -1.0), person.height_m
    wrist: Vector = joints.at_m[bone]
    axis = (0.0, side, 0.0)

    def ring(out: float, ahead: float, up: float, thick: float, wide: float) -> Ring:
        """A ring ``out`` along the hand, ``ahead`` of its middle and ``up`` towards the thumb; shares of the height."""
        x, y, z = wrist.tolist()
        return Ring((x + ahead * h, y + side * out * h, z + up * h), thick * h, wide * h, bone)

    def finger(
        root: tuple[float, float, float], direction: tuple[float, float, float], length: float, radius: float
    ) -> Skin:
        """A finger from ``root`` along ``direction`` (both out, ahead, up), curling ahead towards its tip."""
        rings = []
        for share, thickness in ((0.0, 1.0), (0.45, 1.0), (0.85, 0.85), (1.0, 0.35)):
            out, ahead, up = (begin + step * share * length for begin, step in zip(root, direction, strict=True))
            curl = 0.35 * share * share * length
            rings.append(ring(out, ahead + curl, up, radius * thickness, radius * thickness))
        return tube(rings, axis, _AHEAD, texture, sides=6)

    palm = tube([ring(out, 0.0, 0.0, thick, wide) for out, thick, wide in _PALM], axis, _AHEAD, texture, sides=10)
    fingers = [
        finger((0.056, 0.0, up), (math.cos(fan), 0.10, math.sin(fan)), length, 0.0056) for up, length, fan in _FINGERS
    ]
    thumb = finger((0.016, 0.003, 0.016), (0.70, 0.22, 0.68), 0.046, 0.0072)
    return join_skins([palm, *fingers, thumb])
