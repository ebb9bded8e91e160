"""The last step before the wire: limits, bumpers, age."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.frames import Twist
from sdt_tools.robot.limits import SpeedLimits
from sdt_tools.robot.p3at.commands import Code, decode
from sdt_tools.robot.p3at.config import P3atConfig
from sdt_tools.robot.p3at.packets import PacketSplitter
from sdt_tools.robot.p3at.status import Status
from sdt_tools.robot.p3at.wheel import Wheel

FREE = Status(0, 0, 0, 0, 0, 12.5)
LIMITS = SpeedLimits(forward_mps=0.4, backward_mps=0.2, turn_radps=0.5)


def free_wheel() -> Wheel:
    wheel = Wheel(P3atConfig(limits=LIMITS))
    wheel.free()
    return wheel


def sent(wheel: Wheel, status: Status | None = FREE) -> tuple[int | None, int | None]:
    """mm/s and °/s."""
    commands = [decode(body) for body in PacketSplitter().feed(wheel.packets(status))]
    assert [command.code for command in commands if command is not None] == [Code.VEL, Code.RVEL]
    speed, turn = (command.argument for command in commands if command is not None)
    return speed, turn


def driven(twist: Twist, status: Status | None = FREE) -> tuple[int | None, int | None]:
    wheel = free_wheel()
    wheel.command(twist, 0)
    return sent(wheel, status)


@given(st.floats(), st.floats())
def test_no_command_passes_the_limits(linear_mps: float, angular_radps: float) -> None:
    speed, turn = driven(Twist(linear_mps, angular_radps))
    assert speed is not None
    assert turn is not None
    assert -200 <= speed <= 400
    assert abs(turn) <= math.degrees(0.5)


def test_what_is_within_the_limits_is_sent_as_it_is() -> None:
    assert driven(Twist(0.25, -0.35)) == (250, -20)


def test_what_is_no_number_is_standstill() -> None:
    assert driven(Twist(math.nan, 0.1)) == (0, 0)
    assert driven(Twist(0.1, math.inf)) == (0, 0)


@pytest.mark.parametrize(("twist", "expected"), [(Twist(0.3, 0.2), (0, 11)), (Twist(-0.1, 0.2), (-100, 11))])
def test_nothing_drives_on_against_a_front_bumper(twist: Twist, expected: tuple[int, int]) -> None:
    assert driven(twist, replace(FREE, front_bumpers=2)) == expected


def test_nothing_drives_on_against_a_rear_bumper() -> None:
    assert driven(Twist(-0.1, 0.0), replace(FREE, rear_bumpers=1)) == (0, 0)


def test_a_motion_that_is_not_commanded_again_ends() -> None:
    wheel = free_wheel()
    wheel.command(Twist(0.3, 0.0), 1_000)
    assert not wheel.expires(500_001_000)
    assert wheel.expires(500_001_001)
    assert sent(wheel) == (0, 0)
    assert not wheel.expires(900_000_000), "said once"


def test_standstill_does_not_age() -> None:
    wheel = free_wheel()
    wheel.command(Twist(0.0, 0.0), 0)
    assert not wheel.expires(10**12)


def test_nothing_is_taken_while_it_is_held_nor_kept_for_later() -> None:
    wheel = free_wheel()
    wheel.command(Twist(0.3, 0.0), 0)
    wheel.hold()
    wheel.command(Twist(0.3, 0.0), 1)
    assert sent(wheel) == (0, 0)
    wheel.free()
    assert sent(wheel) == (0, 0)
