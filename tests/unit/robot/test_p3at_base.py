"""The driver against an emulated base over real sockets and terminals, well and with every fault."""

import math
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
import serial
from base_rig import AHEAD, PORTS, QUICK, REST, driven, wait_for

from sdt_tools.emergency import EmergencyStop
from sdt_tools.emulation.faults import Fault
from sdt_tools.emulation.p3at.faults import FaultKind
from sdt_tools.emulation.p3at.server import EmulatedP3at
from sdt_tools.errors import DeviceError, UsageError
from sdt_tools.frames import Twist
from sdt_tools.protocols import Actuator
from sdt_tools.robot.p3at import link
from sdt_tools.robot.p3at.base import P3atBase
from sdt_tools.robot.p3at.commands import Code, encode
from sdt_tools.robot.p3at.config import P3atConfig
from sdt_tools.robot.p3at.session import open_session


@pytest.mark.parametrize("port", PORTS)
def test_it_drives_and_says_where_it_is(port: str) -> None:
    with driven(port) as pair:
        assert isinstance(pair.base, Actuator)
        assert pair.keep_driving_until(lambda: pair.emulated.report.pose.x_m > 0.05, Twist(0.4, 0.3))
        pair.base.command(REST)
        assert wait_for(lambda: pair.stands)
        true = pair.emulated.report.pose
        assert wait_for(lambda: bool(pair.texts and pair.poses[-1].pose.x_m == pytest.approx(true.x_m, abs=0.002)))
        assert pair.poses[-1].pose.yaw_rad == pytest.approx(true.yaw_rad, abs=0.002)
        assert "its watchdog stops it after 2000 ms" in pair.texts[0]


@pytest.mark.parametrize("port", PORTS)
def test_closed_it_leaves_the_base_standing_with_its_motors_off(port: str) -> None:
    with driven(port) as pair:
        assert pair.drive()
        pair.base.close()
        assert wait_for(lambda: pair.stands)
        assert pair.emulated.report.watchdog_stops == 0
        assert not pair.emulated.report.motors_on
        pair.base.close()


def test_stamps_rise_and_are_not_later_than_the_reception() -> None:
    with driven("serial") as pair:
        assert wait_for(lambda: bool(pair.texts) and len(pair.poses) > 3)
        stamps = [pose.stamp_ns for pose in pair.poses]
        assert stamps == sorted(stamps)
        assert len(set(stamps)) == len(stamps)


@pytest.mark.parametrize(
    "fault",
    [
        Fault(FaultKind.SPLIT, 1.0),
        Fault(FaultKind.MERGE, 5.0),
        Fault(FaultKind.DELAY, 0.1),
        Fault(FaultKind.DROP, 0.3),
        Fault(FaultKind.CORRUPT, 0.3),
        Fault(FaultKind.GARBAGE, 0.5),
    ],
    ids=lambda fault: fault.kind,
)
def test_it_drives_over_a_bad_wire(fault: Fault) -> None:
    with driven("tcp", fault, silent_s=0.5) as pair:
        assert pair.keep_driving_until(lambda: pair.emulated.report.pose.x_m > 0.03)
        pair.base.command(REST)
        assert wait_for(lambda: pair.stands)
        true_m = pair.emulated.report.pose.x_m
        assert wait_for(lambda: bool(pair.texts and pair.poses[-1].pose.x_m == pytest.approx(true_m, abs=0.002)))
        assert all(abs(pose.pose.y_m) < 0.002 and -0.002 < pose.pose.x_m < true_m + 0.002 for pose in pair.poses)
        if fault.kind is FaultKind.CORRUPT:
            assert pair.told("bad checksum")


@pytest.mark.parametrize("port", PORTS)
def test_a_power_cycle_is_told_survived_and_followed_by_no_motion(port: str) -> None:
    with driven(port) as pair:
        assert pair.keep_driving_until(lambda: pair.emulated.report.pose.x_m > 0.03)
        pair.emulated.faults.begin(FaultKind.POWER)
        assert pair.told("the base is lost")
        pair.base.command(AHEAD)
        pair.emulated.faults.end(FaultKind.POWER)
        assert pair.told("the base is back after")
        assert not pair.drives_on(), "commanded before it came back"
        before_m = pair.emulated.report.pose.x_m
        assert pair.keep_driving_until(lambda: pair.emulated.report.pose.x_m > before_m + 0.05)
        assert wait_for(lambda: bool(pair.texts) and pair.poses[-1].pose.x_m > before_m)


