"""The guard: how near is too near, against geometry and against a robot that really brakes."""

import math

import numpy as np
import pytest
from actuator_samples import Remembers
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.control.guard import GuardConfig, ObstacleGuard, clearance_m
from sdt_tools.emulation.p3at.motors import Motors
from sdt_tools.frames import LIDAR_AHEAD_M, RAYS, ROBOT_LENGTH_M, LidarScan, Received, Twist, ray_angles_rad
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.protocols import Actuator, Observer

AHEAD = Twist(0.5, 0.2)
NOSE_M = ROBOT_LENGTH_M / 2 - LIDAR_AHEAD_M


def scan_of(ranges_m: np.ndarray) -> Received:
    return Received(1, LidarScan(1, ranges_m))


def free() -> np.ndarray:
    return np.full(RAYS, 15.0)


def wall_at(x_m: float) -> np.ndarray:
    """A wall straight across, ``x_m`` ahead of the LiDAR."""
    cos = np.cos(ray_angles_rad())
    return np.where(cos > 0.05, x_m / np.maximum(cos, 0.05), 15.0)


def guard_over(ranges_m: np.ndarray | None, **config: float) -> tuple[ObstacleGuard, Remembers]:
    below = Remembers()
    guard = ObstacleGuard(below, GuardConfig(**config))
    guard.command(AHEAD)
    if ranges_m is not None:
        guard.observe(scan_of(ranges_m))
    return guard, below


def measured(ranges_m: np.ndarray, side_m: float = 0.0) -> float:
    return clearance_m(LidarScan(0, ranges_m), side_m, PreprocessConfig())


@given(st.floats(0.2, 10.0))
def test_the_clearance_of_a_wall_is_counted_from_the_robots_front(x_m: float) -> None:
    assert measured(wall_at(x_m)) == pytest.approx(x_m - NOSE_M)


def test_what_stands_beside_the_way_is_passed_by() -> None:
    angles_rad = ray_angles_rad()
    left_wall = np.where(np.sin(angles_rad) > 0.02, 0.4 / np.maximum(np.sin(angles_rad), 0.02), 15.0)
    assert measured(left_wall) > 10.0
    assert measured(left_wall, side_m=0.2) < 10.0


def test_one_ray_alone_is_no_obstacle_and_codes_are_none() -> None:
    ranges_m = free()
    ranges_m[270] = 0.5
    ranges_m[300:320] = 0.0
    ranges_m[265] = math.nan
    assert measured(ranges_m) > 10.0
    ranges_m[271] = 0.5
    assert measured(ranges_m) == pytest.approx(0.5 - NOSE_M, abs=1e-4)


@given(st.floats(0.3, 5.0), st.floats(0.2, 2.0), st.floats(0.0, 0.5))
def test_from_the_speed_it_allows_the_robot_stops_where_it_should(room_m: float, brake: float, late_s: float) -> None:
    config = GuardConfig(brake_mps2=brake, reaction_s=late_s)
    speed_mps = config.speed_mps(room_m)
    assert speed_mps * late_s + speed_mps**2 / (2 * brake) == pytest.approx(max(0.0, room_m - config.stop_m))


def test_a_robot_that_runs_at_a_wall_stops_before_it() -> None:
    """The emulated base, its commands as late as they may be."""
    motors, below = Motors(), Remembers()
    motors.on, motors.accelerate_mps2, motors.brake_mps2 = True, 0.6, 0.8
    guard = ObstacleGuard(below, GuardConfig())
    guard.observe(scan_of(free()))
    guard.command(Twist(0.7, 0.0))
    x_m, late = 0.0, [Twist(0.0, 0.0)] * 12
    for _ in range(500):
        guard.observe(scan_of(wall_at(2.5 + NOSE_M - x_m)))
        late = [*late[1:], below.now]
        x_m += motors.step(late[0], 0.02).linear_mps * 0.02
    assert motors.velocity.linear_mps < 0.02
    assert 0.28 < 2.5 - x_m < 0.4


def test_it_lets_pass_what_is_safe() -> None:
    guard, below = guard_over(free())
    assert isinstance(guard, Actuator)
    assert isinstance(guard, Observer)
    assert below.now == AHEAD


def test_it_acts_on_a_scan_between_two_commands_and_leaves_the_turn() -> None:
    guard, below = guard_over(free())
    guard.observe(scan_of(wall_at(0.3)))
    assert below.now == Twist(0.0, AHEAD.angular_radps)
    count = len(below.commanded)
    guard.observe(scan_of(wall_at(0.3)))
    assert len(below.commanded) == count, "nothing new, nothing sent"


def test_backwards_it_lets_go() -> None:
    guard, below = guard_over(wall_at(0.2))
    guard.command(Twist(-0.3, 0.0))
    assert below.now == Twist(-0.3, 0.0)


def test_it_says_when_it_acts_and_when_it_acts_no_more() -> None:
    guard, _ = guard_over(free())
    guard.entries()
    for x_m in (0.6, 0.58, 0.3, 0.3, 15.0, 15.0):
        guard.observe(scan_of(wall_at(x_m)))
    texts = [entry.text for entry in guard.entries()]
    slower_mps = GuardConfig().speed_mps(0.6 - NOSE_M)
    assert texts == [
        f"something {0.6 - NOSE_M:.2f} m ahead: the robot slows from 0.50 to {slower_mps:.2f} m/s",
        f"something {0.3 - NOSE_M:.2f} m ahead: the robot stops",
        "the way ahead is free again",
    ]
    assert guard.entries() == []


def test_without_a_scan_nothing_drives_forward() -> None:
    guard, below = guard_over(None)
    assert below.now.linear_mps == 0.0
    assert guard.entries()[0].text == "no scan yet: the robot stops"


def test_a_sensor_that_is_covered_stops_it() -> None:
    guard, below = guard_over(free())
    guard.observe(scan_of(np.zeros(RAYS)))
    assert below.now.linear_mps == 0.0
    assert "100% of the front rays see nothing: the robot stops" in guard.entries()[-1].text


def test_switched_off_it_lets_all_pass_and_says_so() -> None:
    guard, below = guard_over(wall_at(0.2))
    guard.switch(False)
    guard.command(AHEAD)
    assert below.now == AHEAD
    assert not guard.is_on
    assert "the guard is off" in [entry.text for entry in guard.entries()]
