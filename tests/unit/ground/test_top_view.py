import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools import top_view
from sdt_tools.config import MotionConfig
from sdt_tools.frames import LIDAR_AHEAD_M, MotionClass
from sdt_tools.models import preprocess
from sdt_tools.robustness import domains
from sdt_tools.top_view import Mount

metres = st.floats(-20.0, 20.0)
yaws = st.floats(-math.pi, math.pi)
poses = st.tuples(metres, metres, yaws).map(lambda pose: np.array([pose]))


def test_ahead_is_up_and_left_is_left_where_y_runs_down() -> None:
    ahead, left = top_view.to_screen(np.array([[1.0, 0.0], [0.0, 1.0]]))
    assert tuple(ahead) == (0.0, -1.0)
    assert tuple(left) == (-1.0, 0.0)


def test_the_zone_is_that_of_the_safety_domains() -> None:
    assert top_view.ZONE_RANGE_M == domains.NEAR_M
    assert (top_view.ZONE_FIRST_RAY, top_view.ZONE_LAST_RAY) == (
        preprocess.FIRST_FRONT_RAY,
        preprocess.LAST_FRONT_RAY,
    )
    assert preprocess.PreprocessConfig().code_below_m == top_view.SMALLEST_DISTANCE_M


def test_the_zone_spans_its_rays_at_its_range() -> None:
    outline = top_view.safety_zone_lidar()
    rim = outline[1:-1]
    assert np.hypot(*rim.T) == pytest.approx(0.2)
    assert np.rad2deg(np.arctan2(rim[:, 1], rim[:, 0]))[[0, -1]] == pytest.approx([-60.0, 59.5])
    assert not outline[[0, -1]].any()


def test_codes_are_no_distances_and_neither_is_the_full_range() -> None:
    ranges = np.array([[0.0, 0.002, 0.003, np.nan, np.inf, 0.05, 3.0, 20.0]])
    assert top_view.distances(ranges).tolist() == [[False] * 5 + [True, True, False]]
    assert top_view.codes(ranges).tolist() == [[True] * 5 + [False] * 3]


def test_the_front_range_is_nan_without_any_distance_ahead() -> None:
    ranges = np.full((2, 541), 20.0)
    ranges[0, 149], ranges[0, 300] = 0.1, 1.5
    assert top_view.front_range_m(ranges) == pytest.approx([1.5, np.nan], nan_ok=True)


@pytest.mark.parametrize("motion", [motion for motion in MotionClass if motion is not MotionClass.STAY])
def test_an_arrow_ends_where_small_steps_of_the_twist_lead(motion: MotionClass) -> None:
    twist, steps = MotionConfig().twist(motion), 20_000
    yaw = np.arange(steps) * twist.angular_radps * 1.6 / steps
    end = [float(np.sum(twist.linear_mps * f(yaw))) * 1.6 / steps for f in (np.cos, np.sin)]
    path, head = top_view.motion_base(twist, seconds=1.6)
    assert path[-1] == pytest.approx(end, abs=1e-4)
    assert head[1] == pytest.approx(path[-1])
    assert np.dot(path[-1] - path[-2], path[-1] - head[[0, 2]].mean(axis=0)) > 0  # barbs lie behind the tip


def test_staying_is_a_circle_around_the_base() -> None:
    (circle,) = top_view.motion_base(MotionConfig().twist(MotionClass.STAY))
    assert circle[0] == pytest.approx(circle[-1])
    assert circle.mean(axis=0) == pytest.approx([0.0, 0.0], abs=0.01)


def test_the_base_lies_behind_the_lidar() -> None:
    assert top_view.base_to_lidar(np.zeros((1, 2)), Mount()) == pytest.approx(np.array([[-LIDAR_AHEAD_M, 0.0]]))


@given(base=poses, point=st.tuples(metres, metres), mount=st.builds(Mount, metres, metres, yaws))
def test_a_point_seen_from_the_lidar_is_the_point_seen_from_the_base(
    base: np.ndarray, point: tuple[float, float], mount: Mount
) -> None:
    world = top_view.place(np.array([point]), base)[0, 0]
    seen = top_view.seen_from(top_view.lidar_poses(base, mount), np.array([[*world, 0.0]]))
    assert seen[0, :2] == pytest.approx(top_view.base_to_lidar(np.array([point]), mount)[0], abs=1e-9)


@given(base=poses, other=poses)
def test_complex_numbers_agree_about_what_is_seen(base: np.ndarray, other: np.ndarray) -> None:
    away = complex(*other[0, :2]) - complex(*base[0, :2])
    turned = away * np.exp(-1j * base[0, 2])
    seen = top_view.seen_from(base, other)[0]
    assert seen == pytest.approx([turned.real, turned.imag, other[0, 2] - base[0, 2]], abs=1e-9)
