"""The operator's surface at rest, in clothes, built from tubes around his bones."""

import numpy as np

from sdt_tools.scene.rendering.clothes import Wardrobe
from sdt_tools.scene.rendering.hand import build_hand
from sdt_tools.scene.rendering.head import build_head
from sdt_tools.scene.rendering.person import Person
from sdt_tools.scene.rendering.skeleton import Bone, Joints
from sdt_tools.scene.rendering.skin import Ring, Skin, join_skins, tube

_UP = (0.0, 0.0, 1.0)
_DOWN = (0.0, 0.0, -1.0)
_AHEAD = (1.0, 0.0, 0.0)


def build_body(person: Person, joints: Joints, wardrobe: Wardrobe) -> Skin:
    """The whole person, arms spread. Shapes are shares of the height, widened by the person's girth."""
    parts = [_trunk(person, wardrobe), _hips(person, wardrobe), *build_head(person, wardrobe)]
    for left in (True, False):
        parts += [*_arm(person, joints, wardrobe, left), build_hand(person, joints, wardrobe.skin, left)]
        parts += [_leg(person, joints, wardrobe, left), _shoe(person, joints, wardrobe, left)]
    return join_skins(parts)


def _trunk(person: Person, wardrobe: Wardrobe) -> Skin:
    """Shirt, from its hem to the collar."""
    h, fat, broad, belly = person.height_m, person.girth, person.shoulders, person.belly
    # z, half depth (x), half width (y), middle's x; shares of the height.
    shape = [
        (0.474, 0.074 * fat + 0.012 * belly, 0.058 + 0.052 * fat, 0.003, 0.8),
        (0.500, 0.075 * fat + 0.016 * belly, 0.054 + 0.051 * fat, 0.004, 0.85),
        (0.545, 0.071 * fat + 0.026 * belly, 0.030 + 0.068 * fat, 0.008 * belly, 0.9),
        (0.600, 0.065 * fat + 0.028 * belly, 0.086 * fat, 0.012 * belly, 0.95),
        (0.650, 0.066 * fat + 0.016 * belly, 0.089 * fat, 0.008 * belly, 0.95),
        (0.700, 0.070 * fat, 0.097 * fat, 0.002, 0.95),
        (0.745, 0.072 * fat, 0.104 * (fat + broad) / 2, 0.002, 0.95),
        (0.780, 0.066 * fat, 0.112 * broad, 0.0, 0.97),
        (0.800, 0.058, 0.114 * broad, -0.003, 1.0),
        (0.813, 0.050, 0.105 * broad, -0.005, 1.0),
        (0.824, 0.043, 0.088 * broad, -0.007, 1.0),
        (0.835, 0.038, 0.066, -0.008, 1.0),
        (0.846, 0.036, 0.046, -0.006, 0.9),
        (0.856, 0.036, 0.037, -0.002, 0.85),
        (0.858, 0.030, 0.031, -0.002, 0.7),
    ]
    rings = []
    for z, deep, wide, x, openness in shape:
        share = float(np.clip((z - 0.52) / 0.13, 0, 1))
        rings.append(Ring((x * h, 0.0, z * h), deep * h, wide * h, Bone.CHEST, Bone.PELVIS, share, openness))
    return tube(rings, _UP, _AHEAD, wardrobe.shirt, sides=18, squareness=2.5)


def _hips(person: Person, wardrobe: Wardrobe) -> Skin:
    """Seat of the trousers, under the shirt's hem."""
    h, fat = person.height_m, person.girth
    shape = [
        (0.440, 0.02, 0.03),
        (0.450, 0.048, 0.070),
        (0.470, 0.060, 0.086),
        (0.50, 0.064, 0.090),
        (0.53, 0.062, 0.086),
    ]
    rings = [
        Ring((0.0, 0.0, z * h), deep * fat * h, wide * fat * h, Bone.PELVIS, openness=0.75) for z, deep, wide in shape
    ]
    return tube(rings, _UP, _AHEAD, wardrobe.trousers, sides=14, squareness=2.4)


