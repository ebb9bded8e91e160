"""Practice courses: playable, varied, and most of them within what the expert can do."""

import math
from itertools import pairwise

import pytest

from sdt_tools.evaluation.closed_loop import ClosedLoopConfig, drive_closed_loop
from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.evaluation.policies import policy_for
from sdt_tools.scene.footprint import clearance_m
from sdt_tools.scene.practice_courses import course_layout
from sdt_tools.scene.scenario import layout_for, load_scenario, scenario_names
from sdt_tools.scene.validity import check_layout
from sdt_tools.scene.world import World

SEEDS = range(40)


@pytest.fixture(scope="module")
def courses() -> list:
    return [layout_for("practice_course", seed) for seed in SEEDS]


def test_each_can_be_walked_and_the_robot_stands_free(courses: list) -> None:
    for layout in courses:
        check_layout(layout)
        robot = layout.robot
        assert clearance_m(robot.x_m, robot.y_m, robot.yaw_rad, layout.segments(), World(layout).legs) > 0.0


def test_the_operator_begins_in_sight(courses: list) -> None:
    assert all(World(layout).operator_visible() for layout in courses)


def test_they_have_the_elements_of_the_scenarios(courses: list) -> None:
    assert {len(layout.walls) > 4 for layout in courses} == {True, False}
    assert {len(layout.boxes) > 0 for layout in courses} == {True, False}
    assert {len(layout.posts) > 0 for layout in courses} == {True, False}


def test_they_lead_to_both_sides_alike() -> None:
    turns = [_total_turn(course_layout(seed).operator.path_m) for seed in range(120)]
    left = sum(turn > 0 for turn in turns)
    assert 40 <= left <= 80


def test_no_course_is_a_scenario(courses: list) -> None:
    for name in scenario_names():
        length = len(load_scenario(name).operator.path)
        standard = layout_for(name, 1000).operator.path_m
        assert all(layout.operator.path_m != standard for layout in courses), length


def test_the_same_seed_is_the_same_course() -> None:
    assert course_layout(3) == course_layout(3)
    assert course_layout(3) != course_layout(4)


def test_the_expert_finishes_most_of_them(courses: list) -> None:
    runs = drive_closed_loop(courses[:5], policy_for("expert"), ClosedLoopConfig())
    assert sum(run.outcome is Outcome.OK for run in runs) >= 3


def _total_turn(path: tuple) -> float:
    headings = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(path)]
    return sum(math.remainder(b - a, 2 * math.pi) for a, b in pairwise(headings))
