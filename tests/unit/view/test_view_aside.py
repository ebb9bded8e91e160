"""A viewer that hangs beside a recording."""

import threading
import time
from dataclasses import dataclass, field

from sdt_tools.frames import LogEntry, LogLevel, Received
from sdt_tools.view.aside import Aside


@dataclass
class Screen:
    """Shows nothing before it goes on."""

    seen: list[int] = field(default_factory=list)
    goes_on: threading.Event = field(default_factory=threading.Event)
    closed: int = 0

    def observe(self, received: Received) -> None:
        self.goes_on.wait(30.0)
        self.seen.append(received.received_ns)

    def close(self) -> None:
        self.closed += 1


def entry(at_ns: int) -> Received:
    return Received(at_ns, LogEntry(at_ns, LogLevel.INFO, "here"))


def test_everything_is_shown_in_order_and_then_it_is_closed() -> None:
    screen = Screen()
    screen.goes_on.set()
    aside = Aside(screen)
    for number in range(100):
        aside.observe(entry(number))
    aside.close()
    aside.close()
    assert (screen.seen, screen.closed, aside.left_out) == (list(range(100)), 1, 0)


def test_a_screen_that_hangs_holds_up_neither_what_passes_nor_the_end() -> None:
    screen = Screen()
    aside = Aside(screen, waiting=10, close_s=0.05)
    for number in range(100):
        aside.observe(entry(number))
    aside.close()
    assert screen.seen == []
    assert 89 <= aside.left_out <= 90  # one may be on its way
    screen.goes_on.set()
    end_s = time.monotonic() + 30.0
    while not screen.closed:
        assert time.monotonic() < end_s
        time.sleep(0.005)
    assert len(screen.seen) == 100 - aside.left_out
