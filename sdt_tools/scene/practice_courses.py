"""Practice courses: whole walks through gates, halls and past boxes and tables, for training and tuning.

They have the elements of the standard scenarios, but neither their dimensions nor their order: one to three elements
stand one behind the other, with turns between them, in a room of any size around. Where the short practice worlds show
many situations, courses show how one leads to the next.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.footprint import clearance_m
from sdt_tools.scene.layout import Box, GestureEvent, Layout, OperatorPlan, Post, Wall
from sdt_tools.scene.practice_rooms import Point
from sdt_tools.scene.seeds import Stream, generator
from sdt_tools.scene.validity import OPERATOR_ROOM_M, path_room_m
from sdt_tools.scene.walker import Walker

NAME: Final = "practice_course"
_TIMEOUT_S: Final = 90.0
_LEAST_ROOM_M: Final = 0.08


@dataclass(frozen=True)
class _Element:
    """What stands along a piece of way that begins at the origin, ahead; the way ends at its last point, in ``yaw``."""

    way: tuple[Point, ...]
    yaw_rad: float = 0.0
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    posts: tuple[Post, ...] = ()


_Draw = Callable[[np.random.Generator], _Element]


def course_layout(seed: int) -> Layout:
    """The course of ``seed``."""
    rng = generator(seed, Stream.COURSE)
    while True:
        layout = _attempt(rng, seed)
        if layout is not None:
            return layout


def _attempt(rng: np.random.Generator, seed: int) -> Layout | None:
    """One draw; None if its elements stand in each other's way."""
    first: tuple[_Draw, ...] = (_start_ahead, _start_ahead, _start_ahead, _start_cornered, _start_garage)
    later: tuple[_Draw, ...] = (_open, _gate, _hall, _slalom, _table, _posts, _bend)
    weights = (0.08, 0.22, 0.28, 0.15, 0.2, 0.04, 0.03)
    elements = [first[rng.integers(len(first))](rng)]
    for _ in range(int(rng.integers(1, 4))):
        elements += [_open(rng)] if rng.random() < 0.5 else []
        elements.append(later[rng.choice(len(later), p=weights)](rng))
    elements.append(_open(rng))
    course = _chained(elements, mirrored=bool(rng.random() < 0.5))
    around = _room_around(rng, course)
    robot = Pose2D(rng.normal(0.0, 0.05), rng.normal(0.0, 0.05), rng.normal(0.0, 0.12))
    layout = Layout(
        name=NAME,
        seed=seed,
        timeout_s=_TIMEOUT_S,
        robot=robot,
        operator=_plan(rng, course.way),
        walls=(*around, *course.walls),
        boxes=course.boxes,
        posts=course.posts,
        gestures=(GestureEvent(0.0, Gesture.ENABLE, 1.5),),
        light=str(rng.choice(["indoor", "artificial", "dim", "sunlight"])),
    )
    return layout if _can_be_walked(layout) else None


def _can_be_walked(layout: Layout) -> bool:
    segments, circles, robot = layout.segments(), layout.circles(), layout.robot
    at_robot = (robot.x_m, robot.y_m, robot.yaw_rad)
    if clearance_m(*at_robot, segments, circles) < _LEAST_ROOM_M:
        return False
    if clearance_m(*at_robot, segments[:0], Walker(layout).legs()) < _LEAST_ROOM_M:
        return False
    return all(path_room_m(leg, segments, circles) > OPERATOR_ROOM_M + 0.03 for leg in pairwise(layout.operator.path_m))


def _plan(rng: np.random.Generator, way: Sequence[Point]) -> OperatorPlan:
    rests = rng.random(len(way)) < 0.25
    pauses_s = np.where(rests, rng.uniform(0.3, 2.5, len(way)), 0.0)
    return OperatorPlan(
        path_m=tuple(way),
        pauses_s=(rng.uniform(0.3, 2.5), *pauses_s[1:].tolist()),
        speed_mps=rng.uniform(0.25, 0.6),
        waits_at_lead_m=rng.uniform(1.2, 2.4),
        keeps_away_m=rng.uniform(0.3, 0.5),
        patience_s=rng.uniform(2.0, 5.0),
        yaw_rad=math.pi,
        leg_radius_m=rng.uniform(0.05, 0.075),
        leg_separation_m=rng.uniform(0.18, 0.32),
        step_length_m=rng.uniform(0.3, 0.5),
        first_phase_rad=rng.uniform(0.0, 2 * math.pi),
    )


