"""Odometry: wrapping counters against the path that was driven, and a base that begins anew."""

import math
from dataclasses import replace

import pytest

from sdt_tools.emulation.p3at.body import FreeBody
from sdt_tools.frames import Pose2D, Twist
from sdt_tools.robot.p3at.config import P3atConfig
from sdt_tools.robot.p3at.odometry import Odometer
from sdt_tools.robot.p3at.status import Status

STANDING = Status(0, 0, 0, 0, 0, 12.5)


def at(x_mm: int, y_mm: int, heading: int = 0) -> Status:
    return replace(STANDING, x=x_mm & 0x7FFF, y=y_mm & 0x7FFF, heading=heading)


def after(*statuses: Status) -> Pose2D:
    odometer = Odometer(P3atConfig(), "p3at-sh")
    for status in statuses:
        assert odometer.follow(status)
    return odometer.pose


def test_where_the_base_is_first_seen_is_the_origin() -> None:
    assert after(at(500, -200, 77)) == Pose2D(0.0, 0.0, 0.0)


def test_a_counter_that_wraps_goes_on() -> None:
    path = [at(x_mm, 0) for x_mm in range(0, 70_000, 50)]
    assert after(*path).x_m == pytest.approx(69.95)
    assert after(*path, *reversed(path)).x_m == pytest.approx(0.0)


def test_a_heading_that_wraps_goes_on() -> None:
    assert after(at(0, 0, 2040), at(0, 0, -2040)).yaw_rad == pytest.approx(16 / 4096 * 2 * math.pi)


def test_the_frame_is_the_one_that_the_base_began_in() -> None:
    """A base that counts from a heading of 90° on drives along its own y, which is our x."""
    pose = after(at(0, 0, 1024), at(0, 800, 1024))
    assert (pose.x_m, pose.y_m, pose.yaw_rad) == pytest.approx((0.8, 0.0, 0.0))


def test_a_base_that_begins_anew_goes_on_from_where_it_was() -> None:
    odometer = Odometer(P3atConfig(), "p3at-sh")
    for status in (at(0, 0), at(900, 0), at(900, 0, 1024)):
        odometer.follow(status)
    odometer.reconnected()
    for status in (at(0, 0), at(300, 0)):
        odometer.follow(status)
    assert (odometer.pose.x_m, odometer.pose.y_m) == pytest.approx((0.9, 0.3))


def test_a_jump_is_told_and_leaves_the_pose() -> None:
    odometer = Odometer(P3atConfig(), "p3at-sh")
    odometer.follow(at(0, 0))
    assert not odometer.follow(at(5000, 0))
    assert odometer.follow(at(5100, 0))
    assert odometer.pose.x_m == pytest.approx(0.1)


def test_an_arc_is_followed_to_the_counters_resolution() -> None:
    body, odometer = FreeBody(), Odometer(P3atConfig(), "p3at-sh")
    for _ in range(500):
        pose = body.pose
        steps = round(pose.yaw_rad / (2 * math.pi) * 4096)
        odometer.follow(at(round(1000 * pose.x_m), round(1000 * pose.y_m), steps))
        body.move(Twist(0.5, 0.4), 0.1)
    assert math.dist((pose.x_m, pose.y_m), (odometer.pose.x_m, odometer.pose.y_m)) < 0.002
    assert odometer.pose.yaw_rad == pytest.approx(pose.yaw_rad, abs=0.002)


def test_the_free_body_drives_circles_that_close() -> None:
    body = FreeBody()
    for _ in range(7):
        body.move(Twist(0.5, 2 * math.pi / 7), 1.0)
    assert (body.pose.x_m, body.pose.y_m) == pytest.approx((0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize(
    ("model", "config", "metres"), [("p3at-sh", {}, 0.1), ("p3at", {}, 0.0465), ("p3at", {"position_scale": 2.0}, 0.2)]
)
def test_a_step_of_the_counters_is_as_long_as_the_model_has_it(
    model: str, config: dict[str, float], metres: float
) -> None:
    odometer = Odometer(P3atConfig(**config), model)
    odometer.follow(at(0, 0))
    odometer.follow(at(100, 0))
    assert odometer.pose.x_m == pytest.approx(metres)
