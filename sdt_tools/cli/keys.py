"""Single keys from the terminal, and the terminal as it was afterwards."""

import os
import select
import sys
import termios
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress


def at_a_terminal() -> bool:
    """Whether somebody can press keys: stdin is a terminal and this process is in its foreground."""
    try:
        return os.isatty(sys.stdin.fileno()) and os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except (OSError, ValueError):  # closed, or no file at all
        return False


@contextmanager
def pressed_keys(heard: Callable[[str], None], descriptor: int = 0) -> Iterator[None]:
    """Within the block ``heard`` is called, in a thread, with each key; Ctrl-C stays a signal.

    Keys are not echoed. On every way out the terminal is as it was before.
    """
    before = termios.tcgetattr(descriptor)
    stop_reading, stop = os.pipe()

    def read() -> None:
        while True:
            ready, _, _ = select.select([descriptor, stop_reading], [], [])
            if stop_reading in ready:
                return
            try:
                keys = os.read(descriptor, 64)
            except OSError:  # the terminal hung up
                return
            if not keys:
                return
            for key in keys.decode("utf-8", "ignore"):
                heard(key)

    reader = threading.Thread(target=read, name="keys", daemon=True)
    try:
        tty.setcbreak(descriptor, termios.TCSANOW)
        reader.start()
        yield
    finally:
        with suppress(termios.error):  # a terminal that hung up has nothing to give back
            termios.tcsetattr(descriptor, termios.TCSANOW, before)
        os.write(stop, b"\0")
        if reader.is_alive():
            reader.join()
        os.close(stop)
        os.close(stop_reading)
