"""The standard scenarios beyond the first two: drawable, enclosed, of the stated widths, and passed by the expert."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from sdt_tools.evaluation.closed_loop import ClosedLoopConfig, drive_closed_loop
from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.evaluation.policies import ConstantPolicy, ExpertPolicy, Policy
from sdt_tools.frames import MotionClass
from sdt_tools.protocols import Expert
from sdt_tools.scene.expert import SceneExpert, polar_rule
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.raycast import cast_rays
from sdt_tools.scene.scenario import layout_for, load_scenario

NAMES = ("out_of_corner", "through_gate", "around_table", "garage_parking", "narrow_hallway")
NARROW = ("through_gate", "narrow_hallway")
SEEDS = (*range(12), *range(1000, 1012))


class PolarPolicy:
    """The expert's rule without its care for what is in the way."""

    name = "polar"

    def decide(self, ranges_m: np.ndarray, experts: Sequence[Expert]) -> list[MotionClass]:
        assert len(ranges_m) == len(experts)
        return [self._rule(expert) for expert in experts]

    @staticmethod
    def _rule(expert: Expert) -> MotionClass:
        assert isinstance(expert, SceneExpert)
        lidar, operator = expert._world.lidar_pose, expert._world.operator
        dx, dy = operator.x_m - lidar.x_m, operator.y_m - lidar.y_m
        bearing = math.remainder(math.atan2(dy, dx) - lidar.yaw_rad, 2 * math.pi)
        return MotionClass(int(polar_rule(math.hypot(dx, dy), bearing)))


def failures(name: str, seeds: Sequence[int], policy: Policy) -> list[int]:
    results = drive_closed_loop([layout_for(name, seed) for seed in seeds], policy, ClosedLoopConfig())
    return [seed for seed, result in zip(seeds, results, strict=True) if result.outcome is not Outcome.OK]


def gap_beside_m(layout: Layout, x_m: float, y_m: float) -> float:
    """How far it is from what is left of a point to what is right of it, looked at along y."""
    spans = []
    for box in layout.boxes:
        corners = box.corners()
        if corners[:, 0].min() <= x_m <= corners[:, 0].max():
            spans.append((corners[:, 1].min(), corners[:, 1].max()))
    left = min(low for low, _ in spans if low > y_m)
    right = max(high for _, high in spans if high < y_m)
    return float(left - right)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_drawn_differently_with_every_seed(name: str) -> None:
    layouts = [layout_for(name, seed) for seed in SEEDS]

    assert load_scenario(name).mirror
    assert len({layout.operator.path_m for layout in layouts}) == len(SEEDS)
    assert len({layout.operator.speed_mps for layout in layouts}) == len(SEEDS)
    assert len({layout.operator.pauses_s for layout in layouts}) == len(SEEDS)
    assert len({(layout.boxes, layout.posts) for layout in layouts}) == len(SEEDS)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_enclosed(name: str) -> None:
    out = np.empty(541)
    for seed in SEEDS:
        layout = layout_for(name, seed)
        walls = np.array([(wall.x0_m, wall.y0_m, wall.x1_m, wall.y1_m) for wall in layout.walls])
        points = [(layout.robot.x_m, layout.robot.y_m), *layout.operator.path_m]
        for x_m, y_m in points:
            for yaw_rad in (0.0, math.pi):
                cast_rays(x_m, y_m, yaw_rad, walls, np.empty((0, 3)), out)
                assert out.max() < 15.0


@pytest.mark.parametrize("seed", SEEDS)
def test_gates_and_halls_are_barely_wide_enough(seed: int) -> None:
    widths_m = [gap_beside_m(layout_for("through_gate", seed), 2.4, 0.0)]
    widths_m.append(gap_beside_m(layout_for("narrow_hallway", seed), 2.7, 0.0))

    assert all(0.9 <= width <= 1.2 for width in widths_m)
    assert 1.3 <= gap_beside_m(layout_for("garage_parking", seed), -1.65, 0.0) <= 1.6


def test_the_operator_walks_round_the_table() -> None:
    for seed in SEEDS:
        layout = layout_for("around_table", seed)
        posts = layout.circles()
        assert len(posts) == 4
        path = np.array(layout.operator.path_m) - posts[:, :2].mean(axis=0)
        bearings = np.unwrap(np.arctan2(path[:, 1], path[:, 0]))
        assert abs(bearings[-1] - bearings[0]) > math.radians(200.0)
        assert np.linalg.norm(path, axis=1).min() > np.ptp(posts[:, 1])


def test_the_robot_backs_into_the_garage_and_comes_out() -> None:
    (result,) = drive_closed_loop([layout_for("garage_parking", 1001)], ExpertPolicy(), ClosedLoopConfig())
    x_m = [point.robot_x_m for point in result.trace]

    assert min(x_m) < -0.95  # the garage's mouth is at -0.6: most of the robot's length is inside
    assert x_m[-1] > 0.8


@pytest.mark.parametrize("name", NAMES)
def test_the_expert_passes(name: str) -> None:
    assert failures(name, (0, 1), ExpertPolicy()) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_expert_passes_99_of_100(name: str) -> None:
    assert len(failures(name, range(1000, 1100), ExpertPolicy())) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("motion", list(MotionClass))
def test_a_constant_motion_never_passes(name: str, motion: MotionClass) -> None:
    assert len(failures(name, range(1000, 1020), ConstantPolicy(motion))) == 20


@pytest.mark.slow
@pytest.mark.parametrize("name", NARROW)
def test_a_polar_rule_without_clearance_mostly_fails(name: str) -> None:
    assert len(failures(name, range(1000, 1100), PolarPolicy())) > 50
