"""Practice gestures: an operator before the robot who signals, walks, and does what might be taken for a signal.

People, rooms, light, distances and headings are drawn anew with each seed; seeds 0 to 999 are for training and tuning,
results are reported on others. What looks like a gesture comes at all times, walking and turned away too; for a gesture
he stands and faces the robot, from 0.8 to 3.5 m off, with an arm out of the picture now and then.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.footprint import clearance_m, distance_to_footprint_m
from sdt_tools.scene.layout import (
    Behaviour,
    BehaviourEvent,
    Box,
    GestureEvent,
    Layout,
    OperatorPlan,
    Sun,
    Surroundings,
    Wall,
    lidar_pose,
)
from sdt_tools.scene.manners import with_manners
from sdt_tools.scene.practice_rooms import Point, Room, draw_room
from sdt_tools.scene.seeds import Stream, generator
from sdt_tools.scene.sight import any_visible
from sdt_tools.scene.validity import path_room_m
from sdt_tools.scene.walker import Walker

NAME: Final = "practice_gestures"
_TIMEOUT_S: Final = 40.0
_NEAR_M, _FAR_M = 0.8, 3.5
_HALF_VIEW_RAD: Final = math.radians(30.0)
"""Where an operator's middle may be: at the edge an arm is out of the picture, whose own edge is at 40°."""
_ROOM_FOR_OPERATOR_M: Final = 0.27
_TRIES: Final = 200


def gesture_layout(seed: int) -> Layout:
    """The practice world of ``seed``."""
    rng = generator(seed, Stream.GESTURES)
    while True:
        layout = _attempt(rng, seed)
        if layout is not None:
            return layout


def _attempt(rng: np.random.Generator, seed: int) -> Layout | None:
    """One draw; None if robot and operator do not find a place in it."""
    surroundings: Surroundings = ("indoor", "outdoor", "garage")[rng.choice(3, p=(0.6, 0.25, 0.15))]
    room = draw_room(rng) if surroundings != "garage" else _garage(rng)
    robot = _robot_place(rng, room, surroundings)
    bare = Layout(NAME, seed, _TIMEOUT_S, robot, _nobody(), room.walls, room.boxes, room.posts)
    if clearance_m(robot.x_m, robot.y_m, robot.yaw_rad, bare.segments(), bare.circles()) < 0.06:
        return None
    path = _path(rng, bare)
    if path is None:
        return None
    gestures, behaviours = _doings(rng)
    layout = replace(
        bare,
        operator=_plan(rng, path),
        gestures=with_manners(gestures, rng),
        behaviours=with_manners(behaviours, rng),
        light=_light(rng, surroundings),
        surroundings=surroundings,
        sun=Sun(_azimuth(rng, robot), math.radians(rng.uniform(15.0, 60.0))),
        mask=bool(rng.random() < 0.25),
        camera="video",
    )
    legs_clear_m = clearance_m(robot.x_m, robot.y_m, robot.yaw_rad, np.zeros((0, 4)), Walker(layout).legs())
    return layout if legs_clear_m > 0.0 else None


def _light(rng: np.random.Generator, surroundings: Surroundings) -> str:
    if surroundings == "indoor":
        return ("indoor", "artificial", "dim")[rng.choice(3, p=(0.4, 0.4, 0.2))]
    return "sunlight" if rng.random() < 0.6 else "overcast"


def _azimuth(rng: np.random.Generator, robot: Pose2D) -> float:
    """Of the sun: often ahead of the robot, so that the operator stands against it."""
    aside = 0.5 * rng.standard_normal() if rng.random() < 0.4 else rng.uniform(-math.pi, math.pi)
    return math.remainder(robot.yaw_rad + aside, 2 * math.pi)


def _garage(rng: np.random.Generator) -> Room:
    """A garage that opens ahead on to a yard; the robot stands in it or before it."""
    deep, half = rng.uniform(4.0, 7.0), rng.uniform(1.4, 2.6)
    walls = (Wall(0.0, -half, -deep, -half), Wall(-deep, -half, -deep, half), Wall(-deep, half, 0.0, half))
    boxes = []
    for _ in range(int(rng.integers(1, 5))):
        length, width = rng.uniform(0.3, 1.0), rng.uniform(0.3, 0.6)
        side = 1.0 if rng.random() < 0.5 else -1.0
        x = -rng.uniform(0.6, deep - 0.6)
        boxes.append(Box(x, side * (half - width / 2 - 0.02), length, width, 0.0, rng.uniform(0.4, 1.8)))
    return Room((2 * deep, 2 * half), walls, tuple(boxes), lines=(((-deep + 1.0, 0.0), (1.0, 0.0)),))


