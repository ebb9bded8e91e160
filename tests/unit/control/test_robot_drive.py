"""The robot driven and recorded over real sockets, and how it comes to stand."""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from robot_rig import Does, Notes, emulated, robot_file, run, stands_within_s

sys.path.append(str(Path(__file__).parents[1] / "robot"))

from mjpeg_server import MjpegServer

from sdt_tools.control.robot.config import RobotFile
from sdt_tools.control.robot.drive import drive_robot
from sdt_tools.control.robot.opened import open_robot
from sdt_tools.control.robot.takes import RobotTakesConfig, open_session, record_robot_takes
from sdt_tools.emulation.lms1xx.fault_kinds import LidarFault
from sdt_tools.emulation.robot.robot import EmulatedRobot
from sdt_tools.errors import ConfigError, DeviceError
from sdt_tools.frames import (
    CameraCalibration,
    FrameTransform,
    LidarScan,
    LogEntry,
    MotionClass,
    MotionCommand,
    Odometry,
)
from sdt_tools.recording.live.drivers import ConstantDriver
from sdt_tools.recording.live.outcome import Ending
from sdt_tools.recording.reader import Recording
from sdt_tools.robot.camera.config import CameraConfig

SOON_S = 0.3
OWN_PASSWORD = "0BADF00D"  # noqa: S105 - the hash of none


@pytest.fixture(scope="module")
def robot() -> Iterator[EmulatedRobot]:
    with emulated() as robot:
        yield robot


@pytest.fixture
def camera() -> Iterator[str]:
    server = MjpegServer()
    server.start()
    yield server.url
    server.stop()


def test_all_devices_are_recorded_in_step(robot: EmulatedRobot, camera: str, tmp_path: Path) -> None:
    file = robot_file(robot, camera=CameraConfig(source=camera).model_dump(exclude_none=True))
    out = tmp_path / "robot.mcap"
    with open_robot(file) as opened:
        summary = drive_robot(run(file, 1.0), opened, ConstantDriver(MotionClass.LEFT_BACKWARD), out)

    assert (summary.ending, summary.recording is not None) == (Ending.TIME, True)
    assert stands_within_s(robot) < SOON_S
    with Recording.open(out) as recording:
        received = list(recording.messages())
        devices = {name: text for name, text in recording.session.items() if name.startswith("device.")}
    kinds = [type(one.message) for one in received]
    assert 45 <= kinds.count(LidarScan) <= 51
    assert kinds.count(Odometry) >= 8
    assert kinds.count(MotionCommand) >= 9
    (calibration,) = [one.message for one in received if isinstance(one.message, CameraCalibration)]
    assert (calibration.width, calibration.height) == (64, 48)
    assert {one.message.child for one in received if isinstance(one.message, FrameTransform)} == {"lidar", "camera"}
    assert any("its watchdog stops it" in one.message.text for one in received if isinstance(one.message, LogEntry))
    stamps_ns = [one.received_ns for one in received]
    assert stamps_ns == sorted(stamps_ns)
    assert "LMS10x" in devices["device.lidar"]
    assert "p3at" in devices["device.base"]


def test_delays_end_on_the_wire_and_each_decision_has_one(robot: EmulatedRobot) -> None:
    file = robot_file(robot)
    with open_robot(file) as opened:
        summary = drive_robot(run(file, 1.0), opened, ConstantDriver(MotionClass.LEFT_BACKWARD))
    assert summary.decisions - 1 <= summary.latency.count <= summary.decisions
    assert summary.latency.p50_ms is not None
    assert summary.latency.p50_ms > 0


def test_an_exception_stops_it(robot: EmulatedRobot) -> None:
    def fail() -> None:
        assert robot.base.report.velocity.linear_mps > 0
        raise ZeroDivisionError("in the driver")

    file = robot_file(robot)
    with open_robot(file) as opened, pytest.raises(ZeroDivisionError):
        drive_robot(run(file, 10.0), opened, Does(fail))
    assert stands_within_s(robot) < SOON_S
    assert not robot.base.report.motors_on


