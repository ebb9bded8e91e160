"""The expert: its rule, its care, and whether it follows."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sdt_tools.config import MotionConfig
from sdt_tools.frames import FORWARD_CLASSES, RAYS, MotionClass, Pose2D
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.expert import SceneExpert, polar_rule
from sdt_tools.scene.layout import Box, Layout, OperatorPlan, Post, Wall
from sdt_tools.scene.raycast import cast_rays
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.world import World

M = MotionClass


def standing(range_m: float, bearing_deg: float, config: SceneConfig | None = None, **things: object) -> World:
    """The operator at this place of the LiDAR's polar coordinates."""
    bearing = math.radians(bearing_deg)
    x, y = 0.197 + range_m * math.cos(bearing), range_m * math.sin(bearing)
    plan = OperatorPlan(((x, y),), (0.0,), 0.5, 2.0, 0.4, 1.0, bearing + math.pi, 0.06, 0.26, 0.4, 0.0)
    return World(replace(Layout("test", 0, 60.0, Pose2D(0.0, 0.0, 0.0), plan), **things), config)


@pytest.mark.parametrize(
    ("range_m", "bearing_deg", "motion"),
    [
        (1.0, 0.0, M.STAY),
        (0.85, -15.0, M.STAY),
        (1.5, 15.0, M.FORWARD),
        (0.7, 0.0, M.BACKWARD),
        (1.5, 30.0, M.LEFT_FORWARD),
        (1.5, -30.0, M.RIGHT_FORWARD),
        (0.9, 40.0, M.LEFT_BACKWARD),
        (0.9, -120.0, M.RIGHT_BACKWARD),
    ],
)
def test_the_rule_in_the_open(range_m: float, bearing_deg: float, motion: MotionClass) -> None:
    assert polar_rule(range_m, math.radians(bearing_deg)) == motion
    assert SceneExpert(standing(range_m, bearing_deg)).advise() is motion


def test_a_box_in_the_way_is_not_driven_into() -> None:
    free = SceneExpert(standing(2.0, 0.0)).advise()
    blocked = SceneExpert(standing(2.0, 0.0, boxes=(Box(0.6, 0.0, 0.3, 0.6, 0.0),))).advise()

    assert free is M.FORWARD
    assert blocked is not M.FORWARD


def test_however_slow_it_drives_nothing_within_the_safety_domains_is_approached() -> None:
    crawling = SceneConfig(motions=MotionConfig(forward_mps=0.05, turning_forward_mps=0.05))
    post_m = (Post(0.197 + 0.25, 0.0, 0.03),)  # 0.22 m ahead of the LiDAR

    assert SceneExpert(standing(2.0, 0.0, crawling)).advise() is M.FORWARD
    assert SceneExpert(standing(2.0, 0.0, crawling, posts=post_m)).advise() not in FORWARD_CLASSES


def test_a_wall_behind_keeps_it_from_backing_off() -> None:
    assert SceneExpert(standing(0.6, 0.0, walls=(Wall(-0.36, -2.0, -0.36, 2.0),))).advise() is not M.BACKWARD


def test_a_mirrored_world_gets_the_mirrored_advice() -> None:
    for seed in range(12):
        layout = layout_for("practice", seed)
        mirrored = replace(
            layout,
            robot=Pose2D(layout.robot.x_m, -layout.robot.y_m, -layout.robot.yaw_rad),
            walls=tuple(Wall(w.x0_m, -w.y0_m, w.x1_m, -w.y1_m) for w in layout.walls),
            boxes=tuple(replace(box, y_m=-box.y_m, yaw_rad=-box.yaw_rad) for box in layout.boxes),
            posts=tuple(replace(post, y_m=-post.y_m) for post in layout.posts),
            operator=replace(
                layout.operator,
                path_m=tuple((x, -y) for x, y in layout.operator.path_m),
                yaw_rad=-layout.operator.yaw_rad,
            ),
        )

        assert SceneExpert(World(mirrored)).advise() is SceneExpert(World(layout)).advise().mirrored


def test_forward_is_never_advised_towards_something_within_the_safety_domains() -> None:
    near = 0
    out = np.empty(RAYS)
    for seed in range(16):
        world = World(layout_for("practice_too_close", seed))
        expert = SceneExpert(world)
        while world.time_s < 4.0 and world.contact is None:
            advice = expert.advise()
            lidar = world.lidar_pose
            cast_rays(lidar.x_m, lidar.y_m, lidar.yaw_rad, world.segments, world.circles, out)
            if out[150:390].min() <= 0.2:
                near += 1
                assert advice not in FORWARD_CLASSES
            for _ in range(5):
                world.step(world.config.motions.twist(advice))
    assert near > 20


def follow(name: str, seed: int, always: MotionClass | None = None) -> bool:
    """Whether a run ends as the standard suite asks: no contact, never lost for 3 s, arrived within 10 s of the end."""
    layout = layout_for(name, seed)
    world = World(layout if always is None else replace(layout, timeout_s=40.0))
    expert = SceneExpert(world)
    lost_s, ended_s = 0.0, 0.0
    while world.time_s < world.layout.timeout_s:
        twist = world.config.motions.twist(expert.advise() if always is None else always)
        for _ in range(5):
            world.step(twist)
        lidar, operator = world.lidar_pose, world.operator
        dx, dy = operator.x_m - lidar.x_m, operator.y_m - lidar.y_m
        range_m, bearing = math.hypot(dx, dy), math.remainder(math.atan2(dy, dx) - lidar.yaw_rad, 2 * math.pi)
        lost_s = 0.0 if range_m <= 3.0 and world.operator_visible() else lost_s + 0.1
        if world.contact is not None or lost_s > 3.0 or ended_s > 10.0:
            return False
        if world.operator_done:
            ended_s += 0.1
            if 0.6 <= range_m <= 1.5 and abs(bearing) <= math.radians(25.0):
                return True
    return False


@pytest.mark.parametrize("name", ["plain", "around_boxes"])
def test_it_follows(name: str) -> None:
    assert [seed for seed in range(1000, 1004) if not follow(name, seed)] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plain", "around_boxes"])
@pytest.mark.parametrize("motion", list(MotionClass))
def test_a_constant_motion_never_does(name: str, motion: MotionClass) -> None:
    assert [seed for seed in range(1000, 1020) if follow(name, seed, motion)] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plain", "around_boxes"])
def test_it_follows_in_99_of_100(name: str) -> None:
    assert len([seed for seed in range(1000, 1100) if not follow(name, seed)]) <= 1


@pytest.mark.parametrize("motion", list(MotionClass))
def test_a_constant_motion_does_not(motion: MotionClass) -> None:
    assert not follow("plain", 1003, motion)
