"""A terminal with the labeling app in it, and somebody who types."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sdt_tools.frames import RAYS, CameraImage, LidarScan, Received
from sdt_tools.labeling.journal import read_journal
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter

START_NS = 1_735_689_600_000_000_000
STEP_NS = 20_000_000
LONGEST_S = 60.0
RIGHT = "\x1b[C"
QUIT = "\x11"
TAKE_OVER = "import fcntl, os, termios; os.setsid(); fcntl.ioctl(0, termios.TIOCSCTTY, 0); "


def record(path: Path, frames: int) -> Path:
    with RecordingWriter(path, SourceInfo("scene", path.stem, 7), "") as writer:
        for row in range(frames):
            at_ns = START_NS + row * STEP_NS
            writer.write(Received(at_ns, LidarScan(at_ns, np.full(RAYS, 1.0 + row % 7 / 10))))
            if row % 2:
                writer.write(Received(at_ns, CameraImage(at_ns, b"no jpeg")))
    return path


def rows_labelled(journal: Path, labeler: str) -> list[int]:
    """The frames that somebody has acted on, in the order of the acts."""
    if not journal.exists():
        return []
    table = read_journal(journal).table
    mine = table.filter(table["labeler"] == labeler)
    return [(stamp_ns - START_NS) // STEP_NS for stamp_ns in mine["stamp_ns"].to_list()]


@dataclass
class LabelingTerminal:
    """A pseudo terminal, the app in its foreground, and all that was shown."""

    master: int
    slave: int
    before: list[object]
    process: subprocess.Popen[bytes]
    shown: bytes = b""

    def press(self, keys: str) -> None:
        os.write(self.master, keys.encode())

    def look(self) -> str:
        """What has been shown so far, without what moves the cursor and colours."""
        while select.select([self.master], [], [], 0)[0]:
            try:
                data = os.read(self.master, 1 << 16)
            except OSError:  # nobody holds the other end any more
                break
            if not data:
                break
            self.shown += data
        return re.sub(r"\x1b\[[0-9;?<>=]*[A-Za-z]", "", self.shown.decode(errors="replace"))

    def wait_for(self, words: str) -> None:
        self.until(lambda: words in self.look(), f"'{words}' is not shown")

    def until(self, happens: Callable[[], bool], what: str) -> None:
        end_s = time.monotonic() + LONGEST_S
        while not happens():
            assert time.monotonic() < end_s, what
            assert self.process.poll() is None or happens(), f"it has ended: {what}"
            time.sleep(0.02)

    def frame_shown(self, frames: int) -> int:
        """The number, from 1, of the frame that the heading named last."""
        found = re.findall(rf"([\d,]+)/{frames:,}\b", self.look())
        return int(found[-1].replace(",", "")) if found else 0

    def resize(self, columns: int, lines: int) -> None:
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
        self.process.send_signal(signal.SIGWINCH)

    def end(self) -> int:
        end_s = time.monotonic() + LONGEST_S
        while self.process.poll() is None:
            self.look()
            assert time.monotonic() < end_s, "it does not end"
            time.sleep(0.02)
        self.look()
        return self.process.returncode

    @property
    def restored(self) -> bool:
        return termios.tcgetattr(self.slave) == self.before


def terminal_environment(columns: int = 80, lines: int = 24) -> dict[str, str]:
    """An environment that tells a size too, as some shells do: what the terminal itself says must go before it."""
    told = {"TERM": "xterm-256color", "COLORTERM": "truecolor", "COLUMNS": str(columns), "LINES": str(lines)}
    return {**os.environ, **told}


def start_labeling(*arguments: object, columns: int = 80, lines: int = 24) -> LabelingTerminal:
    """``sdt label edit`` in the foreground of a new terminal."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
    before = termios.tcgetattr(slave)
    command = [sys.executable, "-c", TAKE_OVER + "from sdt_tools.cli.app import main; main()", "label", "edit"]
    environment = terminal_environment(columns, lines)
    call = [*command, *map(str, arguments)]
    process = subprocess.Popen(call, stdin=slave, stdout=slave, stderr=slave, env=environment)
    return LabelingTerminal(master, slave, before, process)
