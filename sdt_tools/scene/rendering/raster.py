"""The rasterizer: textured triangles with true perspective into a picture of linear light, with a depth buffer.

With the corners of a triangle as the rows of a matrix V (camera axes), any attribute A that is linear over it has
A/z = α·((x-cx)/fx, (y-cy)/fy, 1) with V α = A: exact at every pixel, also where the near plane cuts the triangle.
Depth is exact; texture coordinates and light are exact at every eighth pixel of a row and run straight in between.
"""

import math
from typing import Final, no_type_check

import numpy as np
from jaxtyping import Float32
from numba import njit

from sdt_tools.scene.rendering.mesh import CAST, DECAL, ONE_SIDED, SHADE, Mesh
from sdt_tools.scene.rendering.projection import Pinhole, View
from sdt_tools.scene.rendering.texture import FULL, LANE_BITS, TexturePack

_NEAR_M: Final = 0.05
_DECAL_LIFT: Final = 1.004
"""A decal is drawn this much nearer than it is: 0.4 % of its distance."""
_ON_IT: Final = 0.996
"""What is farther than this share of a shadow's 1/z does not lie under it."""
_CAST_LIFT: Final = 1.0042
"""What has a shadow on it counts as this much nearer than it is, so that it gets none again."""
_BLOCK: Final = 8
_BLOCK_SHARES: Final = 1.0 / np.maximum(np.arange(_BLOCK + 1), 1)
_LEVEL_STEP: Final = 4.0 ** (-1.0 / 3.0)
_FIRST_LEVEL: Final = 4.0**1.5
"""Texels a pixel covers where level 1 takes over: levels are half a step finer than needed; the lens blurs the rest."""
_ORIGIN: Final = 65536.0 - 0.5
"""Added to texel coordinates, so that cutting towards zero is a floor; half a texel, for texels have middles."""
_FOUR, _ALL = np.uint64(4), np.uint64(256)
_GREEN, _RED = np.uint64(LANE_BITS), np.uint64(2 * LANE_BITS)
_LANE: Final = np.uint64((1 << LANE_BITS) - 1)


def draw(
    mesh: Mesh,
    textures: TexturePack,
    view: View,
    pinhole: Pinhole,
    radiance: Float32[np.ndarray, "height width 3"],
    inverse_depth: Float32[np.ndarray, "height width"],
) -> None:
    """Draw ``mesh`` into ``radiance`` (1 is a well-lit white sheet) where it is nearer than ``inverse_depth`` (1/m).

    Both buffers are changed in place; that is what they are for.
    """
    _draw(
        view.to_camera(mesh.points_m),
        mesh.uv,
        mesh.light,
        mesh.triangles,
        mesh.texture,
        mesh.flags,
        textures.texels,
        textures.offsets,
        textures.sizes,
        (pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy),
        radiance,
        inverse_depth,
    )


@njit(cache=True, error_model="numpy")
@no_type_check
def _draw(points, uv, light, triangles, texture, flags, texels, offsets, sizes, lens, radiance, inverse_depth):
    height, width = inverse_depth.shape
    outline_x, outline_y = np.empty(4), np.empty(4)
    for number in range(len(triangles)):
        i, j, k = triangles[number]
        a = (points[i, 0], points[i, 1], points[i, 2])
        b = (points[j, 0], points[j, 1], points[j, 2])
        c = (points[k, 0], points[k, 1], points[k, 2])
        if _outside(a, b, c, lens, width, height):
            continue
        # The columns of the inverse of V are these over the determinant.
        u, v, w = _cross(b, c), _cross(c, a), _cross(a, b)
        determinant = a[0] * u[0] + a[1] * u[1] + a[2] * u[2]
        flag = flags[number]
        if abs(determinant) < 1e-12 or (flag & ONE_SIDED and determinant > 0):
            continue
        corners = _outline(a, b, c, lens, outline_x, outline_y)
        top, bottom = outline_y[0], outline_y[0]
        for corner in range(1, corners):
            top, bottom = min(top, outline_y[corner]), max(bottom, outline_y[corner])
        rows = (max(0, math.ceil(top)), min(height, math.ceil(bottom)))
        if rows[0] >= rows[1]:
            continue
        scale = 1.0 / determinant
        inverse_z = _plane(u, v, w, scale, scale, scale, lens)
        brightness = _plane(u, v, w, light[i] * scale, light[j] * scale, light[k] * scale, lens)
        if flag & (SHADE | CAST):
            lift = _CAST_LIFT if flag & CAST else 0.0
            _shade(outline_x, outline_y, corners, rows, inverse_z, brightness, lift, radiance, inverse_depth)
            continue
        kind = texture[number]
        side = sizes[kind]
        scale *= side
        across = _plane(u, v, w, uv[i, 0] * scale, uv[j, 0] * scale, uv[k, 0] * scale, lens)
        down = _plane(u, v, w, uv[i, 1] * scale, uv[j, 1] * scale, uv[k, 1] * scale, lens)
        # A pixel covers ρ² z³ / (f² d) texels, with ρ² texels a square metre and d the plane's distance; the level
        # rises each time that grows fourfold, which is where 1/z falls by 4^(1/3).
        area = (uv[j, 0] - uv[i, 0]) * (uv[k, 1] - uv[i, 1]) - (uv[k, 0] - uv[i, 0]) * (uv[j, 1] - uv[i, 1])
        covered = abs(area) * side * side / (lens[0] * lens[1] * abs(determinant))
        level_1 = (covered / _FIRST_LEVEL) ** (1.0 / 3.0)
        lift = _DECAL_LIFT if flag & DECAL else 1.0
        _paint(
            outline_x, outline_y, corners, rows, inverse_z, brightness, across, down,
            texels, offsets[kind], side, level_1, lift, radiance, inverse_depth,
        )  # fmt: skip


