"""Practice worlds: an endless family of short scenes for training data, none of them a standard scenario.

Seeds 0 to 999 are for training and tuning; results are reported on others. What the family must bring, and how:

- all seven classes: the operator also comes up to the robot and goes round it, so that it backs off and turns;
- odd starts: he stands anywhere from 0.45 to 2.4 m off, mostly ahead, sometimes far aside;
- leads of up to 2.4 m, also between walls, where a network that never saw them stays for ever;
- the family ``too_close``: somebody or something within 0.25 m of the LiDAR's front rays.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final, Literal

import numpy as np
from jaxtyping import Float64

from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.footprint import clearance_m, distance_to_footprint_m
from sdt_tools.scene.layout import Box, GestureEvent, Layout, OperatorPlan, lidar_pose
from sdt_tools.scene.practice_rooms import Point, Room, draw_room
from sdt_tools.scene.seeds import Stream, generator
from sdt_tools.scene.sight import any_visible
from sdt_tools.scene.validity import path_room_m
from sdt_tools.scene.walker import Walker

Family = Literal["practice", "too_close"]
PRACTICE_FAMILIES: Final[dict[str, Family]] = {"practice": "practice", "practice_too_close": "too_close"}
"""The names by which scenarios are asked for."""

_TIMEOUT_S: Final = 14.0
_ROOM_FOR_OPERATOR_M: Final = 0.27
_LEAST_ROOM_M: Final = 0.01
_REACH_M: Final = 8.0
_POINTS: Final = 9
_TRIES: Final = 150


def practice_layout(seed: int, family: Family | None = None) -> Layout:
    """The practice world of ``seed``. Without a family, every eighth seed is of ``too_close``."""
    if family is None:
        family = "too_close" if seed % 8 == 7 else "practice"
    rng = generator(seed, Stream.LAYOUT if family == "practice" else Stream.TOO_CLOSE)
    while True:
        layout = _attempt(rng, seed, family)
        if layout is not None:
            return layout


def _attempt(rng: np.random.Generator, seed: int, family: Family) -> Layout | None:
    """One room with a robot and an operator in it; None if they do not find a place."""
    room = draw_room(rng)
    robot = _robot_place(rng, room)
    if abs(robot.x_m) > room.size_m[0] / 2 or abs(robot.y_m) > room.size_m[1] / 2:
        return None
    boxes = room.boxes
    close_box = family == "too_close" and rng.random() < 0.5
    if close_box:
        boxes = (*boxes, _box_in_front(rng, robot))
    bare = Layout("practice", seed, _TIMEOUT_S, robot, _nobody(), room.walls, boxes, room.posts)
    segments, circles = bare.segments(), bare.circles()
    if clearance_m(robot.x_m, robot.y_m, robot.yaw_rad, segments, circles) < (_LEAST_ROOM_M if close_box else 0.06):
        return None
    near_m = (0.24, 0.5) if family == "too_close" and not close_box else (0.45, 2.4)
    start = _operator_place(rng, robot, near_m, segments, circles)
    if start is None:
        return None
    path = _path(rng, room, robot, start, segments, circles, pursues=family == "too_close")
    layout = replace(
        bare,
        name="practice" if family == "practice" else "practice_too_close",
        operator=_plan(rng, path, family),
        gestures=(GestureEvent(0.0, Gesture.ENABLE, rng.uniform(1.0, 2.5)),),
        light=str(rng.choice(["indoor", "artificial", "dim", "sunlight"])),
    )
    legs_clear_m = clearance_m(robot.x_m, robot.y_m, robot.yaw_rad, segments[:0], Walker(layout).legs())
    return layout if legs_clear_m > _LEAST_ROOM_M else None


def _nobody() -> OperatorPlan:
    return OperatorPlan(((0.0, 0.0),), (0.0,), 0.5, 2.0, 0.4, 4.0, 0.0, 0.06, 0.25, 0.4, 0.0)


def _plan(rng: np.random.Generator, path: tuple[Point, ...], family: Family) -> OperatorPlan:
    first, later = (0.75, 0.3) if family == "practice" else (0.3, 0.1)
    rests = rng.random(len(path)) < np.where(np.arange(len(path)) == 0, first, later)
    pauses = np.where(rests, rng.uniform(0.3, 3.0, len(path)), 0.0)
    return OperatorPlan(
        path_m=path,
        pauses_s=tuple(pauses.tolist()),
        speed_mps=rng.uniform(0.4, 0.9),
        waits_at_lead_m=rng.uniform(1.5, 2.5),
        keeps_away_m=rng.uniform(0.11, 0.2) if family == "too_close" else rng.uniform(0.28, 0.5),
        patience_s=rng.uniform(0.3, 1.0) if family == "practice" else rng.uniform(1.0, 3.0),
        yaw_rad=rng.uniform(-math.pi, math.pi),
        leg_radius_m=rng.uniform(0.05, 0.075),
        leg_separation_m=rng.uniform(0.18, 0.32),
        step_length_m=rng.uniform(0.3, 0.5),
        first_phase_rad=rng.uniform(0.0, 2 * math.pi),
    )


def _robot_place(rng: np.random.Generator, room: Room) -> Pose2D:
    """On a way through a narrow place where there is one, else anywhere; half of the walkers there go along it."""
    if room.lines and rng.random() < 0.75:
        line = room.lines[0]
        i = int(rng.integers(len(line) - 1))
        (x0, y0), (x1, y1) = line[i], line[i + 1]
        share = rng.random()
        yaw = math.atan2(y1 - y0, x1 - x0) + rng.choice([0.0, math.pi]) + 0.15 * rng.standard_normal()
        x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        return Pose2D(
            x + 0.05 * rng.standard_normal(), y + 0.05 * rng.standard_normal(), math.remainder(yaw, 2 * math.pi)
        )
    reach_m = np.minimum(np.array(room.size_m) - 1.2, _REACH_M)
    x, y = (rng.uniform(-0.5, 0.5, 2) * reach_m).tolist()
    return Pose2D(x, y, rng.uniform(-math.pi, math.pi))


def _box_in_front(rng: np.random.Generator, robot: Pose2D) -> Box:
    """A box whose near side is 0.13 to 0.3 m ahead of the LiDAR, not quite square to it."""
    lidar = lidar_pose(robot)
    length, width = rng.uniform(0.1, 0.6), rng.uniform(0.1, 1.0)
    ahead, aside = rng.uniform(0.13, 0.3) + length / 2, rng.uniform(-0.35, 0.35)
    c, s = math.cos(robot.yaw_rad), math.sin(robot.yaw_rad)
    x, y = lidar.x_m + c * ahead - s * aside, lidar.y_m + s * ahead + c * aside
    return Box(x, y, length, width, robot.yaw_rad + rng.uniform(-0.3, 0.3), rng.uniform(0.4, 1.0))


def _operator_place(
    rng: np.random.Generator,
    robot: Pose2D,
    near_m: tuple[float, float],
    segments: Float64[np.ndarray, "segments 4"],
    circles: Float64[np.ndarray, "circles 3"],
) -> Point | None:
    """Somewhere in sight of the LiDAR, at a range in ``near_m``; None if that is not found."""
    lidar = lidar_pose(robot)
    for _ in range(_TRIES):
        range_m = rng.uniform(*near_m)
        bearing = rng.uniform(-2.2, 2.2) if rng.random() < 0.25 else 0.55 * rng.standard_normal()
        x = lidar.x_m + range_m * math.cos(lidar.yaw_rad + bearing)
        y = lidar.y_m + range_m * math.sin(lidar.yaw_rad + bearing)
        if distance_to_footprint_m(robot, x, y) < 0.1 + 0.12 * (near_m[0] > 0.3):
            continue
        if path_room_m(((x, y), (x, y)), segments, circles) < _ROOM_FOR_OPERATOR_M:
            continue
        if any_visible(lidar.x_m, lidar.y_m, np.array([[x, y, 0.0]]), segments, circles):
            return x, y
    return None


def _path(
    rng: np.random.Generator,
    room: Room,
    robot: Pose2D,
    start: Point,
    segments: Float64[np.ndarray, "segments 4"],
    circles: Float64[np.ndarray, "circles 3"],
    pursues: bool,
) -> tuple[Point, ...]:
    """Points that the operator can walk to in straight lines; each is drawn in one of five manners."""
    path = [start]
    turning = rng.choice([-1.0, 1.0])
    manners: tuple[Callable[[Point], Point], ...] = (
        lambda here: _anywhere(rng, here),
        lambda _here: _up_to(rng, robot),
        lambda here: _round(rng, robot, here, turning),
        lambda here: _along(rng, room, here),
        lambda _here: _behind(rng, robot),
    )
    habit = rng.dirichlet((1.2, 0.7, 0.8, 0.9 if room.lines else 1e-3, 4.0 if pursues else 1e-3))
    for _ in range(_TRIES):
        goal = manners[rng.choice(len(manners), p=habit)](path[-1])
        if path_room_m((path[-1], goal), segments, circles) >= _ROOM_FOR_OPERATOR_M:
            path.append(goal)
        if len(path) == _POINTS:
            break
    return tuple(path)


def _anywhere(rng: np.random.Generator, here: Point) -> Point:
    heading, length = rng.uniform(-math.pi, math.pi), rng.uniform(0.4, 3.5)
    return here[0] + length * math.cos(heading), here[1] + length * math.sin(heading)


def _up_to(rng: np.random.Generator, robot: Pose2D) -> Point:
    """Where the robot started: it will have to back off."""
    return robot.x_m + 0.4 * rng.standard_normal(), robot.y_m + 0.4 * rng.standard_normal()


def _behind(rng: np.random.Generator, robot: Pose2D) -> Point:
    """Beyond where the robot started: he drives it before him."""
    heading, length = robot.yaw_rad + math.pi + 0.3 * rng.standard_normal(), rng.uniform(0.5, 3.5)
    return robot.x_m + length * math.cos(heading), robot.y_m + length * math.sin(heading)


def _round(rng: np.random.Generator, robot: Pose2D, here: Point, turning: float) -> Point:
    """Some way round the place where the robot started, near enough that it turns on the spot."""
    angle = math.atan2(here[1] - robot.y_m, here[0] - robot.x_m) + turning * rng.uniform(0.4, 1.4)
    radius = rng.uniform(0.8, 1.3)
    return robot.x_m + radius * math.cos(angle), robot.y_m + radius * math.sin(angle)


def _along(rng: np.random.Generator, room: Room, here: Point) -> Point:
    """A point of the way through the narrow place, or anywhere if there is none."""
    if not room.lines:
        return _anywhere(rng, here)
    line = room.lines[0]
    i, share = int(rng.integers(len(line) - 1)), rng.random()
    (x0, y0), (x1, y1) = line[i], line[i + 1]
    return x0 + share * (x1 - x0), y0 + share * (y1 - y0)
