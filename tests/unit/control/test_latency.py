"""Delays: their quantiles, their histogram, and who takes the time."""

import numpy as np
import pytest

from sdt_tools.clock import HostClock
from sdt_tools.control.latency import BINS_MS, Stopwatch, latency_of
from sdt_tools.frames import RAYS, LidarScan, MotionClass, MotionCommand, Received, Twist
from sdt_tools.recording.live.decide import STOP


class Wheels:
    """Takes three milliseconds to take a command."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.twists: list[Twist] = []

    def command(self, twist: Twist) -> None:
        self.now_ns += 3_000_000
        self.twists.append(twist)


def command(stamp_ns: int, driver: str = "policy") -> Received:
    return Received(stamp_ns, MotionCommand(stamp_ns, MotionClass.FORWARD, Twist(0.5, 0.0), driver))


def test_quantiles_and_histogram_of_the_numbers_from_1_to_101() -> None:
    latency = latency_of([number / 1000 for number in range(1, 102)])

    assert latency.count == sum(latency.histogram) == 101
    assert (latency.p50_ms, latency.p95_ms, latency.p99_ms) == pytest.approx((51, 96, 100))
    assert latency.max_ms == pytest.approx(101)
    assert dict(zip(BINS_MS, latency.histogram, strict=False)) == {
        0.0: 0,
        0.5: 0,
        1.0: 1,
        2.0: 1,
        3.0: 2,
        5.0: 3,
        7.5: 2,
        10.0: 5,
        15.0: 5,
        20.0: 10,
        30.0: 20,
        50.0: 50,
        100.0: 2,
    }


def test_without_delays_there_are_no_quantiles() -> None:
    assert latency_of([]).p99_ms is None


def test_a_delay_runs_from_the_scans_arrival_until_the_command_was_taken() -> None:
    wheels = Wheels()
    stopwatch = Stopwatch(wheels, HostClock(lambda: 0, lambda: wheels.now_ns))
    stopwatch.observe(Received(1_000_000, LidarScan(900_000, np.full(RAYS, 2.0))))
    wheels.now_ns = 5_000_000
    stopwatch.command(Twist(0.5, 0.0))
    stopwatch.observe(command(900_000))

    assert stopwatch.delays_s == [0.007]
    assert wheels.twists == [Twist(0.5, 0.0)]


def test_stops_are_no_decisions_on_a_scan() -> None:
    stopwatch = Stopwatch(Wheels(), None)
    stopwatch.observe(Received(0, LidarScan(5, np.full(RAYS, 2.0))))
    stopwatch.command(Twist(0.0, 0.0))
    stopwatch.observe(command(5, STOP))
    stopwatch.observe(command(4))

    assert stopwatch.delays_s == []