@njit(cache=True, error_model="numpy")
@no_type_check
def _paint(
    outline_x, outline_y, corners, rows, inverse_z_plane, brightness_plane, across, down,
    texels, offsets, side, level_1, lift, radiance, inverse_depth,
):  # fmt: skip
    """Fill the outline with its texture where it is nearer than what is there."""
    width = inverse_depth.shape[1]
    per_light = 1.0 / (256.0 * FULL)
    for y in range(rows[0], rows[1]):
        start, stop = _span(outline_x, outline_y, corners, y, width)
        if start >= stop:
            continue
        inverse_z = inverse_z_plane[0] + inverse_z_plane[1] * start + inverse_z_plane[2] * y
        s_z = across[0] + across[1] * start + across[2] * y
        t_z = down[0] + down[1] * start + down[2] * y
        l_z = (brightness_plane[0] + brightness_plane[1] * start + brightness_plane[2] * y) * per_light
        # Texel coordinates are whole numbers of 1/65536 texel of the level in use.
        level, finer, coarser, size, to_level = 0, np.inf, level_1, side, 65536.0
        z = 1.0 / inverse_z
        block = start
        while block < stop:
            end = min(block + _BLOCK, stop)
            while inverse_z < coarser and size > 1:
                level, size, to_level = level + 1, size >> 1, to_level * 0.5
                finer, coarser = coarser, coarser * _LEVEL_STEP
            while inverse_z > finer:
                level, size, to_level = level - 1, size << 1, to_level * 2.0
                finer, coarser = np.inf if level == 0 else finer / _LEVEL_STEP, finer
            mask, offset = size - 1, offsets[level]
            # The next block's first pixel, or the row's last one: beyond it the surface may never be.
            count = end - block if end < stop else end - block - 1
            share = _BLOCK_SHARES[count]
            next_z = 1.0 / (inverse_z + inverse_z_plane[1] * count)
            s = int(s_z * z * to_level + _ORIGIN * 65536.0)
            t = int(t_z * z * to_level + _ORIGIN * 65536.0)
            light = np.float32(l_z * z)
            s_z += across[1] * count
            t_z += down[1] * count
            l_z += brightness_plane[1] * count * per_light
            s_step = int((s_z * next_z * to_level + _ORIGIN * 65536.0 - s) * share)
            t_step = int((t_z * next_z * to_level + _ORIGIN * 65536.0 - t) * share)
            light_step = (np.float32(l_z * next_z) - light) * np.float32(share)
            for x in range(block, end):
                if inverse_z * lift > inverse_depth[y, x]:
                    inverse_depth[y, x] = inverse_z * lift
                    # Bilinear in 1/16 texel, all three colours of a texel at once.
                    x0, y0 = (s >> 16) & mask, ((t >> 16) & mask) * size
                    x1, y1 = ((s >> 16) + 1) & mask, (((t >> 16) + 1) & mask) * size
                    right, low = np.uint64((s >> 12) & 15), np.uint64((t >> 12) & 15)
                    w11 = right * low
                    w10, w01 = (low << _FOUR) - w11, (right << _FOUR) - w11
                    w00 = _ALL - w01 - w10 - w11
                    mixed = (
                        w00 * texels[np.uintp(offset + y0 + x0)]
                        + w01 * texels[np.uintp(offset + y0 + x1)]
                        + w10 * texels[np.uintp(offset + y1 + x0)]
                        + w11 * texels[np.uintp(offset + y1 + x1)]
                    )
                    radiance[y, x, 0] = light * np.float32(np.int32(mixed & _LANE))
                    radiance[y, x, 1] = light * np.float32(np.int32((mixed >> _GREEN) & _LANE))
                    radiance[y, x, 2] = light * np.float32(np.int32(mixed >> _RED))
                s += s_step
                t += t_step
                light += light_step
                inverse_z += inverse_z_plane[1]
            block, z = end, next_z


