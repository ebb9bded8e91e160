"""Surfaces as triangles: where their corners are, what they are painted with, how much light falls on them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from jaxtyping import Float64, Int32, UInt8

# Compiled into the rasterizer: numba's cache does not notice when they change, so save raster.py.
SOLID: Final = 0
"""Seen from both sides."""
ONE_SIDED: Final = 1
"""Seen only from the side on which its corners run counter-clockwise."""
DECAL: Final = 2
"""Lies on another surface and wins over it."""
SHADE: Final = 4
"""Is not painted: multiplies what lies under it by its light. Belongs at the end of a mesh."""
CAST: Final = 8
"""As SHADE, but no pixel is darkened twice: the shadow of many triangles on one plane. Belongs behind all SHADE."""


Vector = Float64[np.ndarray, "3"]


def vector(x: float, y: float, z: float) -> Vector:
    """A point or direction."""
    return np.array([x, y, z], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in the world. ``uv`` counts whole textures; ``light`` is 1 for a well-lit white sheet."""

    points_m: Float64[np.ndarray, "points 3"]
    normals: Float64[np.ndarray, "points 3"]
    uv: Float64[np.ndarray, "points 2"]
    light: Float64[np.ndarray, "points"]
    triangles: Int32[np.ndarray, "triangles 3"]
    texture: Int32[np.ndarray, "triangles"]
    flags: UInt8[np.ndarray, "triangles"]

    def lit(self, light: Float64[np.ndarray, "points"]) -> "Mesh":
        """The same surface in another light."""
        return replace(self, light=light)


EMPTY: Final = Mesh(
    np.zeros((0, 3)),
    np.zeros((0, 3)),
    np.zeros((0, 2)),
    np.zeros(0),
    np.zeros((0, 3), np.int32),
    np.zeros(0, np.int32),
    np.zeros(0, np.uint8),
)


def join(meshes: Sequence[Mesh]) -> Mesh:
    """All ``meshes`` as one, in their order."""
    if not meshes:
        return EMPTY
    starts = np.cumsum([0] + [len(mesh.points_m) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.points_m for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate([mesh.light for mesh in meshes]),
        np.concatenate([mesh.triangles + np.int32(start) for mesh, start in zip(meshes, starts, strict=True)]),
        np.concatenate([mesh.texture for mesh in meshes]),
        np.concatenate([mesh.flags for mesh in meshes]),
    )


def grid_triangles(rows: int, columns: int) -> Int32[np.ndarray, "triangles 3"]:
    """Triangles over a grid of ``rows`` x ``columns`` points numbered row by row.

    Counter-clockwise as seen with columns running right and rows running up.
    """
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = np.stack([corner, corner + 1, corner + columns + 1, corner + columns], axis=1)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)


def panel(
    origin_m: Vector,
    along_m: Vector,
    up_m: Vector,
    along_shares: Float64[np.ndarray, "columns"],
    up_shares: Float64[np.ndarray, "rows"],
    uv_scale: tuple[float, float],
    texture: int,
    flags: int = SOLID,
    uv_origin: tuple[float, float] = (0.0, 0.0),
) -> Mesh:
    """A flat rectangle from ``origin_m`` over ``along_m`` and ``up_m``, cut at the given shares of both.

    Its front, and its normals, are where ``along`` x ``up`` points. ``uv_scale`` is how many textures fit along and up;
    v runs downwards, as pictures do.
    """
    s, t = (axis.ravel() for axis in np.meshgrid(along_shares, up_shares))
    normal = np.cross(along_m, up_m)
    triangles = grid_triangles(len(up_shares), len(along_shares))
    return Mesh(
        origin_m + s[:, None] * along_m + t[:, None] * up_m,
        np.tile(normal / np.linalg.norm(normal), (len(s), 1)),
        np.stack([uv_origin[0] + s * uv_scale[0], uv_origin[1] + (1 - t) * uv_scale[1]], axis=1),
        np.ones(len(s)),
        triangles,
        np.full(len(triangles), texture, np.int32),
        np.full(len(triangles), flags, np.uint8),
    )