def _chained(elements: Sequence[_Element], mirrored: bool) -> _Element:
    """The elements one behind the other, in the frame of the first."""
    way: list[Point] = []
    walls: list[Wall] = []
    boxes: list[Box] = []
    posts: list[Post] = []
    at = Pose2D(0.0, 0.0, 0.0)
    side = -1.0 if mirrored else 1.0

    def place(point: Point) -> Point:
        c, s = math.cos(at.yaw_rad), math.sin(at.yaw_rad)
        x, y = at.x_m + c * point[0] - s * point[1], at.y_m + s * point[0] + c * point[1]
        return x, side * y

    for element in elements:
        way += [place(point) for point in element.way]
        walls += [Wall(*place((wall.x0_m, wall.y0_m)), *place((wall.x1_m, wall.y1_m))) for wall in element.walls]
        boxes += [
            Box(
                *place((box.x_m, box.y_m)),
                box.length_m,
                box.width_m,
                side * (at.yaw_rad + box.yaw_rad),
                box.height_m,
            )
            for box in element.boxes
        ]
        posts += [Post(*place((post.x_m, post.y_m)), post.radius_m) for post in element.posts]
        x, y = place(element.way[-1])
        at = Pose2D(x, side * y, at.yaw_rad + element.yaw_rad)
    return _Element(tuple(way), 0.0, tuple(walls), tuple(boxes), tuple(posts))


def _room_around(rng: np.random.Generator, course: _Element) -> tuple[Wall, ...]:
    """Four walls, some way off all that stands and moves inside."""
    points = np.array(
        [
            (0.0, 0.0),
            *course.way,
            *((box.x_m, box.y_m) for box in course.boxes),
            *((w.x1_m, w.y1_m) for w in course.walls),
        ]
    )
    (left, low), (right, high) = points.min(0) - rng.uniform(0.9, 3.5, 2), points.max(0) + rng.uniform(0.9, 3.5, 2)
    corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
    return tuple(Wall(*a, *b) for a, b in pairwise(corners))


def _start_ahead(rng: np.random.Generator) -> _Element:
    """The operator stands ahead of the robot."""
    x, y = rng.uniform(0.9, 2.0), rng.normal(0.0, 0.2)
    return _Element(((x, y),), math.atan2(y, x))


def _start_cornered(rng: np.random.Generator) -> _Element:
    """The robot's nose is in a corner; the operator leads it out to the side and back."""
    ahead, aside = rng.uniform(0.8, 1.4), rng.uniform(0.5, 1.1)
    x, y = rng.uniform(-0.1, 0.5), rng.uniform(0.9, 1.3)
    way = ((x, y), (x - rng.uniform(0.4, 1.0), y + rng.uniform(0.5, 0.9)))
    walls = (Wall(ahead, -aside, ahead, rng.uniform(1.5, 5.0)), Wall(ahead, -aside, -rng.uniform(1.5, 5.0), -aside))
    return _Element(way, rng.uniform(2.2, 3.4), walls)


def _start_garage(rng: np.random.Generator) -> _Element:
    """The operator drives the robot before him, backwards, into a garage or just back, and leads it out again."""
    half, depth = rng.uniform(0.6, 0.95), rng.uniform(1.0, 2.6)
    mouth = -rng.uniform(0.35, 0.8)
    thick = rng.uniform(0.08, 0.4)
    boxes: tuple[Box, ...] = ()
    if rng.random() < 0.7:
        boxes = tuple(Box(mouth - depth / 2, side * (half + thick / 2), depth, thick, 0.0, 1.6) for side in (-1.0, 1.0))
        boxes += (Box(mouth - depth - 0.7, 0.0, 0.2, 2 * half + 2 * thick, 0.0, 1.6),) if rng.random() < 0.7 else ()
    way = (
        (rng.uniform(1.0, 1.6), rng.normal(0.0, 0.08)),
        (-rng.uniform(0.1, 0.9), rng.normal(0.0, 0.04)),
        (rng.uniform(1.4, 2.4), rng.normal(0.0, 0.15)),
    )
    return _Element(way, 0.0, boxes=boxes)


def _open(rng: np.random.Generator) -> _Element:
    """A straight piece, and a turn after it."""
    yaw = rng.normal(0.0, 0.7)
    bend = rng.normal(0.0, 0.3)
    length = rng.uniform(0.6, 2.2)
    return _Element(((length * math.cos(bend), length * math.sin(bend)),), bend + yaw)


def _bend(rng: np.random.Generator) -> _Element:
    """Somewhere in the open the operator turns round and comes back past the robot."""
    radius, side = rng.uniform(0.8, 1.4), _side(rng)
    way = (
        (1.0, 0.0),
        (1.0 + 0.7 * radius, side * 0.5 * radius),
        (1.0, side * 1.4 * radius),
        (-0.8, side * 1.5 * radius),
    )
    return _Element(way, math.pi)


def _side(rng: np.random.Generator) -> float:
    """Left or right, as a sign."""
    return 1.0 if rng.random() < 0.5 else -1.0


def _after_narrow(rng: np.random.Generator, x: float, wings: float) -> tuple[tuple[Point, ...], float]:
    """How the way goes on behind a gate or a hall that ends at ``x``: straight for a while, then aside or on."""
    out = (x + rng.uniform(0.3, 0.8), rng.normal(0.0, 0.05))
    turn = 0.0 if rng.random() < 0.25 else _side(rng) * rng.uniform(0.4, 1.8)
    length = rng.uniform(0.8, max(0.9, min(2.0, wings)))
    return (out, (out[0] + length * math.cos(turn), out[1] + length * math.sin(turn))), turn


