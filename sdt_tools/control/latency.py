"""How long it takes from a scan to the command that is decided on it."""

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.frames import LidarScan, MotionCommand, Received, Twist
from sdt_tools.protocols import Actuator
from sdt_tools.recording.live.decide import STOP

BINS_MS: Final = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 7.5, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, float("inf"))
"""Bounds of the histogram: each bin holds what is at least its lower bound and less than its upper one."""


@dataclass(frozen=True)
class Latency:
    """Quantiles in milliseconds of ``count`` delays, and how many fall between each two of ``BINS_MS``."""

    count: int
    p50_ms: float | None
    p95_ms: float | None
    p99_ms: float | None
    max_ms: float | None
    histogram: tuple[int, ...]


def latency_of(delays_s: Sequence[float]) -> Latency:
    """Quantiles (linear between neighbours) and histogram; without any delay, None."""
    delays_ms = np.asarray(delays_s, np.float64) * 1e3
    counts = np.histogram(delays_ms, np.array(BINS_MS))[0].tolist()
    if not len(delays_ms):
        return Latency(0, None, None, None, None, tuple(counts))
    p50_ms, p95_ms, p99_ms, max_ms = np.quantile(delays_ms, [0.5, 0.95, 0.99, 1.0]).tolist()
    return Latency(len(delays_ms), p50_ms, p95_ms, p99_ms, max_ms, tuple(counts))


class WireTimes:
    """When commands were given and when they were on the wire, as the actuator tells, by the host's clock."""

    def __init__(self) -> None:
        self._sent: deque[tuple[int, int]] = deque()

    def note(self, commanded_ns: int, sent_ns: int) -> None:
        """The command of ``commanded_ns`` was on the wire. May be called from any thread."""
        self._sent.append((commanded_ns, sent_ns))

    def sent_ns(self, begun_ns: int, done_ns: int) -> int | None:
        """When what was commanded between these moments was sent; None if it was not, or not yet.

        Questions come in the order of time: what was commanded before is forgotten.
        """
        while self._sent and self._sent[0][0] < begun_ns:
            self._sent.popleft()
        if not self._sent or self._sent[0][0] > done_ns:
            return None
        return self._sent[0][1]


class Stopwatch:
    """Stands before an actuator, and sees what passes. Implements Actuator and Observer.

    A command's delay runs from when the scan that it was decided on was received, by ``clock``, until it was on the
    ``wire``, or without one until the actuator has taken it; a command that never was on the wire has none. Without a
    clock, in a scene, it runs from when the scan was seen.
    """

    def __init__(self, actuator: Actuator, clock: HostClock | None, wire: WireTimes | None = None) -> None:
        self._delays_s: list[float] = []
        self._on_their_way: deque[tuple[int, int, int]] = deque()
        """Commands of which it is not known yet when they were sent: begun, done, and when their scan was received."""
        self._actuator = actuator
        self._clock = clock
        self._wire = wire
        self._scan: tuple[int, int] | None = None
        self._begun_ns = self._commanded_ns = 0

    @property
    def delays_s(self) -> list[float]:
        """Those that are known by now."""
        self._look_at_the_wire()
        return self._delays_s

    def command(self, twist: Twist) -> None:
        """Hand on, and note when that was done."""
        self._begun_ns = self._now_ns()
        self._actuator.command(twist)
        self._commanded_ns = self._now_ns()

    def observe(self, received: Received) -> None:
        """Note when a scan came; with the command that was decided on it, how long that took."""
        message = received.message
        if isinstance(message, LidarScan):
            self._scan = (message.stamp_ns, self._now_ns() if self._clock is None else received.received_ns)
        elif isinstance(message, MotionCommand) and self._scan is not None:
            stamp_ns, received_ns = self._scan
            if message.stamp_ns == stamp_ns and message.driver != STOP:
                if self._wire is None:
                    self._delays_s.append((self._commanded_ns - received_ns) / SECOND_NS)
                    return
                self._look_at_the_wire()
                self._on_their_way.append((self._begun_ns, self._commanded_ns, received_ns))

    def close(self) -> None:
        """Nothing is open."""

    def _look_at_the_wire(self) -> None:
        while self._wire is not None and self._on_their_way:
            begun_ns, done_ns, received_ns = self._on_their_way.popleft()
            sent_ns = self._wire.sent_ns(begun_ns, done_ns)
            if sent_ns is not None:
                self._delays_s.append((sent_ns - received_ns) / SECOND_NS)

    def _now_ns(self) -> int:
        return time.perf_counter_ns() if self._clock is None else self._clock.now_ns()
