"""A terminal with the cockpit in it, and somebody who drives."""

import os
import pty
import subprocess
import sys
import termios
import time
from collections.abc import Sequence
from contextlib import suppress
from fcntl import ioctl
from pathlib import Path
from struct import pack

from labeling_rig import TAKE_OVER, LabelingTerminal, terminal_environment

from sdt_tools.frames import MotionClass, MotionCommand, Odometry, Received
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.reader import Recording
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource

KEY_PERIOD_S = 0.05
DEAF_TO_HANGUP = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); "


class CockpitTerminal(LabelingTerminal):
    """``sdt record scene`` in the foreground of a terminal."""

    def hold(self, key: str, seconds: float) -> None:
        """Keep a key down: it comes again and again."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.press(key)
            self.look()
            time.sleep(KEY_PERIOD_S)

    def rest(self, seconds: float) -> None:
        """No key."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.look()
            time.sleep(KEY_PERIOD_S)

    def hang_up(self) -> int:
        """The connection breaks; when."""
        os.close(self.slave)
        os.close(self.master)
        return time.time_ns()

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        for descriptor in (self.master, self.slave):
            with suppress(OSError):  # it has hung up
                os.close(descriptor)


def start_recording(*arguments: object, before: str = "", columns: int = 80, lines: int = 24) -> CockpitTerminal:
    """The command in a new terminal; ``before`` is what Python does first."""
    master, slave = pty.openpty()
    ioctl(slave, termios.TIOCSWINSZ, pack("HHHH", lines, columns, 0, 0))
    as_it_was = termios.tcgetattr(slave)
    program = before + TAKE_OVER + "from sdt_tools.cli.app import main; main()"
    call = [sys.executable, "-c", program, "record", "scene", *map(str, arguments)]
    environment = terminal_environment(columns, lines)
    process = subprocess.Popen(call, stdin=slave, stdout=slave, stderr=slave, env=environment)
    return CockpitTerminal(master, slave, as_it_was, process)


def messages(path: Path, *topics: str) -> list[Received]:
    with Recording.open(path) as recording:
        assert not recording.truncated
        return list(recording.messages(topics or None))


def commands(path: Path) -> list[tuple[int, MotionCommand]]:
    return [
        (one.received_ns, one.message)
        for one in messages(path, "/robot/command")
        if isinstance(one.message, MotionCommand)
    ]


def driven(path: Path) -> list[tuple[str, MotionClass]]:
    """Who drove what, one after the other, each once."""
    found: list[tuple[str, MotionClass]] = []
    for _, command in commands(path):
        if not found or found[-1] != (command.driver, command.motion):
            found.append((command.driver, command.motion))
    return found


def motions(path: Path) -> list[MotionClass]:
    """What was driven, one after the other, each once, without standing."""
    moved = [motion for driver, motion in driven(path) if driver != STOP and motion is not MotionClass.STAY]
    return [motion for place, motion in enumerate(moved) if place == 0 or moved[place - 1] is not motion]


def poses(sensed: Sequence[object]) -> list[Odometry]:
    return [one.message for one in sensed if isinstance(one, Received) and isinstance(one.message, Odometry)]


def replayed(path: Path, scenario: str, seed: int) -> list[Odometry]:
    """Where the robot comes to when the recorded commands are driven again, each at its time."""
    recorded = poses(messages(path, "/robot/odometry"))
    source = SceneSource(layout_for(scenario, seed), start_ns=recorded[0].stamp_ns)
    sensed: list[object] = []
    for received_ns, command in commands(path):
        sensed += source.read(received_ns)
        source.command(command.twist)
    sensed += source.read(recorded[-1].stamp_ns)
    return poses(sensed)
