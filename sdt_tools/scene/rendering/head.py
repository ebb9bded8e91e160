"""The head: skull and face with a nose, ears, neck, hair or a cap, and a mask that stands out from the face."""

import math
from dataclasses import replace

import numpy as np

from sdt_tools.scene.rendering.clothes import Wardrobe
from sdt_tools.scene.rendering.person import Person
from sdt_tools.scene.rendering.skeleton import Bone
from sdt_tools.scene.rendering.skin import Ring, Skin, smooth_normals, tube

_UP = (0.0, 0.0, 1.0)
_AHEAD = (1.0, 0.0, 0.0)
_SIDES = 24
_CHIN = 0.872
"""Height of the chin, and below of the crown, as a share of the height."""
_CROWN = 1.0
_HAIR_SLANT = 0.35
_BROADER = 1.06
"""Of average proportions the head looks small from below, whence the camera sees it."""


def build_head(person: Person, wardrobe: Wardrobe) -> list[Skin]:
    """Head and neck, fixed to the head bone."""
    parts = [_skull(person, wardrobe), *_ears(person, wardrobe)]
    if person.hair == "short":
        parts.append(_hair(person, wardrobe.hair, low=0.42))
    elif person.hair == "long":
        parts += [_hair(person, wardrobe.hair, low=0.40), _mane(person, wardrobe)]
    elif person.hair == "cap":
        parts += [_hair(person, wardrobe.hair, low=0.40), *_cap(person, wardrobe)]
    broad = [replace(part, points_m=part.points_m * (_BROADER, _BROADER, 1.0)) for part in parts]
    return [_neck(person, wardrobe), *broad]


def _at(person: Person, share: float) -> float:
    """The height of a place on the head: 0 the chin, 1 the crown."""
    return (_CHIN + share * (_CROWN - _CHIN)) * person.height_m


def _neck(person: Person, wardrobe: Wardrobe) -> Skin:
    h, fat = person.height_m, person.girth
    shape = [
        (0.835, 0.036 * fat, -0.006, 0.7),
        (0.852, 0.033 * fat, -0.004, 0.75),
        (0.875, 0.031 * fat, 0.0, 0.6),
        (0.895, 0.031 * fat, 0.002, 0.55),
    ]
    rings = [
        Ring((x * h, 0.0, z * h), radius * h, radius * h, Bone.HEAD, Bone.CHEST, 0.3 if z < 0.85 else 0.8, openness)
        for z, radius, x, openness in shape
    ]
    return tube(rings, _UP, _AHEAD, wardrobe.skin, sides=12)


def _skull(person: Person, wardrobe: Wardrobe) -> Skin:
    """The face's texture runs from the chin (v = 1) to the crown (v = 0), in proportion to height."""
    h = person.height_m
    # share of the head's height, half depth, half width, middle's x; shares of the height.
    shape = [
        (-0.02, 0.004, 0.004, 0.026), (0.0, 0.020, 0.020, 0.024), (0.05, 0.034, 0.029, 0.014),
        (0.12, 0.042, 0.035, 0.007), (0.20, 0.047, 0.039, 0.003), (0.28, 0.050, 0.042, 0.001),
        (0.35, 0.052, 0.0435, 0.0), (0.43, 0.0535, 0.0445, -0.001), (0.52, 0.0540, 0.0450, -0.001),
        (0.62, 0.0555, 0.0455, -0.002), (0.72, 0.0550, 0.0445, -0.003), (0.82, 0.0500, 0.0405, -0.004),
        (0.90, 0.0405, 0.0330, -0.005), (0.96, 0.0270, 0.0220, -0.005), (1.0, 0.0, 0.0, -0.005),
    ]  # fmt: skip
    rings = [
        Ring(
            (x * h, 0.0, _at(person, share)),
            deep * h,
            wide * h,
            Bone.HEAD,
            openness=0.7 + 0.3 * min(1.0, share * 4 + 0.2),
        )
        for share, deep, wide, x in shape
    ]
    skin = tube(rings, _UP, _AHEAD, wardrobe.face, sides=_SIDES, squareness=2.15)
    points = skin.points_m.reshape(len(rings), _SIDES + 1, 3).copy()
    column = np.arange(_SIDES + 1) - _SIDES // 2
    for row, (share, *_) in enumerate(shape):
        # The nose stands out in the middle column, and half as far the mask around it.
        nose = 0.014 * np.interp(share, [0.28, 0.34, 0.42, 0.55], [0.0, 1.0, 0.75, 0.0])
        points[row, :, 0] += h * nose * (column == 0)
        points[row, :, 0] += h * 0.35 * nose * (np.abs(column) == 1)
        if person.mask is not None and 0.0 <= share <= 0.45:
            points[row, :, 0] += h * 0.007 * np.exp(-((column / 3.0) ** 2)) * (column != 0)
        eye = 0.0035 * np.interp(share, [0.45, 0.52, 0.58], [0.0, 1.0, 0.0])
        points[row, :, 0] -= h * eye * (np.abs(column) == 2)
    v = np.array([min(1.0, max(0.0, 1 - share)) for share, *_ in shape])
    uv = skin.uv.reshape(len(rings), _SIDES + 1, 2).copy()
    uv[..., 1] = 0.004 + 0.992 * v[:, None]
    return replace(
        skin,
        points_m=points.reshape(-1, 3),
        normals=smooth_normals(points, np.array(_UP)).reshape(-1, 3),
        uv=uv.reshape(-1, 2),
    )


