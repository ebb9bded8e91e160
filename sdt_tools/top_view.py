"""From the robot's frames to a screen on which ahead is up and left is left; all shapes are polylines in metres.

Rerun's plane view, like SVG and terminals, has x to the right and y *down*. A point that is x ahead and y to the left
is therefore drawn at (-y, -x).
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float32, Float64

from sdt_tools.frames import LIDAR_AHEAD_M, MAX_RANGE_M, ROBOT_LENGTH_M, ROBOT_WIDTH_M, Twist, ray_angles_rad

SMALLEST_DISTANCE_M: Final = 0.005
"""The LMS1xx reports codes, not distances, as 0.000, 0.002 and 0.003 m."""

ZONE_FIRST_RAY: Final = 150
ZONE_LAST_RAY: Final = 389
ZONE_RANGE_M: Final = 0.2
"""The near region of the safety domains (the paper's Table II): 0 to 0.2 m on rays 150 to 389."""

ARROW_HEAD_M: Final = 0.14

_ANGLES_RAD = ray_angles_rad()
_COSINES = np.cos(_ANGLES_RAD)
_SINES = np.sin(_ANGLES_RAD)


@dataclass(frozen=True)
class Mount:
    """Where the LiDAR stands on the robot, seen from the base's centre, in the plane."""

    ahead_m: float = LIDAR_AHEAD_M
    left_m: float = 0.0
    yaw_rad: float = 0.0


def to_screen(points_m: Float64[np.ndarray, "*points 2"]) -> Float32[np.ndarray, "*points 2"]:
    """Points (x ahead, y left) where the view draws them: ahead is up, left is left."""
    screen: Float32[np.ndarray, "*points 2"] = -points_m[..., ::-1].astype(np.float32)
    return screen


def distances(ranges_m: Float64[np.ndarray, "scans rays"]) -> Bool[np.ndarray, "scans rays"]:
    """Which readings are distances: neither a code nor the full range of the sensor, where nothing was hit."""
    hit: Bool[np.ndarray, "scans rays"] = ~codes(ranges_m) & (ranges_m < MAX_RANGE_M)
    return hit


def codes(ranges_m: Float64[np.ndarray, "scans rays"]) -> Bool[np.ndarray, "scans rays"]:
    """Which readings are codes of the sensor, or not numbers."""
    distance: Bool[np.ndarray, "scans rays"] = np.isfinite(ranges_m) & (ranges_m >= SMALLEST_DISTANCE_M)
    return ~distance


def hits_lidar(ranges_m: Float64[np.ndarray, "scans rays"]) -> Float64[np.ndarray, "scans rays 2"]:
    """Where each ray ends, in the LiDAR frame."""
    return np.stack([ranges_m * _COSINES, ranges_m * _SINES], axis=2)


def front_range_m(ranges_m: Float64[np.ndarray, "scans rays"]) -> Float64[np.ndarray, "scans"]:
    """The smallest distance on the rays of the safety zone; NaN where none of them has one."""
    front = ranges_m[:, ZONE_FIRST_RAY : ZONE_LAST_RAY + 1]
    nearest = np.where(distances(front), front, np.inf).min(axis=1)
    return np.where(np.isfinite(nearest), nearest, np.nan)


def arc(radius_m: float, first_rad: float, last_rad: float) -> Float64[np.ndarray, "points 2"]:
    """Points of a circle around the origin, about three degrees apart."""
    points = max(2, 1 + math.ceil(abs(last_rad - first_rad) / math.radians(3.0)))
    angles = np.linspace(first_rad, last_rad, points)
    return radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def safety_zone_lidar() -> Float64[np.ndarray, "points 2"]:
    """The outline of the near region of the safety domains, closed at the LiDAR."""
    rim = arc(ZONE_RANGE_M, float(_ANGLES_RAD[ZONE_FIRST_RAY]), float(_ANGLES_RAD[ZONE_LAST_RAY]))
    return np.concatenate([np.zeros((1, 2)), rim, np.zeros((1, 2))])


def footprint_base() -> list[Float64[np.ndarray, "_ 2"]]:
    """The robot's rectangle, and a chevron that points ahead, around the base's centre."""
    half = np.array([ROBOT_LENGTH_M, ROBOT_WIDTH_M]) / 2
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]]) * half
    chevron = np.array([[-0.35, 0.5], [0.25, 0.0], [-0.35, -0.5]]) * half
    return [corners, chevron]


