"""A base and its driver on one machine, and patience."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from sdt_tools.emulation.p3at.faults import Fault
from sdt_tools.emulation.p3at.firmware import FACTORY
from sdt_tools.emulation.p3at.ports import Port, PtyPort, TcpPort
from sdt_tools.emulation.p3at.server import EmulatedP3at
from sdt_tools.frames import LogEntry, Odometry, Twist
from sdt_tools.robot.p3at.base import P3atBase
from sdt_tools.robot.p3at.config import P3atConfig

QUICK: Final = replace(FACTORY, cycle_ms=20)
"""A base that speaks five times as often as a real one: tests wait less."""
AHEAD: Final = Twist(0.4, 0.0)
REST: Final = Twist(0.0, 0.0)
PORTS: Final[dict[str, Callable[[], Port]]] = {"tcp": lambda: TcpPort("127.0.0.1", 0), "serial": PtyPort}
_PATIENCE_S: Final = 8.0


def wait_for(condition: Callable[[], bool], within_s: float = _PATIENCE_S) -> bool:
    until_s = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > until_s:
            return False
        time.sleep(0.005)
    return True


class Pair:
    """An emulated base, the driver that talks to it, and all that it has told."""

    def __init__(self, emulated: EmulatedP3at, base: P3atBase) -> None:
        self.emulated = emulated
        self.base = base
        self.poses: list[Odometry] = []
        self._texts: list[str] = []

    @property
    def texts(self) -> list[str]:
        """Every log entry so far."""
        for received in self.base.read(1 << 62):
            if isinstance(message := getattr(received, "message", None), LogEntry):
                self._texts.append(message.text)
            elif isinstance(message, Odometry):
                self.poses.append(message)
        return self._texts

    @property
    def stands(self) -> bool:
        return self.emulated.report.velocity == REST

    def told(self, words: str) -> bool:
        """Whether ``words`` were told, or are within patience."""
        return wait_for(lambda: any(words in text for text in self.texts))

    def drives_on(self, for_s: float = 0.3) -> bool:
        """Whether the base moves within ``for_s`` although nothing is commanded."""
        return wait_for(lambda: not self.stands, for_s)

    def drive(self, twist: Twist = AHEAD) -> bool:
        """Command until the base moves."""
        return self.keep_driving_until(lambda: not self.stands, twist)

    def keep_driving_until(self, condition: Callable[[], bool], twist: Twist = AHEAD) -> bool:
        """Command again and again until ``condition``, or patience is at an end."""

        def step() -> bool:
            self.base.command(twist)
            return condition()

        return wait_for(step)


@contextmanager
def driven(port: str = "tcp", *planned: Fault, **config: object) -> Iterator[Pair]:
    """A base on ``port`` with its driver; silence is noticed after 0.15 s, speeds change quickly.

    Its first status has come: where it was then is the origin.
    """
    settings = {"silent_s": 0.15, "connect_s": 3.0, "accelerate_mps2": 5.0, "brake_mps2": 5.0, **config}
    with (
        EmulatedP3at(PORTS[port](), planned, settings=QUICK) as emulated,
        P3atBase(P3atConfig(address=emulated.address, **settings)) as base,  # type: ignore[arg-type]
    ):
        assert wait_for(lambda: base.status is not None)
        yield Pair(emulated, base)
