"""The layout's boxes and posts as solids, and the dark rims around their feet."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.scene.layout import Box, Post
from sdt_tools.scene.rendering import paint
from sdt_tools.scene.rendering.decor import box_pictures
from sdt_tools.scene.rendering.light import Light
from sdt_tools.scene.rendering.mesh import ONE_SIDED, SHADE, Mesh, grid_triangles, join, panel, vector
from sdt_tools.scene.rendering.texture import TextureBank

_INSET: Final = 0.5 / paint.SIDE
"""Half a texel: keeps a picture's far edge from showing at its near one."""
_POST_SIDES: Final = 12
_RIM_M: Final = 0.16


def build_box(box: Box, light: Light, bank: TextureBank, rng: np.random.Generator) -> tuple[Mesh, Mesh]:
    """A box with painted sides and lid, lit; and its rim on the floor."""
    side_picture, lid_picture = box_pictures(rng)
    side_texture, lid_texture = bank.add(side_picture), bank.add(lid_picture)
    corners = np.column_stack([box.corners(), np.zeros(4)])
    up = vector(0.0, 0.0, box.height_m)
    scale, whole = (1 - 2 * _INSET, 1 - 2 * _INSET), np.array([0.0, 1.0])
    faces = [
        panel(
            corners[i],
            corners[(i + 1) % 4] - corners[i],
            up,
            whole,
            np.array([0.0, 0.15, 1.0]),
            scale,
            side_texture,
            ONE_SIDED,
            (_INSET, _INSET),
        )
        for i in range(4)
    ]
    lid = panel(
        corners[0] + up,
        corners[1] - corners[0],
        corners[3] - corners[0],
        whole,
        whole,
        scale,
        lid_texture,
        ONE_SIDED,
        (_INSET, _INSET),
    )
    solid = join([*faces, lid])
    contact = 1 - 0.4 * np.exp(-solid.points_m[:, 2] / (0.15 * box.height_m))
    return solid.lit(light.at(solid.points_m, solid.normals) * contact), _rim(corners)


def build_post(
    post: Post, height_m: float, light: Light, bank: TextureBank, rng: np.random.Generator
) -> tuple[Mesh, Mesh]:
    """A round post of ``height_m`` in wood, steel or paint, lit; and its rim on the floor.

    The outline has the post's radius at its corners, as the LiDAR sees it to within 3.5 % of the radius.
    """
    kind = rng.integers(3)
    if kind == 0:
        color = paint.color_hsv(rng.uniform(20, 34), rng.uniform(0.3, 0.6), rng.uniform(0.3, 0.7))
    elif kind == 1:
        color = paint.color_hsv(210.0, 0.04, rng.uniform(0.2, 0.7))
    else:
        color = paint.color_hsv(rng.uniform(0, 360), rng.uniform(0.3, 0.9), rng.uniform(0.3, 0.8))
    texture = bank.add(paint.plaster(rng, color))
    angles = np.linspace(0, 2 * math.pi, _POST_SIDES + 1)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    heights = np.array([0.0, 0.12, height_m])
    tube = Mesh(
        np.concatenate([ring * post.radius_m + (post.x_m, post.y_m, z) for z in heights]),
        np.tile(ring, (len(heights), 1)),
        np.concatenate([np.column_stack([angles / 6.3, np.full_like(angles, 1 - z / 2)]) for z in heights]),
        np.ones(len(angles) * len(heights)),
        (triangles := grid_triangles(len(heights), len(angles))),
        np.full(len(triangles), texture, np.int32),
        np.full(len(triangles), ONE_SIDED, np.uint8),
    )
    cap = _fan(ring[:-1] * post.radius_m + (post.x_m, post.y_m, height_m), texture)
    solid = join([tube, cap])
    contact = 1 - 0.4 * np.exp(-solid.points_m[:, 2] / 0.06)
    return solid.lit(light.at(solid.points_m, solid.normals) * contact), _rim(
        ring[:-1] * post.radius_m + (post.x_m, post.y_m, 0.0)
    )


def _fan(outline_m: Float64[np.ndarray, "corners 3"], texture: int) -> Mesh:
    """A flat convex lid over a counter-clockwise outline."""
    count = len(outline_m)
    triangles = np.array([(0, i, i + 1) for i in range(1, count - 1)], np.int32)
    return Mesh(
        outline_m,
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        np.full((count, 2), 0.5),
        np.ones(count),
        triangles,
        np.full(len(triangles), texture, np.int32),
        np.full(len(triangles), ONE_SIDED, np.uint8),
    )


def _rim(outline_m: Float64[np.ndarray, "corners 3"]) -> Mesh:
    """A soft dark rim on the floor around a convex counter-clockwise outline."""
    return ring_shade(outline_m, _RIM_M, 0.45)


def ring_shade(outline_m: Float64[np.ndarray, "corners 3"], reach_m: float, darkest: float) -> Mesh:
    """Shade that is ``darkest`` along a convex outline on the floor and gone ``reach_m`` outside it."""
    middle = outline_m.mean(axis=0)
    away = outline_m - middle
    outer = outline_m + away / np.linalg.norm(away, axis=1, keepdims=True) * reach_m * 1.2
    count = len(outline_m)
    closed = [*range(count), 0]
    triangles = grid_triangles(2, count + 1)
    return Mesh(
        np.concatenate([outline_m[closed], outer[closed]]),
        np.tile([0.0, 0.0, 1.0], (2 * count + 2, 1)),
        np.zeros((2 * count + 2, 2)),
        np.repeat([darkest, 1.0], count + 1),
        triangles,
        np.zeros(len(triangles), np.int32),
        np.full(len(triangles), SHADE, np.uint8),
    )


def build_furniture(
    boxes: Sequence[Box], posts: Sequence[Post], light: Light, bank: TextureBank, rng: np.random.Generator
) -> tuple[Mesh, Mesh]:
    """All boxes and posts, lit; and their rims. Posts are as high as tables: they never hide the operator's arms."""
    built = [build_box(box, light, bank, rng) for box in boxes]
    height = float(rng.uniform(0.7, 0.8))
    built += [build_post(post, height, light, bank, rng) for post in posts]
    return join([solid for solid, _ in built]), join([rim for _, rim in built])
