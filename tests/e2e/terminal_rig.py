"""``sdt`` in a pseudo terminal, and somebody who types and looks."""

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
from contextlib import suppress
from dataclasses import dataclass

LONGEST_S = 60.0
KEY_PERIOD_S = 0.05
RIGHT = "\x1b[C"
QUIT = "\x11"
DEAF_TO_HANGUP = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); "
_TAKE_OVER = "import fcntl, os, termios; os.setsid(); fcntl.ioctl(0, termios.TIOCSCTTY, 0); "


@dataclass
class Terminal:
    """A pseudo terminal, the command in its foreground, and all that was shown."""

    master: int
    slave: int
    before: list[object]
    process: subprocess.Popen[bytes]
    shown: bytes = b""

    def press(self, keys: str) -> None:
        os.write(self.master, keys.encode())

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
            self.look()  # or it would wait for somebody who reads
            assert time.monotonic() < end_s, what
            assert self.process.poll() is None or happens(), f"it has ended: {what}"
            time.sleep(0.02)

    def resize(self, columns: int, lines: int) -> None:
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
        self.process.send_signal(signal.SIGWINCH)

    def hang_up(self) -> int:
        """The connection breaks; when."""
        os.close(self.slave)
        os.close(self.master)
        return time.time_ns()

    def end(self) -> int:
        end_s = time.monotonic() + LONGEST_S
        while self.process.poll() is None:
            self.look()
            assert time.monotonic() < end_s, "it does not end"
            time.sleep(0.02)
        self.look()
        return self.process.returncode

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        for descriptor in (self.master, self.slave):
            with suppress(OSError):  # it has hung up
                os.close(descriptor)

    @property
    def restored(self) -> bool:
        return termios.tcgetattr(self.slave) == self.before


def terminal_environment(columns: int = 80, lines: int = 24) -> dict[str, str]:
    """An environment that tells a size too, as some shells do: what the terminal itself says must go before it."""
    told = {"TERM": "xterm-256color", "COLORTERM": "truecolor", "COLUMNS": str(columns), "LINES": str(lines)}
    return {**os.environ, **told}


def start_sdt(*arguments: object, before: str = "", columns: int = 80, lines: int = 24) -> Terminal:
    """``sdt`` in the foreground of a new terminal; ``before`` is what Python does first."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
    as_it_was = termios.tcgetattr(slave)
    program = before + _TAKE_OVER + "from sdt_tools.cli.app import main; main()"
    call = [sys.executable, "-c", program, *map(str, arguments)]
    environment = terminal_environment(columns, lines)
    process = subprocess.Popen(call, stdin=slave, stdout=slave, stderr=slave, env=environment)
    return Terminal(master, slave, as_it_was, process)