def _gate(rng: np.random.Generator) -> _Element:
    """A wall across the way with a gap in it, its jambs thick in half of the cases; the way comes to it aslant."""
    half, thick = rng.uniform(0.46, 0.75), (0.0 if rng.random() < 0.5 else rng.uniform(0.08, 0.5))
    slant, before = rng.normal(0.0, 0.3), rng.uniform(0.9, 1.6)
    start = (0.25 * before, 0.25 * before * math.tan(slant))
    at, y = 0.25 * before + before, start[1] + before * math.tan(slant) * 0.4
    wings = rng.uniform(0.8, 4.0, 2)
    boxes: list[Box] = []
    walls: list[Wall] = []
    for side, wing in zip((-1.0, 1.0), wings, strict=True):
        near = y + side * half
        if thick:
            jamb = rng.uniform(0.1, 0.4)
            boxes.append(Box(at, near + side * jamb / 2, thick, jamb, 0.0, 2.0))
        walls.append(Wall(at, near + side * 0.04, at, near + side * wing))
    way, yaw = _after_narrow(rng, at, float(wings.min()))
    shifted = tuple((px, py + y) for px, py in way)
    return _Element((start, (at - 0.45, y), *shifted), yaw, tuple(walls), tuple(boxes))


def _hall(rng: np.random.Generator) -> _Element:
    """Two blocks or two walls with a narrow way between them."""
    half, length, before = rng.uniform(0.48, 0.75), rng.uniform(0.8, 2.6), rng.uniform(1.2, 2.0)
    deep = rng.uniform(0.05, 2.0)
    middle = before + length / 2
    if rng.random() < 0.6:
        boxes = tuple(Box(middle, side * (half + deep / 2), length, deep, 0.0, 2.0) for side in (-1.0, 1.0))
        walls: tuple[Wall, ...] = ()
    else:
        boxes = ()
        walls = tuple(Wall(before, side * half, before + length, side * half) for side in (-1.0, 1.0))
    way, yaw = _after_narrow(rng, before + length, 2.0)
    return _Element(((before - 0.5, rng.normal(0.0, 0.03)), (middle, rng.normal(0.0, 0.03)), *way), yaw, walls, boxes)


def _slalom(rng: np.random.Generator) -> _Element:
    """Boxes that reach into the way from alternate sides; the way goes round them."""
    side = _side(rng)
    x = rng.uniform(0.7, 1.2)
    way: list[Point] = []
    boxes: list[Box] = []
    for _ in range(int(rng.integers(1, 4))):
        length, width = rng.uniform(0.3, 1.0), rng.uniform(0.3, 1.0)
        past = rng.uniform(0.6, 0.85)
        reach = rng.uniform(-0.35, 0.1)
        boxes.append(Box(x, side * (reach - width / 2), length, width, rng.normal(0.0, 0.15), rng.uniform(0.4, 1.2)))
        y = side * (reach + past)
        way += [(x - length / 2, y), (x + length / 2, y)]
        x, side = x + length / 2 + rng.uniform(1.2, 2.0), -side
    way.append((x - 0.3, rng.normal(0.0, 0.3)))
    return _Element(tuple(way), 0.0, boxes=tuple(boxes))


def _table(rng: np.random.Generator) -> _Element:
    """Four legs of a table; the way goes round two to four of its corners."""
    long, deep, radius = rng.uniform(0.6, 1.8), rng.uniform(0.5, 1.2), rng.uniform(0.02, 0.05)
    away = rng.uniform(0.65, 1.1)
    x0, y0 = rng.uniform(0.3, 1.0), away
    posts = tuple(Post(x, y, radius) for x in (x0, x0 + long) for y in (y0, y0 + deep))
    round_it = [
        (x0 + long * 0.9, rng.normal(0.0, 0.08)),
        (x0 + long + away * 0.9, y0 + rng.normal(-0.1, 0.1)),
        (x0 + long + away * 0.9, y0 + deep),
        (x0 + long * 0.9, y0 + deep + away),
        (x0, y0 + deep + away),
        (x0 - away, y0 + deep * 0.6),
        (x0 - away, y0 - 0.3),
    ]
    count = int(rng.integers(2, len(round_it) + 1))
    way = tuple(round_it[:count])
    (xa, ya), (xb, yb) = way[-2:]
    return _Element(way, math.atan2(yb - ya, xb - xa), posts=posts)


def _posts(rng: np.random.Generator) -> _Element:
    """Some uprights beside the way."""
    length = rng.uniform(1.5, 3.0)
    posts = tuple(
        Post(rng.uniform(0.3, length), _side(rng) * rng.uniform(0.45, 1.2), rng.uniform(0.03, 0.15))
        for _ in range(int(rng.integers(1, 5)))
    )
    return _Element(((length, rng.normal(0.0, 0.2)),), 0.0, posts=posts)