def test_a_base_that_is_silent_for_a_while_stands_until_it_is_commanded_anew() -> None:
    with driven() as pair:
        assert pair.drive()
        pair.emulated.faults.begin(FaultKind.DROP, 1.0)
        assert pair.keep_driving_until(lambda: any("silent for" in text for text in pair.texts))
        pair.emulated.faults.end(FaultKind.DROP)
        assert wait_for(lambda: pair.stands)
        assert pair.told("speaks again")
        assert not pair.drives_on()
        assert pair.drive()


def test_a_motion_that_nobody_commands_again_ends() -> None:
    with driven("tcp", command_lasts_s=0.2) as pair:
        assert pair.drive()
        assert pair.told("no command for 0.2 s")
        assert wait_for(lambda: pair.stands)


def test_the_emergency_stop_latches() -> None:
    emergency = EmergencyStop()
    with (
        EmulatedP3at(PORTS["tcp"](), settings=QUICK) as emulated,
        P3atBase(P3atConfig(address=emulated.address), emergency) as base,
    ):

        def moves() -> bool:
            base.command(AHEAD)
            return emulated.report.velocity != REST

        assert wait_for(moves)
        emergency.pull("somebody is in the way")
        assert wait_for(lambda: emulated.report.velocity == REST)
        assert not wait_for(moves, 0.3)
        emergency.release()
        assert not wait_for(lambda: emulated.report.velocity != REST, 0.3), "moves by the release alone"
        assert wait_for(moves)
        texts = [received.message.text for received in base.read(1 << 62) if hasattr(received.message, "text")]
        assert "emergency stop: somebody is in the way" in texts


def test_the_button_on_the_base_latches_and_cannot_be_released_while_pressed() -> None:
    with driven() as pair:
        assert wait_for(lambda: pair.base.status is not None)
        pair.emulated.faults.begin(FaultKind.BUTTON)
        assert wait_for(lambda: pair.base.emergency.reason == "the base's emergency button is pressed")
        pair.emulated.faults.end(FaultKind.BUTTON)
        assert wait_for(lambda: pair.stands)
        pair.emulated.faults.begin(FaultKind.BUTTON)
        pair.base.emergency.release()
        assert wait_for(lambda: bool(pair.base.emergency.reason)), "released on a button that is pressed"
        pair.emulated.faults.end(FaultKind.BUTTON)
        pair.base.emergency.release()
        assert pair.drive()
        assert not pair.base.emergency.reason


def test_the_emergency_stop_outlives_a_power_cycle() -> None:
    with driven() as pair:
        pair.base.emergency.pull("smoke")
        pair.emulated.faults.begin(FaultKind.POWER)
        assert pair.told("the base is lost")
        pair.emulated.faults.end(FaultKind.POWER)
        assert pair.told("the base is back")
        pair.base.command(AHEAD)
        assert not pair.drives_on()


@pytest.mark.parametrize(
    ("kind", "value", "begun", "ended"),
    [
        (FaultKind.STALL, 1.0, "stalled: left and right wheels", "stalled no more"),
        (FaultKind.FRONT_BUMPER, 1.0, "front bumper touched, segment 3", "front bumper free"),
        (FaultKind.REAR_BUMPER, 1.0, "rear bumper touched, segment 3", "rear bumper free"),
        (FaultKind.BATTERY, 11.0, "battery low: 11.0 V; charge it", "battery well: 12.8 V"),
    ],
)
def test_troubles_of_the_base_are_told_when_they_begin_and_end(
    kind: FaultKind, value: float, begun: str, ended: str
) -> None:
    with driven() as pair:
        pair.emulated.faults.begin(kind, value)
        assert pair.told(begun)
        pair.emulated.faults.end(kind)
        assert pair.told(ended)
        assert [text for text in pair.texts if text in (begun, ended)] == [begun, ended]


def test_a_touched_bumper_stops_the_base_and_lets_it_back_away() -> None:
    with driven() as pair:
        assert pair.drive()
        pair.emulated.faults.begin(FaultKind.FRONT_BUMPER)
        assert pair.keep_driving_until(lambda: pair.stands)
        assert pair.drive(Twist(-0.2, 0.0))


