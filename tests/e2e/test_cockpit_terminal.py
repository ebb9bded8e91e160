"""The cockpit in a real terminal: driving, hanging up, signals, resizing, takes, taking over."""

import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from dataclasses import astuple
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from cockpit_rig import commands, driven, messages, motions, poses, replayed
from terminal_rig import DEAF_TO_HANGUP, LONGEST_S, QUIT, RIGHT, Terminal

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import Gesture, Mode, MotionClass, OperatorState, Twist
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.reader import Recording

SDT = [sys.executable, "-c", "from sdt_tools.cli.app import main; main()"]
PLAIN = ["--scenario", "plain", "--seed", "7", "--no-camera"]
RELEASE = "\x12"
CLOSED_SCREEN = b"\x1b[?1049l"
STOP_S = 0.3
"""A robot whose terminal is gone has its stop command by then."""

SOURCE_HANGS = """
import threading
from sdt_tools.scene.source import SceneSource
read = SceneSource.read
def hang(source, until_ns):
    if until_ns - source.start_ns > 1_500_000_000:
        threading.Event().wait()
    return read(source, until_ns)
SceneSource.read = hang
"""

Start = Callable[..., Terminal]


@pytest.fixture
def cockpit(at_terminal: Start) -> Start:
    """``sdt record scene`` at a terminal."""
    return lambda *arguments, **how: at_terminal("record", "scene", *PLAIN, *arguments, **how)


def test_scripted_keys_drive_the_scene_and_the_recorded_commands_drive_it_again(tmp_path: Path, cockpit: Start) -> None:
    path = tmp_path / "drive.mcap"
    terminal = cockpit("--driver", "keyboard", "--out", path)
    terminal.wait_for("REC")
    for key in ("w", "q", "x", RIGHT, "1"):
        terminal.hold(key, 0.5)
    terminal.press(" ")
    terminal.rest(0.4)
    terminal.press("-")
    terminal.hold("w", 0.5)
    terminal.rest(0.8)
    terminal.press(QUIT)
    assert terminal.end() == 0
    assert terminal.restored
    assert motions(path) == [
        MotionClass.FORWARD,
        MotionClass.LEFT_FORWARD,
        MotionClass.BACKWARD,
        MotionClass.RIGHT_FORWARD,
        MotionClass.LEFT_BACKWARD,
        MotionClass.FORWARD,
    ]
    assert driven(path)[-1] == ("keyboard", MotionClass.STAY)  # the key was let go
    forward = [command.twist for _, command in commands(path) if command.motion is MotionClass.FORWARD]
    assert (forward[0], forward[-1]) == (Twist(0.5, 0.0), Twist(0.375, 0.0))
    assert not any(command.intervention for _, command in commands(path))
    recorded = poses(messages(path, "/robot/odometry"))
    assert max(one.pose.yaw_rad for one in recorded) - recorded[0].pose.yaw_rad > 0.1
    again = replayed(path, "plain", 7)
    assert [one.stamp_ns for one in again] == [one.stamp_ns for one in recorded]
    # a recording holds angles as quaternions, which rounds them
    np.testing.assert_allclose(
        [astuple(one.pose) for one in again], [astuple(one.pose) for one in recorded], atol=1e-12
    )


@pytest.mark.parametrize("how", ["hang-up", "hang-up without a signal", "SIGTERM", "SIGTERM, then hang-up"])
def test_what_ends_the_terminal_in_mid_motion_stops_the_robot_and_the_file_is_whole(
    tmp_path: Path, cockpit: Start, how: str
) -> None:
    path = tmp_path / "drive.mcap"
    before = DEAF_TO_HANGUP if how == "hang-up without a signal" else ""
    terminal = cockpit("--driver", "keyboard", "--hold-s", "3", "--out", path, before=before)
    terminal.wait_for("REC")
    terminal.hold("w", 0.8)
    if how == "SIGTERM":
        terminal.process.send_signal(signal.SIGTERM)
        end_ns = time.time_ns()
        assert terminal.end() == 128 + signal.SIGTERM
        assert terminal.restored
    elif how == "SIGTERM, then hang-up":
        terminal.process.send_signal(signal.SIGTERM)
        end_ns = time.time_ns()
        terminal.until(lambda: CLOSED_SCREEN in terminal.shown, "the screen is not closed")
        terminal.hang_up()
        assert terminal.process.wait(LONGEST_S) in (128 + signal.SIGTERM, -signal.SIGHUP)
    else:
        end_ns = terminal.hang_up()
        assert terminal.process.wait(LONGEST_S) == 128 + signal.SIGHUP
    (before_ns, moving), (stop_ns, stop) = commands(path)[-2:]
    assert moving.twist.linear_mps > 0
    assert (stop.driver, stop.twist) == (STOP, Twist(0.0, 0.0))
    assert before_ns <= stop_ns < end_ns + STOP_S * SECOND_NS
    with Recording.open(path) as recording:
        assert recording.stats["ending"] == ("terminated" if "SIGTERM" in how else "hangup")


def test_a_source_that_hangs_stops_the_robot_and_does_not_keep_anyone_from_quitting(
    tmp_path: Path, cockpit: Start
) -> None:
    path = tmp_path / "drive.mcap"
    terminal = cockpit("--driver", "keyboard", "--hold-s", "5", "--out", path, before=SOURCE_HANGS)
    terminal.wait_for("REC")
    terminal.press("w")
    terminal.wait_for("the scene does not answer: the robot stands")
    terminal.press(QUIT)
    assert terminal.end() == 0
    assert [motion for _, motion in driven(path)][-2:] == [MotionClass.FORWARD, MotionClass.STAY]
    assert driven(path)[-1][0] == STOP


