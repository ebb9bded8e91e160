"""Practice worlds: playable, varied, and bringing all seven classes."""

import math

import numpy as np
import pytest

from sdt_tools.frames import RAYS, MotionClass
from sdt_tools.scene.expert import SceneExpert
from sdt_tools.scene.footprint import clearance_m
from sdt_tools.scene.layout import lidar_pose
from sdt_tools.scene.practice import practice_layout
from sdt_tools.scene.raycast import cast_rays
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.world import World

SEEDS = range(60)


@pytest.fixture(scope="module", params=["practice", "practice_too_close"])
def layouts(request: pytest.FixtureRequest) -> list:
    return [layout_for(request.param, seed) for seed in SEEDS]


def test_the_robot_stands_free(layouts: list) -> None:
    for layout in layouts:
        legs = World(layout).legs
        robot = layout.robot
        obstacles = np.vstack([layout.circles(), legs])
        assert clearance_m(robot.x_m, robot.y_m, robot.yaw_rad, layout.segments(), obstacles) > 0.0


def test_the_operator_is_in_sight_and_within_reach(layouts: list) -> None:
    for layout in layouts:
        world = World(layout)
        lidar = lidar_pose(layout.robot)
        range_m = math.dist((lidar.x_m, lidar.y_m), layout.operator.path_m[0])
        assert world.operator_visible()
        assert 0.2 < range_m <= 2.4


def test_every_world_is_closed(layouts: list) -> None:
    out = np.empty(RAYS)
    for layout in layouts:
        lidar = lidar_pose(layout.robot)
        for turn in (0.0, math.pi):
            cast_rays(lidar.x_m, lidar.y_m, lidar.yaw_rad + turn, layout.segments(), layout.circles(), out)
            assert out.max() < 20.0


def test_worlds_differ_in_kind(layouts: list) -> None:
    assert {len(layout.walls) > 4 for layout in layouts} == {True, False}
    assert {len(layout.boxes) > 0 for layout in layouts} == {True, False}
    assert {len(layout.posts) > 0 for layout in layouts} == {True, False}


def test_same_seed_same_world() -> None:
    assert practice_layout(3) == practice_layout(3)
    assert practice_layout(3) != practice_layout(4)


def test_families_do_not_share_rooms() -> None:
    assert layout_for("practice", 3).walls != layout_for("practice_too_close", 3).walls


def test_every_eighth_world_is_too_close_where_no_family_is_asked_for() -> None:
    names = [practice_layout(seed).name for seed in range(16)]

    assert names.count("practice_too_close") == 2


def test_all_classes_are_frequent() -> None:
    """A data set of 3,275 balanced frames needs 468 of each class from 240 recordings, 0.4 s apart.

    One decision in twenty is replaced by a random motion for 0.4 to 1.2 s; mirrored classes lend each other theirs.
    """
    counts = dict.fromkeys(MotionClass, 0)
    for seed in range(24):
        world, rng = World(practice_layout(seed)), np.random.default_rng(seed)
        expert = SceneExpert(world)
        forced: list[MotionClass] = []
        while world.time_s < 12.0 and world.contact is None:
            for decision in range(4):
                advice = expert.advise()
                counts[advice] += decision == 0
                if not forced and rng.random() < 0.05:
                    forced = [MotionClass(int(rng.integers(7)))] * int(rng.integers(4, 13))
                twist = world.config.motions.twist(forced.pop() if forced else advice)
                for _ in range(5):
                    world.step(twist)
    of_240 = {motion: (counts[motion] + counts[motion.mirrored]) / 2 * 240 / 24 for motion in MotionClass}
    assert min(counts.values()) > 0
    assert min(of_240.values()) >= 468, of_240