def test_the_base_turns_as_it_is_told() -> None:
    with driven() as pair:
        assert pair.keep_driving_until(lambda: pair.emulated.report.velocity.angular_radps > 0.5, Twist(0.0, 0.9))
        assert pair.keep_driving_until(
            lambda: math.isclose(pair.emulated.report.velocity.angular_radps, math.radians(52)), Twist(0.0, 0.9)
        )


def test_a_session_that_another_client_has_left_open_is_taken_over() -> None:
    with EmulatedP3at(PORTS["serial"](), settings=QUICK) as emulated:
        config = P3atConfig(address=emulated.address)
        open_session(link.open_link(emulated.address, 9600, 1.0), config).link.close()  # as a client that dies
        with P3atBase(config) as base:
            assert wait_for(lambda: base.status is not None)


def test_a_motion_that_a_dead_client_has_left_is_not_woken_by_the_next_one() -> None:
    """The watchdog has stopped the base, and any packet but CLOSE would have it go on."""
    settings = replace(QUICK, watchdog_ms=100)
    with EmulatedP3at(PORTS["serial"](), settings=settings) as emulated:
        config = P3atConfig(address=emulated.address)
        left = open_session(link.open_link(emulated.address, 9600, 1.0), config).link
        left.write(encode(Code.VEL, 300))
        assert wait_for(lambda: emulated.report.watchdog_stops == 1)
        assert wait_for(lambda: emulated.report.velocity == REST)
        left.close()
        there_m = emulated.report.pose.x_m
        with P3atBase(config) as base:
            assert wait_for(lambda: base.status is not None)
            assert not wait_for(lambda: emulated.report.pose.x_m != there_m, 0.2)


@contextmanager
def another_device(says: bytes) -> Iterator[str]:
    """Something that listens, says ``says`` to whoever comes, and nothing more."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            client, _ = server.accept()
            with client:
                client.sendall(says)
                while client.recv(4096):
                    pass

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"socket://127.0.0.1:{server.getsockname()[1]}"
        thread.join(5)


def refusal(address: str) -> str:
    with pytest.raises((DeviceError, UsageError)) as refused:
        P3atBase(P3atConfig(address=address, connect_s=0.3))
    return str(refused.value)


def test_another_device_is_named_by_what_it_says() -> None:
    with another_device(b"SSH-2.0-OpenSSH_9.2\r\n") as address:
        assert "says b'SSH-2.0-OpenSSH_9.2" in refusal(address)


def test_a_device_that_says_nothing() -> None:
    with another_device(b"") as address:
        assert "nothing answers within 0.3 s; is it switched on" in refusal(address)


def test_a_port_that_nobody_listens_on() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    assert f"nobody listens on port {port}" in refusal(f"socket://127.0.0.1:{port}")


def test_a_base_that_has_a_client_already() -> None:
    with EmulatedP3at(PORTS["tcp"](), settings=QUICK) as emulated, P3atBase(P3atConfig(address=emulated.address)):
        assert "is another program using it?" in refusal(emulated.address)


def test_a_serial_port_that_is_in_use() -> None:
    with EmulatedP3at(PORTS["serial"](), settings=QUICK) as emulated, P3atBase(P3atConfig(address=emulated.address)):
        assert "in use by another program" in refusal(emulated.address)


@pytest.mark.parametrize("address", ["http://robot", "socket://", "socket://robot:port", "socket://robot:0/x"])
def test_an_address_that_is_none(address: str) -> None:
    assert "name a serial port as /dev/ttyUSB0, or socket://HOST:PORT" in refusal(address)


def test_a_serial_port_that_is_not_there(tmp_path: Path) -> None:
    assert "no such serial port" in refusal(str(tmp_path / "ttyUSB7"))


def test_a_file_is_no_serial_port(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "does not open as a serial port" in refusal(str(tmp_path / "file"))


def test_a_serial_port_without_rights(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise serial.SerialException(13, "could not open port")

    monkeypatch.setattr(link.serial, "Serial", refuse)
    assert "no rights; join the group that owns it (often dialout)" in refusal("/dev/ttyUSB0")
