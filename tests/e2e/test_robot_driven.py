"""``sdt drive robot`` and ``sdt record robot`` as a user starts them, at an emulated robot."""

import json
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from refusals import Sdt

sys.path.append(str(Path(__file__).parents[1] / "unit" / "control"))

from robot_rig import emulated, robot_file, stands_within_s, write_file

from sdt_tools.config import parse_config
from sdt_tools.control.robot.config import RobotFile
from sdt_tools.emulation.robot.robot import EmulatedRobot
from sdt_tools.frames import LidarScan
from sdt_tools.recording.reader import Recording

SDT = [sys.executable, "-c", "from sdt_tools.cli.app import main; main()"]
SOON_S = 0.3


@pytest.fixture(scope="module")
def robot() -> Iterator[EmulatedRobot]:
    with emulated() as robot:
        yield robot


@pytest.fixture
def config(robot: EmulatedRobot, tmp_path: Path) -> Path:
    return write_file(robot_file(robot), tmp_path / "robot.toml")


def moving(robot: EmulatedRobot, config: Path, *words: str) -> "subprocess.Popen[str]":
    """A drive under way."""
    call = [*SDT, "drive", "robot", "--config", str(config), "--follow", "constant:left_backward", *words]
    drive = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until_s = time.monotonic() + 60
    while robot.base.report.velocity.linear_mps > -0.2:
        assert drive.poll() is None, drive.communicate()
        assert time.monotonic() < until_s
        time.sleep(0.005)
    return drive


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), pytest.param(signal.SIGHUP, 129, marks=pytest.mark.slow)]
)
def test_a_signal_stops_it_at_once(robot: EmulatedRobot, config: Path, tmp_path: Path, number: int, code: int) -> None:
    drive = moving(robot, config, "--record", str(tmp_path / "drive.mcap"), "--json")
    drive.send_signal(number)
    assert stands_within_s(robot) < SOON_S
    out, _ = drive.communicate(timeout=20)
    assert drive.returncode == code
    told = json.loads(out)
    assert told["scan_to_command"]["count"] == sum(told["scan_to_command"]["histogram"]["counts"]) > 0
    with Recording.open(tmp_path / "drive.mcap") as recording:
        assert any(isinstance(one.message, LidarScan) for one in recording.messages())


@pytest.mark.slow
def test_a_drive_that_is_killed_leaves_it_to_the_watchdog(robot: EmulatedRobot, config: Path) -> None:
    drive = moving(robot, config)
    before = robot.base.report.watchdog_stops
    drive.kill()
    drive.communicate()
    assert stands_within_s(robot) < 2.0 + SOON_S
    assert robot.base.report.watchdog_stops == before + 1


def test_the_robot_is_recorded(config: Path, tmp_path: Path, sdt: Sdt) -> None:
    code, said = sdt("record", "robot", "--config", config, "--seconds", "0.5", "--out", tmp_path / "robot.mcap")
    assert code == 0, said
    with Recording.open(tmp_path / "robot.mcap") as recording:
        assert sum(isinstance(one.message, LidarScan) for one in recording.messages()) >= 20