def test_a_decision_that_takes_too_long_stops_it(robot: EmulatedRobot) -> None:
    moved: list[float] = []

    def think() -> None:
        time.sleep(0.5)
        moved.append(robot.base.report.velocity.linear_mps)

    file, notes = robot_file(robot), Notes()
    with open_robot(file) as opened:
        drive_robot(run(file, 1.5), opened, Does(think), observers=[notes])
    assert moved == [0.0]
    assert any("the robot stops" in text for text in notes.texts)


def test_a_silent_lidar_stops_it_and_is_in_the_log(robot: EmulatedRobot) -> None:
    file, notes = robot_file(robot), Notes()
    with open_robot(file) as opened:
        driver = Does(lambda: robot.lidar_faults.begin(LidarFault.SILENCE))
        drive_robot(run(file, 1.0), opened, driver, observers=[notes])
        stood_s = stands_within_s(robot)
    robot.lidar_faults.end(LidarFault.SILENCE)
    assert stood_s < SOON_S
    assert any(text.startswith("LiDAR: no scan for 0.16 s") for text in notes.texts)


def test_the_emergency_stop_latches(robot: EmulatedRobot) -> None:
    file, notes = robot_file(robot), Notes()
    with open_robot(file) as opened:
        driver = Does(lambda: opened.emergency.pull("pulled by a test"))
        drive_robot(run(file, 1.2), opened, driver, observers=[notes])
        assert driver.decided > 8
        assert stands_within_s(robot) < SOON_S
    assert any("emergency stop: pulled by a test" in text for text in notes.texts)


def test_nobody_drives_a_robot_that_is_only_recorded(robot: EmulatedRobot, tmp_path: Path) -> None:
    values = robot_file(robot).model_dump(exclude={"base", "camera"})
    file = RobotFile.model_validate(values)
    out = tmp_path / "lidar.mcap"
    with open_robot(file) as opened:
        assert not opened.has_base
        summary = drive_robot(run(file, 0.4), opened, None, out)
    assert summary.decisions == 0
    with Recording.open(out) as recording:
        kinds = {type(one.message) for one in recording.messages()}
    assert kinds == {LidarScan, LogEntry, FrameTransform} or kinds == {LidarScan, FrameTransform}


def test_takes_lie_in_a_session_whose_password_is_kept_out(robot: EmulatedRobot, tmp_path: Path) -> None:
    values = robot_file(robot).model_dump(exclude_none=True)
    values["lidar"]["password"] = OWN_PASSWORD
    config = RobotTakesConfig(seconds=0.3, driver="test", robot=RobotFile.model_validate(values))
    session = open_session(config, tmp_path / "monday", resume=False)
    with open_robot(config.robot) as opened:
        summary = record_robot_takes(config, opened, session, ConstantDriver(MotionClass.STAY))
    (take,) = summary.record.takes
    assert (take.ending, take.name) == ("time", "take_001.mcap")
    assert OWN_PASSWORD not in (tmp_path / "monday/session.toml").read_text()
    with Recording.open(tmp_path / "monday" / take.name) as recording:
        assert OWN_PASSWORD not in recording.config_toml


def test_a_device_that_is_missing_leaves_none_open(robot: EmulatedRobot) -> None:
    values = robot_file(robot).model_dump(exclude_none=True)
    values["lidar"]["port"] = 1
    with pytest.raises(DeviceError, match=r"LiDAR at 127\.0\.0\.1:1"), open_robot(RobotFile.model_validate(values)):
        pass
    with open_robot(robot_file(robot)):
        pass  # the base, which takes one client at a time, is free again


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"decisions": {"follow_hz": 5}}, "decisions.follow_hz = 5 is too slow for a watchdog of 0.2 s"),
        ({"lidar": {"scan_hz": 25, "resolution_deg": 0.25, "all_rays": True}}, "gives 1081 rays"),
    ],
)
def test_files_that_do_not_fit(robot: EmulatedRobot, tables: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        robot_file(robot, **tables)
