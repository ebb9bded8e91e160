"""How much room the robot's footprint has."""

import math
from typing import Final, no_type_check

from numba import njit

from sdt_tools.frames import ROBOT_LENGTH_M, ROBOT_WIDTH_M, Pose2D

_HALF_LENGTH: Final = ROBOT_LENGTH_M / 2
_HALF_WIDTH: Final = ROBOT_WIDTH_M / 2
_HALF_DIAGONAL: Final = math.hypot(_HALF_LENGTH, _HALF_WIDTH)
FAR_M: Final = 10.0
"""What ``clearance_m`` says of a robot that has nothing near."""


def distance_to_footprint_m(robot: Pose2D, x_m: float, y_m: float) -> float:
    """Distance of a point from the footprint of a robot centred at ``robot``; 0 inside."""
    dx, dy = x_m - robot.x_m, y_m - robot.y_m
    c, s = math.cos(robot.yaw_rad), math.sin(robot.yaw_rad)
    return math.hypot(max(abs(c * dx + s * dy) - _HALF_LENGTH, 0.0), max(abs(c * dy - s * dx) - _HALF_WIDTH, 0.0))


@njit(cache=True)
@no_type_check
def clearance_m(x_m, y_m, yaw_rad, segments, circles):
    """Distance from the footprint of a robot centred here to the nearest of ``segments`` and ``circles``.

    0 where the footprint lies across a segment, negative where it reaches into a circle, at most 10.
    """
    c = math.cos(yaw_rad)
    s = math.sin(yaw_rad)
    best = FAR_M
    for j in range(segments.shape[0]):
        px = segments[j, 0] - x_m
        py = segments[j, 1] - y_m
        qx = segments[j, 2] - x_m
        qy = segments[j, 3] - y_m
        if _to_segment(0.0, 0.0, px, py, qx, qy) - _HALF_DIAGONAL < best:
            room = _rectangle_to_segment(c * px + s * py, c * py - s * px, c * qx + s * qy, c * qy - s * qx)
            best = min(best, room)
    for j in range(circles.shape[0]):
        px = circles[j, 0] - x_m
        py = circles[j, 1] - y_m
        best = min(best, _to_rectangle(c * px + s * py, c * py - s * px) - circles[j, 2])
    return best


@njit(cache=True)
@no_type_check
def _to_rectangle(x, y):
    return math.hypot(max(abs(x) - _HALF_LENGTH, 0.0), max(abs(y) - _HALF_WIDTH, 0.0))


@njit(cache=True)
@no_type_check
def _to_segment(x, y, ax, ay, bx, by):
    ex = bx - ax
    ey = by - ay
    square = ex * ex + ey * ey
    along = 0.0
    if square > 0.0:
        along = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / square))
    return math.hypot(ax + along * ex - x, ay + along * ey - y)


@njit(cache=True)
@no_type_check
def _rectangle_to_segment(ax, ay, bx, by):
    if _crosses(ax, ay, bx, by):
        return 0.0
    best = min(_to_rectangle(ax, ay), _to_rectangle(bx, by))
    for corner in range(4):
        x = _HALF_LENGTH if corner < 2 else -_HALF_LENGTH
        y = _HALF_WIDTH if corner % 2 else -_HALF_WIDTH
        best = min(best, _to_segment(x, y, ax, ay, bx, by))
    return best


@njit(cache=True)
@no_type_check
def _crosses(ax, ay, bx, by):
    """Whether a part of the segment from a to b lies in the footprint (slabs, one axis after the other)."""
    enter = 0.0
    leave = 1.0
    for axis in range(2):
        start = ax if axis == 0 else ay
        change = bx - ax if axis == 0 else by - ay
        half = _HALF_LENGTH if axis == 0 else _HALF_WIDTH
        if change == 0.0:
            if abs(start) > half:
                return False
        else:
            t0 = (-half - start) / change
            t1 = (half - start) / change
            enter = max(enter, min(t0, t1))
            leave = min(leave, max(t0, t1))
    return enter <= leave
