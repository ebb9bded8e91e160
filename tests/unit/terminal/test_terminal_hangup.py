"""A terminal that goes away."""

import os
import pty
import threading
from contextlib import suppress

from sdt_tools.terminal.hangup import _Lasting, hangup_watched


def test_a_hang_up_is_told_at_once_and_once() -> None:
    master, slave = pty.openpty()
    told: list[bool] = []
    heard = threading.Event()

    def gone() -> None:
        told.append(True)
        heard.set()

    with hangup_watched(gone, slave):
        os.write(master, b"keys are not touched")
        assert not heard.wait(0.2)
        os.close(master)
        assert heard.wait(5.0)
    assert told == [True]
    os.close(slave)


def test_a_terminal_that_stays_is_not_told_of() -> None:
    master, slave = pty.openpty()
    told: list[bool] = []
    with hangup_watched(lambda: told.append(True), slave):
        pass
    assert told == []
    for descriptor in (master, slave):
        os.close(descriptor)


def test_writing_to_a_terminal_that_has_gone_does_nothing() -> None:
    master, slave = pty.openpty()
    stream = os.fdopen(slave, "w")
    lasting = _Lasting(stream)
    assert lasting.write("seen") == 4
    lasting.flush()
    assert os.read(master, 16) == b"seen"
    os.close(master)
    for _ in range(3):
        assert lasting.write("lost") == 4
        lasting.flush()
    with suppress(OSError):
        stream.close()
