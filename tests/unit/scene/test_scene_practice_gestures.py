"""Practice gestures: what a data set needs of them."""

import math
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from sdt_tools.frames import Gesture, Twist
from sdt_tools.scene.gestures import behaviour_at, gesture_at
from sdt_tools.scene.layout import Behaviour, Layout
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.world import World

SEEDS = (*range(24), *range(1000, 1016))
STEPS = 1500


@pytest.fixture(scope="module")
def layouts() -> list[Layout]:
    return [layout_for("practice_gestures", seed) for seed in SEEDS]


def test_a_seed_is_a_world(layouts: list[Layout]) -> None:
    assert layout_for("practice_gestures", 3) == layouts[3]
    assert len({layout.operator.path_m for layout in layouts}) == len(layouts)
    assert {layout.camera for layout in layouts} == {"video"}


def test_every_kind_of_place_light_and_behaviour_comes_up(layouts: list[Layout]) -> None:
    assert {layout.surroundings for layout in layouts} == {"indoor", "outdoor", "garage"}
    assert len({layout.light for layout in layouts}) == 5
    assert {event.does for layout in layouts for event in layout.behaviours} == set(Behaviour)
    assert 3 < sum(layout.mask is True for layout in layouts) < 20


def test_signals_are_as_frequent_as_each_other_and_half_of_the_idle_time_looks_like_something(
    layouts: list[Layout],
) -> None:
    moments = [(layout, time_s) for layout in layouts for time_s in np.arange(0.0, 38.0, 0.25).tolist()]

    gestures = Counter(gesture_at(layout.gestures, time_s) for layout, time_s in moments)
    busy = sum(
        behaviour_at(layout.behaviours, time_s) is not None
        for layout, time_s in moments
        if gesture_at(layout.gestures, time_s) is Gesture.IDLE
    )

    assert all(0.12 < gestures[gesture] / len(moments) < 0.72 for gesture in Gesture)
    assert 0.3 < busy / gestures[Gesture.IDLE] < 0.7


def test_nothing_overlaps(layouts: list[Layout]) -> None:
    for layout in layouts:
        events = sorted((event.at_s, event.at_s + event.lasts_s) for event in (*layout.gestures, *layout.behaviours))
        assert all(end + 0.7 < start for (_, end), (start, _) in pairwise(events))


@pytest.mark.parametrize("seed", [0, 1, 2, 1000, 1001])
def test_the_operator_stays_where_the_camera_sees_him(seed: int) -> None:
    world = World(layout_for("practice_gestures", seed))
    ranges, bearings = [], []
    for _ in range(STEPS):
        world.step(Twist(0.0, 0.0))
        lidar, operator = world.lidar_pose, world.operator
        ranges.append(math.hypot(operator.x_m - lidar.x_m, operator.y_m - lidar.y_m))
        bearing = math.atan2(operator.y_m - lidar.y_m, operator.x_m - lidar.x_m) - lidar.yaw_rad
        bearings.append(abs(math.degrees(math.remainder(bearing, 2 * math.pi))))

    assert min(ranges) > 0.5
    assert max(ranges) < 3.6
    assert max(bearings) < 40


@pytest.mark.parametrize("seed", [3, 1003])
def test_who_gestures_stands_and_faces_the_robot(seed: int) -> None:
    layout = layout_for("practice_gestures", seed)
    world = World(layout)
    off_deg, moved_m, shown = [], [], 0
    for _ in range(STEPS):
        before = world.operator
        world.step(Twist(0.0, 0.0))
        lidar, operator = world.lidar_pose, world.operator
        if world.gesture is not Gesture.IDLE:
            towards = math.atan2(lidar.y_m - operator.y_m, lidar.x_m - operator.x_m) + layout.operator.faces_off_rad
            off_deg.append(abs(math.degrees(math.remainder(operator.yaw_rad - towards, 2 * math.pi))))
            moved_m.append(math.hypot(operator.x_m - before.x_m, operator.y_m - before.y_m))
            shown += 1

    assert shown > 100
    assert max(off_deg) < 1.0
    assert max(moved_m) == 0.0