def motion_base(twist: Twist, seconds: float = 1.6) -> list[Float64[np.ndarray, "_ 2"]]:
    """The way of the base's centre in ``seconds`` of a constant twist, with an arrow head; for no motion, a circle."""
    if twist.linear_mps == 0.0 and twist.angular_radps == 0.0:
        return [arc(0.1, -math.pi, math.pi)]
    times_s = np.linspace(0.0, seconds, 16)
    yaws = twist.angular_radps * times_s
    if twist.angular_radps == 0.0:
        path = np.stack([twist.linear_mps * times_s, np.zeros_like(times_s)], axis=1)
    else:
        radius_m = twist.linear_mps / twist.angular_radps
        path = radius_m * np.stack([np.sin(yaws), 1.0 - np.cos(yaws)], axis=1)
    direction = float(yaws[-1]) + (math.pi if twist.linear_mps < 0.0 else 0.0)
    barbs = path[-1] - ARROW_HEAD_M * np.array(
        [[math.cos(direction + side), math.sin(direction + side)] for side in (-0.5, 0.5)]
    )
    return [path, np.stack([barbs[0], path[-1], barbs[1]])]


def base_to_lidar(points_base: Float64[np.ndarray, "points 2"], mount: Mount) -> Float64[np.ndarray, "points 2"]:
    """Points around the base's centre as the LiDAR sees them."""
    seen: Float64[np.ndarray, "points 2"] = (points_base - (mount.ahead_m, mount.left_m)) @ _rotation(mount.yaw_rad)
    return seen


def place(
    points_m: Float64[np.ndarray, "points 2"], poses: Float64[np.ndarray, "rows 3"]
) -> Float64[np.ndarray, "rows points 2"]:
    """A shape around the origin, moved to each of ``poses`` (x m, y m, yaw rad)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = np.outer(c, points_m[:, 0]) - np.outer(s, points_m[:, 1])
    y = np.outer(s, points_m[:, 0]) + np.outer(c, points_m[:, 1])
    placed: Float64[np.ndarray, "rows points 2"] = np.stack([x, y], axis=2) + poses[:, None, :2]
    return placed


def lidar_poses(bases: Float64[np.ndarray, "rows 3"], mount: Mount) -> Float64[np.ndarray, "rows 3"]:
    """Where the LiDAR stands when the base stands at ``bases`` (x m, y m, yaw rad)."""
    placed = place(np.array([[mount.ahead_m, mount.left_m]]), bases)[:, 0]
    return np.column_stack([placed, bases[:, 2] + mount.yaw_rad])


def seen_from(
    observers: Float64[np.ndarray, "rows 3"], seen: Float64[np.ndarray, "rows 3"]
) -> Float64[np.ndarray, "rows 3"]:
    """Poses ``seen`` in the frames of ``observers``, row by row, both given in one frame (x m, y m, yaw rad)."""
    away = seen[:, :2] - observers[:, :2]
    c, s = np.cos(observers[:, 2]), np.sin(observers[:, 2])
    ahead, left = c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]
    return np.column_stack([ahead, left, seen[:, 2] - observers[:, 2]])


def _rotation(yaw_rad: float) -> Float64[np.ndarray, "2 2"]:
    """Turns rows of points by -``yaw_rad``: into a frame that is turned by ``yaw_rad``."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, -s], [s, c]])