def _ears(person: Person, wardrobe: Wardrobe) -> list[Skin]:
    h = person.height_m
    ears = []
    for side in (1.0, -1.0):
        shape = [(0.32, 0.002), (0.37, 0.007), (0.45, 0.010), (0.54, 0.011), (0.59, 0.008), (0.62, 0.002)]
        rings = [
            Ring((-0.006 * h, side * 0.0455 * h, _at(person, share)), radius * h, 0.005 * h, Bone.HEAD, openness=0.85)
            for share, radius in shape
        ]
        ears.append(tube(rings, _UP, _AHEAD, wardrobe.skin, sides=8))
    return ears


def _hair(person: Person, texture: int, low: float) -> Skin:
    """A shell over crown and back of the head; its front edge lies inside the skull, which makes the hairline."""
    h = person.height_m
    shape = []
    for share in np.linspace(low, 1.0, 7):
        bulge = math.sqrt(max(0.0, 1 - ((share - 0.58) / 0.50) ** 2))
        shape.append((share, bulge))
    rings = [
        Ring(
            ((-0.016 + 0.012 * share**3) * h, 0.0, _at(person, share) + 0.008 * h * share),
            0.0530 * h * bulge,
            0.0485 * h * bulge,
            Bone.HEAD,
        )
        for share, bulge in shape
    ]
    rings.append(Ring((-0.004 * h, 0.0, _at(person, 1.085)), 0.0, 0.0, Bone.HEAD))
    shell = tube(rings, _UP, _AHEAD, texture, sides=18, squareness=2.1)
    # Hair reaches lower at the nape than at the forehead.
    points = shell.points_m.copy()
    points[:, 2] += _HAIR_SLANT * points[:, 0]
    return replace(shell, points_m=points)


def _mane(person: Person, wardrobe: Wardrobe) -> Skin:
    """Long hair down to the shoulders, behind the ears."""
    h = person.height_m
    shape = [
        (-0.62, 0.012, 0.040, -0.040), (-0.45, 0.020, 0.052, -0.038), (-0.1, 0.024, 0.055, -0.034),
        (0.3, 0.032, 0.053, -0.026), (0.6, 0.042, 0.0505, -0.018), (0.8, 0.035, 0.043, -0.014),
        (0.92, 0.01, 0.02, -0.012),
    ]  # fmt: skip
    rings = [
        Ring((x * h, 0.0, _at(person, share)), deep * h, wide * h, Bone.HEAD, Bone.CHEST, 1.0 if share > -0.2 else 0.6)
        for share, deep, wide, x in shape
    ]
    return tube(rings, _UP, _AHEAD, wardrobe.hair, sides=14, squareness=2.4)


def _cap(person: Person, wardrobe: Wardrobe) -> list[Skin]:
    h = person.height_m
    dome = [
        (0.70, 0.0580, 0.0485),
        (0.78, 0.0580, 0.0485),
        (0.92, 0.0520, 0.0440),
        (1.02, 0.036, 0.030),
        (1.06, 0.0, 0.0),
    ]
    rings = [Ring((-0.002 * h, 0.0, _at(person, share)), deep * h, wide * h, Bone.HEAD) for share, deep, wide in dome]
    brim = [(0.690, 0.0, 0.0), (0.692, 0.050, 0.042), (0.712, 0.050, 0.042), (0.715, 0.0, 0.0)]
    shade = [Ring((0.045 * h, 0.0, _at(person, share)), deep * h, wide * h, Bone.HEAD) for share, deep, wide in brim]
    return [tube(rings, _UP, _AHEAD, wardrobe.accent, sides=18), tube(shade, _UP, _AHEAD, wardrobe.accent, sides=14)]