@njit(cache=True, error_model="numpy")
@no_type_check
def _shade(outline_x, outline_y, corners, rows, inverse_z_plane, brightness_plane, lift, radiance, inverse_depth):
    """Multiply what lies on or behind the outline by its light; with a ``lift``, what lies on it alone, and once."""
    width = inverse_depth.shape[1]
    for y in range(rows[0], rows[1]):
        start, stop = _span(outline_x, outline_y, corners, y, width)
        for x in range(start, stop):
            inverse_z = inverse_z_plane[0] + inverse_z_plane[1] * x + inverse_z_plane[2] * y
            if lift > 0.0 and inverse_depth[y, x] < inverse_z * _ON_IT:
                continue
            if inverse_z * _DECAL_LIFT > inverse_depth[y, x]:
                if lift > 0.0:
                    inverse_depth[y, x] = inverse_z * lift
                factor = (brightness_plane[0] + brightness_plane[1] * x + brightness_plane[2] * y) / inverse_z
                for channel in range(3):
                    radiance[y, x, channel] *= np.float32(factor)


@njit(cache=True, error_model="numpy")
@no_type_check
def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True, error_model="numpy")
@no_type_check
def _plane(u, v, w, a, b, c, lens):
    """Of an attribute over z: its value at pixel (0, 0), its growth a pixel to the right, and a pixel down."""
    fx, fy, cx, cy = lens
    right = (u[0] * a + v[0] * b + w[0] * c) / fx
    down = (u[1] * a + v[1] * b + w[1] * c) / fy
    return (u[2] * a + v[2] * b + w[2] * c - right * cx - down * cy, right, down)


@njit(cache=True, error_model="numpy")
@no_type_check
def _outside(a, b, c, lens, width, height):
    """Whether all corners are too near, or beyond the same side of the picture (a plane through the camera)."""
    fx, fy, cx, cy = lens
    right, left, low, high = (width - cx) / fx, -(cx + 1) / fx, (height - cy) / fy, -(cy + 1) / fy
    return (
        (a[2] < _NEAR_M and b[2] < _NEAR_M and c[2] < _NEAR_M)
        or (a[0] > right * a[2] and b[0] > right * b[2] and c[0] > right * c[2])
        or (a[0] < left * a[2] and b[0] < left * b[2] and c[0] < left * c[2])
        or (a[1] > low * a[2] and b[1] > low * b[2] and c[1] > low * c[2])
        or (a[1] < high * a[2] and b[1] < high * b[2] and c[1] < high * c[2])
    )


@njit(cache=True, error_model="numpy")
@no_type_check
def _outline(a, b, c, lens, outline_x, outline_y):
    """The triangle's outline in pixels, cut at the near plane: the number of its corners, 3 or 4."""
    fx, fy, cx, cy = lens
    corners = (a, b, c)
    count = 0
    for i in range(3):
        here, there = corners[i], corners[(i + 1) % 3]
        if here[2] >= _NEAR_M:
            outline_x[count] = cx + fx * here[0] / here[2]
            outline_y[count] = cy + fy * here[1] / here[2]
            count += 1
        if (here[2] >= _NEAR_M) != (there[2] >= _NEAR_M):
            share = (_NEAR_M - here[2]) / (there[2] - here[2])
            outline_x[count] = cx + fx * (here[0] + share * (there[0] - here[0])) / _NEAR_M
            outline_y[count] = cy + fy * (here[1] + share * (there[1] - here[1])) / _NEAR_M
            count += 1
    return count


@njit(cache=True, error_model="numpy")
@no_type_check
def _span(outline_x, outline_y, corners, y, width):
    """The pixels [start, stop) of row ``y`` whose middles the convex outline covers."""
    left, right = np.inf, -np.inf
    for i in range(corners):
        j = i + 1 if i + 1 < corners else 0
        # From the upper to the lower end, whichever way the edge runs, so that neighbours agree to the last bit.
        upper, lower = (i, j) if outline_y[i] <= outline_y[j] else (j, i)
        if outline_y[upper] <= y < outline_y[lower]:
            share = (y - outline_y[upper]) / (outline_y[lower] - outline_y[upper])
            x = outline_x[upper] + share * (outline_x[lower] - outline_x[upper])
            left, right = min(left, x), max(right, x)
    if left > right:
        return 0, 0
    return max(0, math.ceil(left)), min(width, math.ceil(right))
