"""How long it takes from a scan to the command that is decided on it."""

import time
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


class Stopwatch:
    """Stands before an actuator, and sees what passes. Implements Actuator and Observer.

    A command's delay runs from when the scan that it was decided on was received, by ``clock``, until the actuator has
    taken the command. Without a clock, in a scene, it runs from when the scan was seen.
    """

    def __init__(self, actuator: Actuator, clock: HostClock | None) -> None:
        self.delays_s: list[float] = []
        self._actuator = actuator
        self._clock = clock
        self._scan: tuple[int, int] | None = None
        self._commanded_ns = 0

    def command(self, twist: Twist) -> None:
        """Hand on, and note when that was done."""
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
                self.delays_s.append((self._commanded_ns - received_ns) / SECOND_NS)

    def close(self) -> None:
        """Nothing is open."""

    def _now_ns(self) -> int:
        return time.perf_counter_ns() if self._clock is None else self._clock.now_ns()
