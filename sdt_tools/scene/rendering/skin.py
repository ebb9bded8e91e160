"""A body's surface at rest, each corner tied to one or two bones, and how the bones carry it along."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import no_type_check

import numpy as np
from jaxtyping import Float64, Int32, UInt8
from numba import njit

from sdt_tools.scene.rendering.mesh import ONE_SIDED, Mesh, grid_triangles
from sdt_tools.scene.rendering.skeleton import Bone, BonePoses


@dataclass(frozen=True, eq=False)
class Skin:
    """A surface in the rest posture. A corner follows ``first`` by ``share`` and ``second`` by the rest."""

    points_m: Float64[np.ndarray, "points 3"]
    normals: Float64[np.ndarray, "points 3"]
    uv: Float64[np.ndarray, "points 2"]
    openness: Float64[np.ndarray, "points"]
    """How much of the light from around reaches the corner, past the body itself."""
    first: Int32[np.ndarray, "points"]
    second: Int32[np.ndarray, "points"]
    share: Float64[np.ndarray, "points"]
    triangles: Int32[np.ndarray, "triangles 3"]
    texture: Int32[np.ndarray, "triangles"]
    flags: UInt8[np.ndarray, "triangles"]


@dataclass(frozen=True)
class Ring:
    """One cross-section of a tube: where, how wide across and deep, and which bones carry it."""

    at_m: tuple[float, float, float]
    across_m: float
    deep_m: float
    bone: Bone
    other: Bone | None = None
    share: float = 1.0
    """Of ``bone``; ``other`` has the rest."""
    openness: float = 1.0


def tube(
    rings: Sequence[Ring],
    axis: tuple[float, float, float],
    across: tuple[float, float, float],
    texture: int,
    sides: int = 12,
    squareness: float = 2.0,
    v_range: tuple[float, float] = (1.0, 0.0),
) -> Skin:
    """A closed tube through ``rings`` along ``axis``; ``across`` is where u = 1/2 lies, u = 0 and 1 meet behind it.

    ``squareness`` 2 gives ellipses, more gives rounder rectangles. v runs over ``v_range`` by the way along the rings.
    """
    across_axis = np.array(across)
    deep_axis = np.cross(np.array(axis), across_axis)
    angles = np.linspace(-math.pi, math.pi, sides + 1)
    cos, sin = np.cos(angles), np.sin(angles)
    power = 2.0 / squareness
    width = np.sign(cos) * np.abs(cos) ** power
    depth = np.sign(sin) * np.abs(sin) ** power
    centers = np.array([ring.at_m for ring in rings])
    half_across = np.array([ring.across_m for ring in rings])
    half_deep = np.array([ring.deep_m for ring in rings])
    points = (
        centers[:, None]
        + (half_across[:, None] * width)[..., None] * across_axis
        + (half_deep[:, None] * depth)[..., None] * deep_axis
    )
    steps = np.linalg.norm(np.diff(centers, axis=0), axis=1) + np.abs(np.diff(half_across)) * 0.5
    way = np.concatenate([[0.0], np.cumsum(steps)])
    v = v_range[0] + (v_range[1] - v_range[0]) * way / way[-1]
    u = np.linspace(0.0, 1.0, sides + 1)
    count = sides + 1
    triangles = grid_triangles(len(rings), count)

    def per_corner(values: Sequence[float | int]) -> Float64[np.ndarray, "points"]:
        return np.repeat(np.array(values, dtype=np.float64), count)

    return Skin(
        points.reshape(-1, 3),
        smooth_normals(points, np.array(axis)).reshape(-1, 3),
        np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1).reshape(-1, 2).astype(np.float64),
        per_corner([ring.openness for ring in rings]),
        per_corner([ring.bone for ring in rings]).astype(np.int32),
        per_corner([ring.bone if ring.other is None else ring.other for ring in rings]).astype(np.int32),
        per_corner([ring.share for ring in rings]),
        triangles,
        np.full(len(triangles), texture, np.int32),
        np.full(len(triangles), ONE_SIDED, np.uint8),
    )


def smooth_normals(
    points: Float64[np.ndarray, "rings columns 3"], axis: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "rings columns 3"]:
    """Outward unit normals of a tube whose first and last columns coincide; at its closed ends, along its axis."""
    body = points[:, :-1]
    around = np.roll(body, -1, axis=1) - np.roll(body, 1, axis=1)
    along = np.gradient(body, axis=0)
    normals = np.cross(around, along)
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    ends = np.where(np.arange(len(points))[:, None, None] * 2 < len(points), -axis, axis)
    normals = np.where(length > 1e-12, normals / np.maximum(length, 1e-12), ends)
    return np.concatenate([normals, normals[:, :1]], axis=1)


def join_skins(skins: Sequence[Skin]) -> Skin:
    """All ``skins`` as one."""
    starts = np.cumsum([0] + [len(skin.points_m) for skin in skins[:-1]])
    return Skin(
        np.concatenate([skin.points_m for skin in skins]),
        np.concatenate([skin.normals for skin in skins]),
        np.concatenate([skin.uv for skin in skins]),
        np.concatenate([skin.openness for skin in skins]),
        np.concatenate([skin.first for skin in skins]),
        np.concatenate([skin.second for skin in skins]),
        np.concatenate([skin.share for skin in skins]),
        np.concatenate([skin.triangles + np.int32(start) for skin, start in zip(skins, starts, strict=True)]),
        np.concatenate([skin.texture for skin in skins]),
        np.concatenate([skin.flags for skin in skins]),
    )


def carry(skin: Skin, bones: BonePoses) -> Mesh:
    """The surface where the bones carry it (linear blend skinning), not lit yet."""
    points, normals = np.empty_like(skin.points_m), np.empty_like(skin.normals)
    _blend(
        skin.points_m,
        skin.normals,
        skin.first,
        skin.second,
        skin.share,
        bones.rotations,
        bones.translations_m,
        points,
        normals,
    )
    return Mesh(points, normals, skin.uv, skin.openness, skin.triangles, skin.texture, skin.flags)


@njit(cache=True, error_model="numpy")
@no_type_check
def _blend(points, normals, first, second, share, rotations, translations, new_points, new_normals):
    for i in range(len(points)):
        a, b, w = first[i], second[i], share[i]
        square = 0.0
        for row in range(3):
            place, turned = w * translations[a, row] + (1 - w) * translations[b, row], 0.0
            for column in range(3):
                entry = w * rotations[a, row, column] + (1 - w) * rotations[b, row, column]
                place += entry * points[i, column]
                turned += entry * normals[i, column]
            new_points[i, row] = place
            new_normals[i, row] = turned
            square += turned * turned
        scale = 1.0 / math.sqrt(max(square, 1e-18))
        for row in range(3):
            new_normals[i, row] *= scale
