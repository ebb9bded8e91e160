"""What a flawless LiDAR measures: ray casting over segments and circles.

A ray at angle φ in the LiDAR's frame that meets a straight line at distance t has 1/t = p·cos φ + q·sin φ. So a segment
costs two angles, which give its span of rays, and then two multiplications a ray; the nearest hit is the greatest 1/t,
and one division a ray ends the scan. The angles are approximate, and only propose the first and the last ray of a
span; the signs of cross products decide, which neighbouring segments compute identically at the corner they share. So
no ray slips through a corner.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, no_type_check

import numpy as np
from jaxtyping import Float64, Int64
from numba import njit

from sdt_tools.frames import MAX_RANGE_M, RAY_STEP_RAD, RAYS, ray_angles_rad

_COS: Final = np.cos(ray_angles_rad())
_SIN: Final = np.sin(ray_angles_rad())
_RAYS_PER_RAD: Final = 1.0 / RAY_STEP_RAD
_MIDDLE: Final = RAYS // 2
_LAST: Final = RAYS - 1
_LEAST_INVERSE: Final = 1.0 / MAX_RANGE_M
_SLACK: Final = 0.02
"""Rays by which a proposed span is widened before it is cut; the error of ``_angle`` is 0.0012 rays."""


@njit(cache=True)
@no_type_check
def cast_rays(x_m, y_m, yaw_rad, segments, circles, out):
    """Write into ``out`` (541 float64) what a LiDAR at this pose sees of ``segments`` (n, 4) and ``circles`` (n, 3).

    Metres; a ray that meets nothing within 20 m measures 20.0. From within a circle every ray measures 0.
    """
    for k in range(RAYS):
        out[k] = _LEAST_INVERSE
    c = math.cos(yaw_rad)
    s = math.sin(yaw_rad)
    for j in range(segments.shape[0]):
        px = segments[j, 0] - x_m
        py = segments[j, 1] - y_m
        qx = segments[j, 2] - x_m
        qy = segments[j, 3] - y_m
        _cast_segment(c * px + s * py, c * py - s * px, c * qx + s * qy, c * qy - s * qx, out)
    for j in range(circles.shape[0]):
        px = circles[j, 0] - x_m
        py = circles[j, 1] - y_m
        _cast_circle(c * px + s * py, c * py - s * px, circles[j, 2], out)
    for k in range(RAYS):
        out[k] = 1.0 / out[k]


@njit(cache=True)
@no_type_check
def cast_rays_many(poses, segments, segment_ends, circles, circle_ends, out):
    """``cast_rays`` for many scenes: ``poses`` (scenes, 3) as x, y, yaw → ``out`` (scenes, 541).

    Scene i owns the rows of ``segments`` from ``segment_ends[i]`` to ``segment_ends[i + 1]``; the same of ``circles``.
    """
    for i in range(poses.shape[0]):
        cast_rays(
            poses[i, 0],
            poses[i, 1],
            poses[i, 2],
            segments[segment_ends[i] : segment_ends[i + 1]],
            circles[circle_ends[i] : circle_ends[i + 1]],
            out[i],
        )


@njit(cache=True, inline="always")
@no_type_check
def _angle(x, y):
    """atan2(y, x) to 1e-5 (Abramowitz and Stegun, 4.4.47, unfolded from the first octant)."""
    ax = abs(x)
    ay = abs(y)
    high = max(ax, ay)
    if high == 0.0:
        return 0.0
    z = min(ax, ay) / high
    t = z * z
    angle = z * (0.9998660 + t * (-0.3302995 + t * (0.1801410 + t * (-0.0851330 + t * 0.0208351))))
    if ay > ax:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    return -angle if y < 0.0 else angle


@njit(cache=True)
@no_type_check
def _cast_segment(ax, ay, bx, by, out):
    """Raise ``out``, inverse ranges, where the segment from a to b (LiDAR frame) is the nearest yet."""
    area = ax * by - ay * bx
    if area < 0.0:
        ax, bx, ay, by = bx, ax, by, ay
        area = -area
    if area == 0.0:
        return  # seen from its end, a segment has no width
    p = (by - ay) / area
    q = (ax - bx) / area
    first = _angle(ax, ay) * _RAYS_PER_RAD + _MIDDLE
    last = _angle(bx, by) * _RAYS_PER_RAD + _MIDDLE
    # a is now clockwise of b by less than 180°: the span holds the direction straight back exactly if it changes side
    if ay >= 0.0 and by < 0.0:
        _raise_span(ax, ay, bx, by, p, q, first, _LAST, out)
        _raise_span(ax, ay, bx, by, p, q, 0, last, out)
    else:
        _raise_span(ax, ay, bx, by, p, q, first, last, out)


@njit(cache=True)
@no_type_check
def _raise_span(ax, ay, bx, by, p, q, first, last, out):
    k0 = max(0, math.ceil(first - _SLACK))
    k1 = min(_LAST, math.floor(last + _SLACK))
    while k0 <= k1 and (ax * _SIN[k0] - ay * _COS[k0] < 0.0 or _COS[k0] * by - _SIN[k0] * bx < 0.0):
        k0 += 1
    while k0 <= k1 and (ax * _SIN[k1] - ay * _COS[k1] < 0.0 or _COS[k1] * by - _SIN[k1] * bx < 0.0):
        k1 -= 1
    for k in range(k0, k1 + 1):
        inverse = p * _COS[k] + q * _SIN[k]
        out[k] = inverse if inverse > out[k] else out[k]


@njit(cache=True)
@no_type_check
def _cast_circle(cx, cy, radius, out):
    """Raise ``out``, inverse ranges, where the circle around c (LiDAR frame) is the nearest yet."""
    square = cx * cx + cy * cy - radius * radius
    if square <= 0.0:
        for k in range(RAYS):
            out[k] = np.inf
        return
    centre = _angle(cx, cy) * _RAYS_PER_RAD + _MIDDLE
    half = _angle(math.sqrt(square), radius) * _RAYS_PER_RAD + _SLACK
    turn = 2.0 * math.pi * _RAYS_PER_RAD
    for wrap in range(-1, 2):
        k0 = max(0, math.ceil(centre - half + wrap * turn))
        k1 = min(_LAST, math.floor(centre + half + wrap * turn))
        for k in range(k0, k1 + 1):
            miss = cx * _SIN[k] - cy * _COS[k]
            inside = radius * radius - miss * miss
            if inside >= 0.0:
                inverse = 1.0 / (cx * _COS[k] + cy * _SIN[k] - math.sqrt(inside))
                out[k] = max(out[k], inverse)


@dataclass(frozen=True, eq=False)
class PackedScenes:
    """Segments and circles of many scenes in one array each, as ``cast_rays_many`` takes them."""

    segments: Float64[np.ndarray, "segments 4"]
    segment_ends: Int64[np.ndarray, "scenes_plus_1"]
    circles: Float64[np.ndarray, "circles 3"]
    circle_ends: Int64[np.ndarray, "scenes_plus_1"]


def pack_scenes(
    segments: Sequence[Float64[np.ndarray, "_ 4"]], circles: Sequence[Float64[np.ndarray, "_ 3"]]
) -> PackedScenes:
    """The scenes one after another; scene i has ``segments[i]`` and ``circles[i]``."""
    assert len(segments) == len(circles)
    return PackedScenes(
        np.concatenate([np.empty((0, 4)), *segments]),
        _ends([len(rows) for rows in segments]),
        np.concatenate([np.empty((0, 3)), *circles]),
        _ends([len(rows) for rows in circles]),
    )


def _ends(counts: Sequence[int]) -> Int64[np.ndarray, "counts_plus_1"]:
    return np.concatenate([np.zeros(1, np.int64), np.cumsum(np.array(counts, dtype=np.int64))])
