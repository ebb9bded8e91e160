"""Parts that hang or crash, and what devices are told by a doctor: nothing that changes them."""

import time
from pathlib import Path

import numpy as np
import pytest

from sdt_tools.doctor import computer, devices, probes
from sdt_tools.doctor.finding import Finding, Level
from sdt_tools.doctor.probes import Asked, examine, failed
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.emulation.p3at.ports import TcpPort
from sdt_tools.emulation.p3at.server import EmulatedP3at
from sdt_tools.frames import RAYS, Twist
from sdt_tools.robot.p3at.base import P3atBase
from sdt_tools.robot.p3at.config import P3atConfig


class Wall:
    def ranges_at(self, host_ns: int) -> np.ndarray:
        return np.full(RAYS, 2.0)


def levels(findings: list[Finding]) -> dict[str, Level]:
    return {one.what: one.level for one in findings}


def test_a_part_that_hangs_is_ended_in_time_and_one_that_crashes_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    hanging = probes._Part("camera", "camera", ("/dev/zero",), asked=True)
    crashing = probes._Part("disk", "no such probe", ())
    monkeypatch.setattr(probes, "_parts", lambda _: [hanging, crashing])
    real = probes.subprocess.Popen

    def shell(call: list[str], **options: object) -> object:
        script = "echo half; sleep 60" if call[3] == "camera" else "echo broken >&2; exit 3"
        return real(["/bin/sh", "-c", script], **options)

    monkeypatch.setattr(probes.subprocess, "Popen", shell)
    began_s = time.monotonic()
    found = examine(Asked(camera="/dev/zero"), limit_s=0.3)
    assert time.monotonic() - began_s < 10
    (hung,) = [one for one in found if one.section == "camera"]
    assert (hung.level, hung.seen) == (Level.FAIL, "no answer in time")
    assert failed(found, Asked(camera="/dev/zero"))
    assert not failed(found, Asked())
    assert [one.seen for one in found if one.section == "disk"] == ["crashed: broken"]


@pytest.mark.parametrize("protocol", ["a", "b"])
def test_a_lidar_says_who_it_is_and_keeps_its_settings(protocol: str) -> None:
    device = EmulatedConfig(port=0, protocol=protocol, scan_hz=25)
    with EmulatedLms1xx(Wall(), device) as emulator:
        found = list(devices.lidar(f"127.0.0.1:{emulator.port}", asked=True))
        assert emulator.device.settings.scan.frequency == 2500
        assert emulator.device.stored_writes == 0
    said = {one.what: one.seen for one in found}
    assert said[f"127.0.0.1:{emulator.port}"].startswith("LMS10x_FieldEval V1.36-21.10.2010, CoLa-")
    assert said["state"] == "ready to measure (state 7)"
    assert "a session will set them" in said["settings"]
    assert float(said["scans"].split()[0]) == pytest.approx(25, rel=0.1)


def test_a_lidar_that_is_not_there_fails_only_where_it_was_asked_for() -> None:
    (asked,) = devices.lidar("127.0.0.1:9", asked=True)
    assert asked.level is Level.FAIL
    assert "nothing listens at this port" in asked.seen
    (looked,) = devices.lidar("127.0.0.1:9", asked=False)
    assert looked.level is Level.WARN
    (wrong,) = devices.lidar("127.0.0.1:many", asked=True)
    assert "'port'" in wrong.seen


def test_a_base_says_who_it_is_and_keeps_its_motors_off() -> None:
    with EmulatedP3at(TcpPort("127.0.0.1", 0)) as emulated:
        motors = []
        obey = emulated._firmware._obey
        emulated._firmware._obey = lambda *words: (motors.append(words[0].code), obey(*words))[1]  # type: ignore[method-assign]
        found = list(devices.base(emulated.address, 9600, asked=True))
        assert not emulated.report.motors_on
        assert set(motors) <= {0, 1, 2, 18}, "synchronisation, OPEN, CLOSE and CONFIG, nothing else"
    assert set(levels(found).values()) == {Level.OK}
    assert {one.what: one.seen for one in found}["watchdog"] == "stops it after 2000 ms"


def test_a_base_that_nobody_answers_for() -> None:
    (found,) = devices.base("/dev/no-such-port", 9600, asked=True)
    assert (found.level, found.do) == (Level.FAIL, "is the adapter plugged in? dmesg names its port")


def test_a_camera_gives_what_it_gives(tmp_path: Path) -> None:
    (found,) = devices.camera(str(tmp_path / "none.mp4"), asked=True)
    assert found.level is Level.FAIL
    assert "no such video file" in found.seen


def test_a_disk_is_written_to_and_left_as_it_was(tmp_path: Path) -> None:
    found = list(computer.disk(tmp_path / "recordings"))
    assert [one.what.rsplit(", ")[-1] for one in found] == ["room", "writing"]
    assert "MB/s with fsync" in found[1].seen
    assert list(tmp_path.iterdir()) == []


def test_a_disk_without_rights(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(folder: Path) -> tuple[float, float]:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(computer, "_write_speed", refuse)
    assert list(computer.disk(tmp_path))[1].level is Level.FAIL


def test_the_clock_says_whether_it_is_synchronised() -> None:
    (found,) = computer.clock()
    assert "synchronised" in found.seen


def test_a_base_in_a_session_is_only_listened_to() -> None:
    """A pty or a server of one client would refuse; what the wire carries is told here by hand."""
    with EmulatedP3at(TcpPort("127.0.0.1", 0)) as emulated:
        with P3atBase(P3atConfig(address=emulated.address)) as base:
            base.command(Twist(0.0, 0.0))
        emulated._firmware.is_open = True  # as a client leaves it that was killed
        received = emulated.report.packets_received
        found = list(devices.base(emulated.address, 9600, asked=True))
        assert emulated.report.packets_received == received
    assert found[0].level is Level.WARN
    assert "in a session already" in found[0].seen
