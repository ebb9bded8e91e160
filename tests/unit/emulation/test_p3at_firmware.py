"""The emulated controller by itself, in time that the test makes pass."""

import math

import pytest

from sdt_tools.emulation.p3at.faults import FaultKind, Faults
from sdt_tools.emulation.p3at.firmware import Firmware
from sdt_tools.frames import Twist
from sdt_tools.robot.p3at.commands import Code, encode, wheels_argument
from sdt_tools.robot.p3at.packets import PacketSplitter, packet
from sdt_tools.robot.p3at.settings import decode_settings
from sdt_tools.robot.p3at.status import Status, decode_status

SYNCS = [packet(bytes([number])) for number in (0, 1, 2)]


class Bench:
    """A controller, and how long it has run."""

    def __init__(self) -> None:
        self.faults = Faults()
        self.firmware = Firmware(self.faults)
        self.now_ms = 0

    def say(self, *packets: bytes) -> list[bytes]:
        answers = self.firmware.receive(b"".join(packets), self.now_ms * 1_000_000)
        return list(PacketSplitter().feed(b"".join(answers)))

    def wait(self, ms: int) -> list[Status]:
        self.now_ms += ms
        told = PacketSplitter().feed(b"".join(self.firmware.advance(self.now_ms * 1_000_000)))
        return [status for body in told if (status := decode_status(body)) is not None]


@pytest.fixture
def bench() -> Bench:
    """A session is open and the motors are on."""
    bench = Bench()
    bench.say(*SYNCS, encode(Code.OPEN), encode(Code.ENABLE, 1))
    return bench


def test_the_synchronisation_is_echoed_and_ends_with_the_name() -> None:
    assert Bench().say(*SYNCS) == [b"\0", b"\1", b"\2emulated\0Pioneer\0p3at-sh\0"]


def test_out_of_turn_it_begins_again() -> None:
    bench = Bench()
    assert bench.say(SYNCS[0], SYNCS[2]) == [b"\0"]
    assert bench.say(*SYNCS)[2][:1] == b"\2"


def test_without_a_session_nothing_moves_and_nothing_is_told() -> None:
    bench = Bench()
    assert bench.say(encode(Code.ENABLE, 1), encode(Code.VEL, 500)) == []
    assert bench.wait(1000) == []
    assert bench.firmware.velocity == Twist(0.0, 0.0)


def test_ten_statuses_a_second(bench: Bench) -> None:
    assert len(bench.wait(1000)) == 10


def test_speeds_change_no_faster_than_the_accelerations(bench: Bench) -> None:
    bench.say(encode(Code.SETA, 500), encode(Code.SETA, -250), encode(Code.VEL, 400))
    bench.wait(400)
    assert bench.firmware.velocity.linear_mps == pytest.approx(0.2)
    bench.wait(400)
    assert bench.firmware.velocity.linear_mps == pytest.approx(0.4)
    bench.say(encode(Code.VEL, 0))
    bench.wait(800)
    assert bench.firmware.velocity.linear_mps == pytest.approx(0.2)


def test_the_path_is_that_of_constant_acceleration(bench: Bench) -> None:
    """x = a t² / 2, less than a step's travel off."""
    bench.say(encode(Code.SETA, 500), encode(Code.VEL, 700))
    bench.wait(1000)
    assert bench.firmware.body.pose.x_m == pytest.approx(0.25, abs=0.02 * 0.5)


def test_the_watchdog_stops_it_and_any_packet_lets_it_go_on(bench: Bench) -> None:
    bench.say(encode(Code.VEL, 300))
    bench.wait(1900)
    assert bench.firmware.velocity.linear_mps == pytest.approx(0.3)
    bench.wait(1200)
    assert bench.firmware.velocity == Twist(0.0, 0.0)
    assert bench.firmware.watchdog_stops == 1
    bench.say(encode(Code.PULSE))
    bench.wait(1000)
    assert bench.firmware.velocity.linear_mps == pytest.approx(0.3)


def test_pulses_keep_it_going(bench: Bench) -> None:
    bench.say(encode(Code.VEL, 300))
    for _ in range(5):
        bench.wait(1500)
        bench.say(encode(Code.PULSE))
    assert bench.firmware.watchdog_stops == 0


def test_an_emergency_stop_is_quicker_than_braking(bench: Bench) -> None:
    bench.say(encode(Code.VEL, 500))
    bench.wait(1800)
    bench.say(encode(Code.ESTOP))
    bench.wait(140)
    assert bench.firmware.velocity == Twist(0.0, 0.0)


def test_the_button_switches_the_motors_off_until_they_are_enabled(bench: Bench) -> None:
    bench.say(encode(Code.VEL, 300))
    bench.faults.begin(FaultKind.BUTTON)
    status = bench.wait(500)[-1]
    assert status.button_pressed
    assert not status.motors_on
    bench.say(encode(Code.ENABLE, 1))
    assert not bench.wait(200)[-1].motors_on, "while it is pressed"
    bench.faults.end(FaultKind.BUTTON)
    assert bench.wait(200)[-1].button_pressed, "it latches"
    bench.say(encode(Code.ENABLE, 1))
    status = bench.wait(200)[-1]
    assert status.motors_on
    assert not status.button_pressed
    assert not status.moving, "what was commanded before is forgotten"


def test_closing_ends_the_session(bench: Bench) -> None:
    bench.say(encode(Code.VEL, 300))
    bench.wait(500)
    bench.say(encode(Code.CLOSE))
    assert bench.wait(500) == []
    assert bench.firmware.velocity == Twist(0.0, 0.0)


def test_single_wheels(bench: Bench) -> None:
    bench.say(encode(Code.VEL2, wheels_argument(-0.1, 0.1)))
    status = bench.wait(1500)[-1]
    assert (status.left_mmps, status.right_mmps) == (-100, 100)
    assert bench.firmware.velocity.angular_radps == pytest.approx(0.34)  # 2 · 0.1 m/s over 0.588 m


def test_odometry_wraps_at_15_bits(bench: Bench) -> None:
    bench.say(encode(Code.VEL, -300))
    status = bench.wait(1900)[-1]
    assert status.x - 32768 == pytest.approx(1000 * bench.firmware.body.pose.x_m, abs=1)


def test_the_heading_has_4096_steps_a_turn(bench: Bench) -> None:
    bench.say(encode(Code.RVEL, 30))
    status = bench.wait(1900)[-1]
    assert status.heading == pytest.approx(bench.firmware.body.pose.yaw_rad / (2 * math.pi) * 4096, abs=1)


def test_the_settings_are_told_when_asked_for(bench: Bench) -> None:
    (answer,) = bench.say(encode(Code.CONFIG))
    settings = decode_settings(answer)
    assert settings is not None
    assert (settings.model, settings.watchdog_ms) == ("p3at-sh", 2000)
