"""The base stands, whatever becomes of the program that drives it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from sdt_tools.emulation.p3at.firmware import FACTORY
from sdt_tools.emulation.p3at.ports import PtyPort, TcpPort
from sdt_tools.emulation.p3at.server import EmulatedP3at

CHILD = Path(__file__).with_name("base_rig_child.py")
SOON_S = 1.0
"""Below the base's own watchdog of two seconds, so that it is the program that has stopped it."""


@contextmanager
def driving(emulated: EmulatedP3at, ends: str) -> Iterator[subprocess.Popen[str]]:
    """A program that drives the base at full speed."""
    command = [sys.executable, str(CHILD), emulated.address, ends]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=os.environ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "drives\n"
        assert waited_s(lambda: emulated.report.velocity.linear_mps == pytest.approx(0.5)) < 5
        yield child
        child.kill()


def waited_s(condition: Callable[[], bool], within_s: float = 5.0) -> float:
    """Seconds until ``condition``."""
    begin_s = time.monotonic()
    while not condition() and time.monotonic() - begin_s < within_s:
        time.sleep(0.002)
    return time.monotonic() - begin_s


def stood_after_s(emulated: EmulatedP3at) -> float:
    return waited_s(lambda: emulated.report.velocity.linear_mps == 0.0)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_it(number: signal.Signals) -> None:
    with EmulatedP3at(TcpPort("127.0.0.1", 0)) as emulated, driving(emulated, "signal") as child:
        child.send_signal(number)
        assert stood_after_s(emulated) < SOON_S
        assert emulated.report.watchdog_stops == 0
        assert child.wait(5) == 0


@pytest.mark.parametrize("ends", ["exception", "exit"])
def test_a_program_that_ends_stops_it(ends: str) -> None:
    with EmulatedP3at(PtyPort()) as emulated, driving(emulated, ends) as child:
        assert child.stdin is not None
        child.stdin.write("\n")
        child.stdin.flush()
        assert stood_after_s(emulated) < SOON_S
        assert emulated.report.watchdog_stops == 0
        assert not emulated.report.motors_on


@pytest.mark.parametrize("make_port", [lambda: TcpPort("127.0.0.1", 0), PtyPort], ids=["tcp", "serial"])
def test_a_program_that_is_killed_leaves_it_to_the_watchdog(make_port: Callable[[], TcpPort | PtyPort]) -> None:
    settings = replace(FACTORY, watchdog_ms=600)
    with EmulatedP3at(make_port(), settings=settings) as emulated, driving(emulated, "kill") as child:
        child.kill()
        child.wait()
        assert waited_s(lambda: emulated.report.watchdog_stops == 1) < 2 * 0.6
        assert stood_after_s(emulated) < 0.5 / 0.8 + SOON_S  # it brakes with 0.8 m/s²