def _arm(person: Person, joints: Joints, wardrobe: Wardrobe, left: bool) -> list[Skin]:
    """An arm from the shoulder's cap to the wrist: skin, and the sleeve over it."""
    side = 1.0 if left else -1.0
    upper, fore, hand = _pairs(left, Bone.UPPER_ARM_LEFT, Bone.FOREARM_LEFT, Bone.HAND_LEFT)
    h, fat = person.height_m, person.girth
    shoulder, elbow, wrist = (float(abs(joints.at_m[bone, 1])) for bone in (upper, fore, hand))
    z = float(joints.at_m[upper, 2])

    def ring(y: float, radius: float, flat: float = 1.0) -> Ring:
        """A ring ``y`` metres out, ``radius`` a share of the height; the elbow bends over 4 cm either way."""
        at = (0.0, side * y, z)
        if y < (shoulder + elbow) / 2:
            return Ring(at, radius * h, radius * h, upper)
        if y < (elbow + wrist) / 2:
            share = float(np.clip(0.5 + (elbow - y) / 0.08, 0, 1))
            return Ring(at, radius * h, radius * h, upper, fore, share)
        return Ring(at, radius * h * flat, radius * h, fore)

    def at(share: float) -> float:
        """A place along the arm: 0 the shoulder, 1 the elbow, 2 the wrist."""
        return shoulder + share * (elbow - shoulder) if share <= 1 else elbow + (share - 1) * (wrist - elbow)

    bare = [
        (-0.12, 0.0), (-0.10, 0.014), (-0.03, 0.024), (0.08, 0.030 * fat), (0.3, 0.029 * fat), (0.55, 0.027 * fat),
        (0.8, 0.0235 * fat), (0.93, 0.0225 * fat), (1.0, 0.0225 * fat), (1.07, 0.0228 * fat), (1.2, 0.0235 * fat),
        (1.45, 0.0215 * fat), (1.75, 0.0165), (2.0, 0.0148), (2.04, 0.013),
    ]  # fmt: skip
    loose = 0.0035
    if person.long_sleeves:
        cut = [(share, radius + loose * (0 if share < 0 else 1)) for share, radius in bare[:-2]]
        cut += [(1.86, 0.0195), (1.90, 0.0195), (1.905, 0.014)]
        under = [(1.8, 0.0150), (2.0, 0.0142), (2.05, 0.0125)]
    else:
        cut = [(share, radius + loose * (0 if share < 0 else 1.3)) for share, radius in bare[:6]]
        cut += [(0.62, 0.0325 * fat), (0.625, 0.025 * fat)]
        under = [(0.5, 0.0262 * fat), *bare[6:]]
    axis = (0.0, side, 0.0)
    sleeve = [ring(at(share), radius) for share, radius in cut]
    skin = [ring(at(share), radius, 0.8 if share > 1.7 else 1.0) for share, radius in under]
    return [
        tube(sleeve, axis, _AHEAD, wardrobe.sleeve, sides=12, v_range=(0.0, 1.0)),
        tube(skin, axis, _AHEAD, wardrobe.skin, sides=10),
    ]


def _leg(person: Person, joints: Joints, wardrobe: Wardrobe, left: bool) -> Skin:
    """A trouser leg from the hip to the ankle. At the LiDAR's height it is as thick as the leg that the LiDAR sees."""
    thigh, shin, foot = _pairs(left, Bone.THIGH_LEFT, Bone.SHIN_LEFT, Bone.FOOT_LEFT)
    h, fat = person.height_m, person.girth
    y, hip, knee, ankle = (float(joints.at_m[thigh, 1]), *(float(joints.at_m[b, 2]) for b in (thigh, shin, foot)))
    calf = person.leg_radius_m / h
    shape = [
        (1.03, 0.030 * fat, 0.6), (1.0, 0.042 * fat, 0.65), (0.93, 0.047 * fat, 0.7), (0.8, 0.048 * fat, 0.8),
        (0.6, 0.045 * fat, 0.9), (0.35, 0.041 * fat, 0.95), (0.15, max(calf, 0.036 * fat), 1.0),
        (0.0, max(calf, 0.035 * fat), 1.0), (-0.15, calf, 1.0), (-0.4, calf, 0.95), (-0.7, 0.95 * calf, 0.9),
        (-0.98, 0.92 * calf, 0.8), (-1.06, 0.94 * calf, 0.7), (-1.065, 0.6 * calf, 0.6),
    ]  # fmt: skip
    rings = []
    for along, radius, openness in shape:
        z = knee + along * (hip - knee) if along > 0 else knee + along * (knee - ankle)
        if along > 0.5:
            share = float(np.clip((1.08 - along) / 0.25, 0, 1))
            rings.append(Ring((0.0, y, z), radius * h, radius * h, thigh, Bone.PELVIS, share, openness))
        else:
            share = float(np.clip(0.5 + along / 0.3, 0, 1))
            rings.append(Ring((0.0, y, z), radius * h, radius * h, thigh, shin, share, openness))
    return tube(rings, _DOWN, _AHEAD, wardrobe.trousers, sides=12, v_range=(0.0, 1.0))


def _shoe(person: Person, joints: Joints, wardrobe: Wardrobe, left: bool) -> Skin:
    (foot,) = _pairs(left, Bone.FOOT_LEFT)
    h = person.height_m
    x0, y = float(joints.at_m[foot, 0]), float(joints.at_m[foot, 1])
    # x ahead of the ankle, half height, half width; shares of the height.
    shape = [
        (-0.047, 0.004, 0.006), (-0.044, 0.015, 0.016), (-0.030, 0.023, 0.021), (0.000, 0.025, 0.022),
        (0.030, 0.021, 0.024), (0.060, 0.016, 0.027), (0.085, 0.013, 0.026), (0.103, 0.010, 0.020),
        (0.110, 0.004, 0.008),
    ]  # fmt: skip
    rings = [Ring((x0 + x * h, y, high * h), high * h, wide * h, foot, openness=0.8) for x, high, wide in shape]
    return tube(rings, _AHEAD, _UP, wardrobe.shoe, sides=12, squareness=2.6, v_range=(0.0, 1.0))


def _pairs(left: bool, *left_bones: Bone) -> tuple[Bone, ...]:
    """The bones of one side, named by their left ones."""
    return tuple(Bone(bone + (0 if left else 1)) for bone in left_bones)