def test_the_emergency_stop_latches_and_what_happens_is_told(tmp_path: Path, cockpit: Start) -> None:
    path = tmp_path / "drive.mcap"
    terminal = cockpit("--driver", "keyboard", "--out", path)
    terminal.wait_for("REC")
    terminal.hold("w", 0.4)
    terminal.press("\x1b")
    terminal.wait_for("EMERGENCY STOP: the key Esc")
    terminal.hold("w", 0.5)
    terminal.press(RELEASE)
    terminal.wait_for("released; drive on")
    terminal.hold("c", 0.4)
    terminal.press("mthe door\r")  # at once, as from a connection that was slow: none of it drives
    terminal.wait_for("mark 1: the door")
    terminal.press("p")
    terminal.wait_for("wants idle")
    terminal.rest(0.3)
    terminal.press(QUIT)
    assert terminal.end() == 0
    told = [one.message.text for one in messages(path, "/session/log")]
    assert told == ["emergency stop: the key Esc", "the emergency stop is released", "mark 1", "mark 1: the door"]
    drivers = [driver for driver, motion in driven(path)]
    assert STOP in drivers
    after = drivers[drivers.index(STOP) :]
    assert after.count(STOP) == 1  # no command while it was latched
    assert motions(path)[-1] is MotionClass.RIGHT_BACKWARD
    states = [one.message for one in messages(path, "/operator/state") if isinstance(one.message, OperatorState)]
    assert Gesture.DISABLE in {state.gesture for state in states}
    assert states[-1].commanded_mode is Mode.IDLE


def test_a_hand_takes_over_from_a_policy_and_gives_back(tmp_path: Path, cockpit: Start) -> None:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 0)
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    save_checkpoint(tmp_path / "net", network, card)
    path = tmp_path / "drive.mcap"
    terminal = cockpit("--driver", f"policy:{tmp_path / 'net'}", "--cockpit", "--out", path)
    terminal.wait_for("REC")
    terminal.rest(0.5)
    terminal.hold("z", 0.5)
    terminal.rest(0.8)
    terminal.press(" ")
    terminal.wait_for("g gives back")
    terminal.rest(0.5)
    terminal.press("g")
    terminal.rest(0.4)
    terminal.press(QUIT)
    assert terminal.end() == 0
    who = [driver for driver, _ in groupby(driver for driver, _ in driven(path))]
    assert who[:5] == ["policy:net", "keyboard", "policy:net", STOP, "policy:net"]
    by_hand = {command.intervention for _, command in commands(path) if command.driver == "keyboard"}
    by_policy = {command.intervention for _, command in commands(path) if command.driver == "policy:net"}
    assert (by_hand, by_policy) == ({True}, {False})
    assert {motion for driver, motion in driven(path) if driver == "keyboard"} == {MotionClass.LEFT_BACKWARD}


def test_takes_are_started_paused_discarded_and_kept(tmp_path: Path, cockpit: Start) -> None:
    folder = tmp_path / "s"
    terminal = cockpit("--driver", "expert", "--cockpit", "--session", folder)
    terminal.wait_for("REC")
    terminal.rest(0.4)
    terminal.press("v")
    terminal.wait_for("PAUSED")
    terminal.press("v")
    terminal.press("n")
    terminal.wait_for("take_002")
    terminal.rest(0.4)
    terminal.press("\x18")
    terminal.wait_for("STANDBY")
    terminal.press("t")
    terminal.wait_for("take_003")
    terminal.rest(0.4)
    terminal.press(QUIT)
    assert terminal.end() == 0
    takes = tomllib.loads((folder / "session.toml").read_text())["takes"]
    assert [(take["name"], bool(take.get("trash"))) for take in takes] == [
        ("take_001.mcap", False),
        ("take_002.mcap", True),
        ("take_003.mcap", False),
    ]
    assert {driver for driver, _ in driven(folder / "take_001.mcap")} == {"expert"}


def test_resizing_while_driving_loses_nothing_and_a_small_terminal_still_stops(tmp_path: Path, cockpit: Start) -> None:
    path = tmp_path / "drive.mcap"
    terminal = cockpit("--driver", "keyboard", "--hold-s", "5", "--out", path)
    terminal.wait_for("REC")
    terminal.hold("x", 0.5)
    terminal.resize(50, 12)
    terminal.wait_for("50 × 12 is too small")
    terminal.press(" ")
    terminal.rest(0.5)
    terminal.resize(160, 50)
    terminal.shown = b""
    terminal.wait_for("scans")
    terminal.hold("w", 0.4)
    terminal.press(QUIT)
    assert terminal.end() == 0
    assert [motion for _, motion in driven(path)][:4] == [
        MotionClass.STAY,
        MotionClass.BACKWARD,
        MotionClass.STAY,
        MotionClass.FORWARD,
    ]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--driver", "keyboard"], "--driver keyboard needs a terminal"),
        (["--cockpit"], "--cockpit needs a terminal"),
        (["--gamepad"], "--gamepad needs --cockpit"),
        (["--driver", "keyboard", "--perturb"], "--perturb forces motions"),
    ],
)
def test_without_a_terminal_it_says_what_to_do(tmp_path: Path, arguments: list[str], words: str) -> None:
    call = [*SDT, "record", "scene", *PLAIN, *arguments, "--out", str(tmp_path / "x.mcap")]
    ended = subprocess.run(call, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    assert words in ended.stderr
    assert not (tmp_path / "x.mcap").exists()


def test_without_a_gamepad_it_says_so_and_records_nothing(tmp_path: Path, cockpit: Start) -> None:
    terminal = cockpit("--driver", "gamepad", "--out", tmp_path / "x.mcap")
    assert terminal.end() == 2
    assert "gamepad" in terminal.look()
    assert not (tmp_path / "x.mcap").exists()
