"""Whether a drawn world can be played at all."""

import math
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.errors import ConfigError
from sdt_tools.scene.footprint import clearance_m
from sdt_tools.scene.layout import Box, Layout

OPERATOR_ROOM_M: Final = 0.2
"""What the middle of a person keeps from everything."""


def check_layout(layout: Layout) -> None:
    """Raise ConfigError where the robot starts in something, or the operator's path leads through something."""
    where = f"scenario '{layout.name}' with seed {layout.seed}"
    segments, circles = layout.segments(), layout.circles()
    if clearance_m(layout.robot.x_m, layout.robot.y_m, layout.robot.yaw_rad, segments, circles) <= 0.0:
        raise ConfigError(f"{where}: the robot starts in contact with something; move one of them")
    for i, box in enumerate(layout.boxes):
        if _holds(box, layout.robot.x_m, layout.robot.y_m):
            raise ConfigError(f"{where}: the robot starts inside box {i}; move one of them")
    path = layout.operator.path_m
    standing = np.array([(*path[0], layout.operator.leg_radius_m + layout.operator.leg_separation_m / 2)])
    if clearance_m(layout.robot.x_m, layout.robot.y_m, layout.robot.yaw_rad, segments[:0], standing) <= 0.0:
        raise ConfigError(f"{where}: the operator starts on the robot; move one of them")
    for i, leg in enumerate(zip(path, path[1:] or path, strict=False)):
        if path_room_m(leg, segments, circles) < OPERATOR_ROOM_M:
            raise ConfigError(
                f"{where}: the operator's path comes within {OPERATOR_ROOM_M} m of something after its point {i}; "
                "move the path or the obstacle"
            )


def _holds(box: Box, x_m: float, y_m: float) -> bool:
    c, s = math.cos(box.yaw_rad), math.sin(box.yaw_rad)
    dx_m, dy_m = x_m - box.x_m, y_m - box.y_m
    return abs(c * dx_m + s * dy_m) < box.length_m / 2 and abs(c * dy_m - s * dx_m) < box.width_m / 2


def path_room_m(
    leg: tuple[tuple[float, float], tuple[float, float]],
    segments: Float64[np.ndarray, "segments 4"],
    circles: Float64[np.ndarray, "circles 3"],
) -> float:
    """The least distance of a straight piece of path from segments and circles, looked at every few centimetres."""
    (x0, y0), (x1, y1) = leg
    steps = 1 + math.ceil(math.hypot(x1 - x0, y1 - y0) / 0.05)
    points = np.linspace((x0, y0), (x1, y1), steps)
    room = math.inf
    if len(segments):
        start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
        offset = points[:, None] - start
        share = np.clip((offset * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-12), 0.0, 1.0)
        room = min(room, float(np.linalg.norm(offset - share[..., None] * along, axis=-1).min()))
    if len(circles):
        distances = np.linalg.norm(points[:, None] - circles[:, :2], axis=-1) - circles[:, 2]
        room = min(room, float(distances.min()))
    return room
