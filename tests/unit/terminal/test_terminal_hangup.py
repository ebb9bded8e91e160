"""A terminal that goes away."""

import asyncio
import os
import pty
import signal
import threading
from collections.abc import Iterator
from contextlib import suppress

import pytest

from sdt_tools.terminal.app import TerminalApp
from sdt_tools.terminal.hangup import LastingDriver, _Lasting, hangup_watched


@pytest.fixture
def signals_as_before() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in (signal.SIGTSTP, signal.SIGCONT)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_an_app_goes_on_after_a_stop_and_not_because_its_terminal_hangs_up(
    monkeypatch: pytest.MonkeyPatch, signals_as_before: None
) -> None:
    went_on: list[bool] = []
    monkeypatch.setattr(LastingDriver, "resume_application_mode", lambda _driver: went_on.append(True))
    monkeypatch.setattr(LastingDriver, "suspend_application_mode", lambda _driver: None)
    monkeypatch.setattr(os, "kill", lambda _process, _number: None)  # it would stop the tests

    async def listen() -> None:  # a driver belongs to a loop
        LastingDriver(TerminalApp[None]())

    asyncio.run(listen())
    signal.raise_signal(signal.SIGCONT)  # as a terminal that hangs up does
    assert went_on == []
    signal.raise_signal(signal.SIGTSTP)
    signal.raise_signal(signal.SIGCONT)
    signal.raise_signal(signal.SIGCONT)
    assert went_on == [True]


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