class Babbler:
    """Something else that listens: it greets, and understands nothing."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        clients = []
        while True:
            try:
                client, _ = self._server.accept()
            except OSError:
                return
            clients.append(client)
            client.sendall(b"SSH-2.0-OpenSSH_9.2\r\n")

    def close(self) -> None:
        self._server.close()


@pytest.mark.parametrize(
    ("table", "key", "value", "words"),
    [
        ("lidar", "port", 1, ["LiDAR at 127.0.0.1:1", "port"]),
        ("lidar", "host", "no-such-host.invalid", ["no-such-host.invalid", "address"]),
        ("lidar", "port", "babbler", ["LiDAR at 127.0.0.1:"]),
        ("base", "address", "socket://127.0.0.1:1", ["nobody listens on port 1"]),
        ("base", "address", "babbler", ["base at socket://127.0.0.1:"]),
        ("base", "address", "/dev/no-such-tty", ["no such serial port"]),
        ("camera", "source", "/dev/video97", ["does not exist"]),
        ("camera", "source", "http://127.0.0.1:1/video", ["gives no video"]),
    ],
)
def test_a_device_that_is_not_there_is_told_in_a_line(
    robot: EmulatedRobot, tmp_path: Path, sdt: Sdt, table: str, key: str, value: object, words: list[str]
) -> None:
    babbler = Babbler()
    if value == "babbler":
        value = f"socket://127.0.0.1:{babbler.port}" if table == "base" else babbler.port
    values = robot_file(robot).model_dump(exclude_none=True)
    values["base"]["connect_s"] = 1.0
    values[table] = {**values.get(table, {}), key: value}
    config = write_file(parse_config(RobotFile, values, "test"), tmp_path / "robot.toml")
    code, said = sdt("record", "robot", "--config", config, "--out", "robot.mcap")
    babbler.close()
    assert (code, said.count("\n")) == (1, 1), said
    assert said.startswith("sdt: ")
    assert [word for word in words if word not in said] == []
    assert not (tmp_path / "robot.mcap").exists()


def test_a_wrong_password_is_told_in_a_line(robot: EmulatedRobot, tmp_path: Path, sdt: Sdt) -> None:
    values = robot_file(robot).model_dump(exclude_none=True)
    values["lidar"] |= {"password": "0BADF00D", "scan_hz": 25}
    config = write_file(parse_config(RobotFile, values, "test"), tmp_path / "robot.toml")
    code, said = sdt("record", "robot", "--config", config, "--out", "robot.mcap")
    assert (code, said.count("\n")) == (1, 1), said
    assert "password" in said


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (["record", "robot"], "name either --out"),
        (["record", "robot", "--out", "a.mcap", "--driver", "expert"], "no table 'base'"),
        (["record", "robot", "--out", "a.mcap", "--keep-last", "3s"], "--keep-last needs --session"),
        (["record", "robot", "--out", "a.mcap", "--driver", "keyboard"], "needs a terminal"),
        (["record", "robot", "--out", "a.mcap", "--config", "none.toml"], "none.toml: no such file"),
        (["drive", "robot", "--follow", "constant:stay"], "robot.toml: no such file"),
        (["robot", "emulate", "robot", "--fault", "power@3"], "write the device before it, as base:power@5-8"),
        (["robot", "emulate", "robot", "--fault", "camera:fire"], "the kinds are power, silence"),
        (["robot", "emulate", "robot", "--scene", "nowhere"], "nowhere"),
    ],
)
def test_calls_that_are_refused(sdt: Sdt, call: list[str], words: str) -> None:
    code, said = sdt(*call)
    assert (code, said.count("\n")) == (2, 1), said
    assert words in said


def test_the_expert_needs_a_scene(config: Path, sdt: Sdt) -> None:
    code, said = sdt("drive", "robot", "--config", config, "--follow", "expert")
    assert code == 2
    assert "the expert knows the scene's truth, and a robot has none" in said


def test_an_emulated_robot_says_where_it_is_and_how_it_fared(tmp_path: Path, sdt: Sdt) -> None:
    written = tmp_path / "robot.toml"
    ports = ["--lidar-port", "0", "--base-port", "0", "--no-camera"]
    call = [*SDT, "robot", "emulate", "robot", *ports, "--write-config", str(written), "--json"]
    pipe = subprocess.PIPE
    with subprocess.Popen(call, stdout=pipe, stderr=pipe, text=True) as playing:
        assert playing.stderr is not None
        lines = [playing.stderr.readline() for _ in range(4)]
        assert lines[0].startswith("LiDAR at 127.0.0.1:")
        assert lines[2] == f"drive it with: sdt drive robot --config {written}\n"
        code, said = sdt("record", "robot", "--config", written, "--seconds", "0.5", "--out", "a.mcap")
        playing.send_signal(signal.SIGINT)
        told = json.loads(playing.communicate(timeout=20)[0])
    assert (code, playing.returncode) == (0, 0), said
    assert told["scans"] >= 20
    assert told["time_s"] > 0.4
    assert (told["outcome"], told["contact"]) == (None, None)
