"""Rooms to practise in: open, cluttered, with boxes along a way, a corridor, a gate, a corner, tables."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from sdt_tools.scene.layout import Box, Post, Wall

Point = tuple[float, float]
_CLUTTER_M = 7.0
"""Boxes stand in the middle of a large room, where somebody walks among them."""


@dataclass(frozen=True)
class Room:
    """What stands in a room of ``size_m`` around the origin. ``lines`` are ways through its narrow places."""

    size_m: Point
    walls: tuple[Wall, ...]
    boxes: tuple[Box, ...] = ()
    posts: tuple[Post, ...] = ()
    lines: tuple[tuple[Point, ...], ...] = ()


def draw_room(rng: np.random.Generator) -> Room:
    """A room of one of seven kinds, a third of them with some boxes more."""
    width_m, depth_m = rng.uniform(5.0, 13.0, 2).tolist()
    kinds = (_open, _cluttered, _lined, _corridor, _gate, _corner, _tables)
    kind = kinds[rng.choice(len(kinds), p=(0.18, 0.14, 0.18, 0.16, 0.13, 0.1, 0.11))]
    size_m = (width_m, depth_m)
    room = kind(rng, size_m, _around(width_m, depth_m))
    inner = tuple(part for wall in room.walls for part in _within(wall, size_m))
    room = replace(room, walls=inner)
    return _with_boxes(rng, room, int(rng.integers(1, 5))) if rng.random() < 0.35 else room


def _around(width_m: float, depth_m: float) -> tuple[Wall, ...]:
    x, y = width_m / 2, depth_m / 2
    return _chain([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)])


def _chain(points: list[Point]) -> tuple[Wall, ...]:
    return tuple(Wall(*a, *b) for a, b in pairwise(points))


def _within(wall: Wall, size_m: Point) -> tuple[Wall, ...]:
    """The part of ``wall`` that is inside the room, if any."""
    enter, leave = 0.0, 1.0
    for start, end, size in ((wall.x0_m, wall.x1_m, size_m[0]), (wall.y0_m, wall.y1_m, size_m[1])):
        change = end - start
        if abs(change) < 1e-9:
            if abs(start) > size / 2:
                return ()
        else:
            ends = ((-size / 2 - start) / change, (size / 2 - start) / change)
            enter, leave = max(enter, min(ends)), min(leave, max(ends))
    if enter >= leave:
        return ()
    dx, dy = wall.x1_m - wall.x0_m, wall.y1_m - wall.y0_m
    first = (wall.x0_m + enter * dx, wall.y0_m + enter * dy)
    return (Wall(*first, wall.x0_m + leave * dx, wall.y0_m + leave * dy),)


def _open(_rng: np.random.Generator, size_m: Point, walls: tuple[Wall, ...]) -> Room:
    return Room(size_m, walls)


def _cluttered(rng: np.random.Generator, size_m: Point, walls: tuple[Wall, ...]) -> Room:
    return _with_boxes(rng, Room(size_m, walls), int(rng.integers(4, 11)))


def _lined(rng: np.random.Generator, size_m: Point, walls: tuple[Wall, ...]) -> Room:
    """A bent way with boxes close beside it."""
    place = _placement(rng)
    way = [(-2.5, rng.uniform(-0.6, 0.6)), (0.0, rng.uniform(-0.6, 0.6)), (2.5, rng.uniform(-0.6, 0.6))]
    boxes = []
    for _ in range(int(rng.integers(2, 7))):
        length, width, yaw = rng.uniform(0.2, 0.9), rng.uniform(0.2, 0.9), rng.uniform(0, math.pi)
        x = rng.uniform(-2.5, 2.5)
        beside = float(np.interp(x, [point[0] for point in way], [point[1] for point in way]))
        aside = rng.choice([-1.0, 1.0]) * (rng.uniform(0.3, 0.8) + math.hypot(length, width) / 2)
        (centre,) = place([(x, beside + aside)])
        boxes.append(Box(*centre, length, width, yaw, rng.uniform(0.4, 1.2)))
    return Room(size_m, walls, tuple(boxes), lines=(tuple(place(way)),))


def _corridor(rng: np.random.Generator, size_m: Point, walls: tuple[Wall, ...]) -> Room:
    """Two walls side by side, sometimes a dead end."""
    half, length = rng.uniform(0.5, 1.0), rng.uniform(2.0, 6.0)
    place = _placement(rng)
    sides = [[(-length / 2, side * half), (length / 2, side * half)] for side in (-1, 1)]
    if rng.random() < 0.15:
        sides.append([(length / 2, -half), (length / 2, half)])
    more = tuple(wall for side in sides for wall in _chain(place(side)))
    return Room(size_m, walls + more, lines=(tuple(place([(-length / 2 - 1.0, 0.0), (length / 2 + 1.0, 0.0)])),))


def _gate(rng: np.random.Generator, size_m: Point, walls: tuple[Wall, ...]) -> Room:
    """A wall across the room with a gap, thick in half of the cases."""
    half, thick = rng.uniform(0.48, 0.9), rng.choice([0.0, rng.uniform(0.08, 0.4)])
    middle, far = rng.uniform(-1.0, 1.0), 8.0
    place = _placement(rng)
    more: tuple[Wall, ...] = ()
    for side in (-1, 1):
        near = middle + side * half
        for x in {-thick / 2, thick / 2}:
            more += _chain(place([(x, near), (x, near + side * far)]))
        if thick:
            more += _chain(place([(-thick / 2, near), (thick / 2, near)]))
    return Room(size_m, walls + more, lines=(tuple(place([(-2.0, middle), (2.0, middle)])),))


def _corner(rng: np.random.Generator, size_m: Point, walls: tuple[Wall, ...]) -> Room:
    """A corridor that turns by a right angle."""
    half, first, second = rng.uniform(0.55, 1.0), rng.uniform(1.5, 4.0), rng.uniform(1.5, 4.0)
    place = _placement(rng)
    outer = [(-first, -half), (half, -half), (half, second)]
    inner = [(-first, half), (-half, half), (-half, second)]
    more = _chain(place(outer)) + _chain(place(inner))
    return Room(size_m, walls + more, lines=(tuple(place([(-first - 0.8, 0.0), (0.0, 0.0), (0.0, second + 0.8)])),))


def _tables(rng: np.random.Generator, size_m: Point, walls: tuple[Wall, ...]) -> Room:
    """Tables on four legs, and a pole or two."""
    posts: list[Post] = []
    for _ in range(int(rng.integers(1, 4))):
        place = _placement(rng, reach_m=min(size_m) / 3)
        a, b, radius = rng.uniform(0.35, 0.9), rng.uniform(0.3, 0.6), rng.uniform(0.02, 0.05)
        posts += [Post(*corner, radius) for corner in place([(-a, -b), (a, -b), (a, b), (-a, b)])]
    for _ in range(int(rng.integers(0, 3))):
        x, y = (rng.uniform(-0.45, 0.45, 2) * size_m).tolist()
        posts.append(Post(x, y, rng.uniform(0.03, 0.15)))
    return Room(size_m, walls, posts=tuple(posts))


def _with_boxes(rng: np.random.Generator, room: Room, count: int) -> Room:
    boxes = list(room.boxes)
    for _ in range(count):
        x, y = (rng.uniform(-0.5, 0.5, 2) * np.minimum(room.size_m, _CLUTTER_M)).tolist()
        length, width, yaw = rng.uniform(0.2, 1.2), rng.uniform(0.2, 1.2), rng.uniform(0, math.pi)
        boxes.append(Box(x, y, length, width, yaw, rng.uniform(0.4, 1.2)))
    return replace(room, boxes=tuple(boxes))


def _placement(rng: np.random.Generator, reach_m: float = 1.0) -> Callable[[list[Point]], list[Point]]:
    """A random turn and shift, for all points of one element."""
    yaw = rng.uniform(0, 2 * math.pi)
    c, s = math.cos(yaw), math.sin(yaw)
    turn, shift_m = np.array([[c, s], [-s, c]]), rng.uniform(-reach_m, reach_m, 2)

    def place(points: list[Point]) -> list[Point]:
        return [(x, y) for x, y in (np.array(points) @ turn + shift_m).tolist()]

    return place