def _robot_place(rng: np.random.Generator, room: Room, surroundings: Surroundings) -> Pose2D:
    if surroundings == "garage":
        inwards = rng.random() < 0.35  # from the yard, into the dark
        x = rng.uniform(0.5, 2.5) if inwards else rng.uniform(-3.2, -0.8)
        yaw = (math.pi if inwards else 0.0) + 0.2 * rng.standard_normal()
        return Pose2D(x, 0.3 * rng.standard_normal(), math.remainder(yaw, 2 * math.pi))
    reach_m = np.minimum(np.array(room.size_m) - 1.2, 8.0)
    x, y = (rng.uniform(-0.5, 0.5, 2) * reach_m).tolist()
    return Pose2D(x, y, rng.uniform(-math.pi, math.pi))


def _path(rng: np.random.Generator, bare: Layout) -> tuple[Point, ...] | None:
    """Two to six points before the robot that he can walk between; None if they are not found."""
    robot, lidar = bare.robot, lidar_pose(bare.robot)
    segments, circles = bare.segments(), bare.circles()
    wanted = int(rng.integers(2, 7))
    path: list[Point] = []
    for _ in range(_TRIES):
        range_m = rng.uniform(_NEAR_M, _FAR_M)
        bearing = float(np.clip(0.3 * rng.standard_normal(), -_HALF_VIEW_RAD, _HALF_VIEW_RAD))
        x = lidar.x_m + range_m * math.cos(lidar.yaw_rad + bearing)
        y = lidar.y_m + range_m * math.sin(lidar.yaw_rad + bearing)
        last = path[-1] if path else (x, y)
        if distance_to_footprint_m(robot, x, y) < 0.4 or path_room_m((last, (x, y)), segments, circles) < (
            _ROOM_FOR_OPERATOR_M
        ):
            continue
        if any_visible(lidar.x_m, lidar.y_m, np.array([[x, y, 0.0]]), segments, circles):
            path.append((x, y))
        if len(path) == wanted:
            return tuple(path)
    return None


def _doings(rng: np.random.Generator) -> tuple[list[GestureEvent], list[BehaviourEvent]]:
    """What he does one after the other, with rests between: signals as often as everything else."""
    gestures: list[GestureEvent] = []
    behaviours: list[BehaviourEvent] = []
    time_s = rng.uniform(0.8, 3.0)
    likes = rng.permutation(list(Behaviour)).tolist()
    make: tuple[Callable[[float, float], None], ...] = (
        lambda at, lasts: gestures.append(GestureEvent(at, Gesture.ENABLE, lasts)),
        lambda at, lasts: gestures.append(GestureEvent(at, Gesture.DISABLE, lasts)),
        lambda at, lasts: behaviours.append(BehaviourEvent(at, Behaviour(likes[len(behaviours) % len(likes)]), lasts)),
    )
    while time_s < _TIMEOUT_S - 3.0:
        lasts_s = rng.uniform(2.0, 4.5)
        make[rng.choice(3, p=(0.3, 0.3, 0.4))](time_s, lasts_s)
        time_s += lasts_s + rng.uniform(1.2, 3.0)
    return gestures, behaviours


def _nobody() -> OperatorPlan:
    return OperatorPlan(((0.0, 0.0),), (0.0,), 0.5, 2.0, 0.4, 4.0, 0.0, 0.06, 0.25, 0.4, 0.0)


def _plan(rng: np.random.Generator, path: tuple[Point, ...]) -> OperatorPlan:
    """He stands most of the time, mostly facing the robot."""
    rests_s = np.where(rng.random(len(path)) < 0.85, rng.uniform(3.0, 12.0, len(path)), 0.0)
    return OperatorPlan(
        path_m=path,
        pauses_s=(*rests_s[:-1].tolist(), _TIMEOUT_S),
        speed_mps=rng.uniform(0.3, 0.9),
        waits_at_lead_m=_FAR_M + 0.4,
        keeps_away_m=rng.uniform(0.3, 0.5),
        patience_s=rng.uniform(1.0, 3.0),
        yaw_rad=rng.uniform(-math.pi, math.pi),
        leg_radius_m=rng.uniform(0.05, 0.075),
        leg_separation_m=rng.uniform(0.18, 0.32),
        step_length_m=rng.uniform(0.3, 0.5),
        first_phase_rad=rng.uniform(0.0, 2 * math.pi),
        faces_off_rad=float(np.clip(0.3 * rng.standard_normal(), -0.8, 0.8)),
    )
