"""What a screen may know of what passes."""

import threading

import numpy as np
import pytest

from sdt_tools.frames import (
    RAYS,
    LidarScan,
    LogEntry,
    LogLevel,
    MotionClass,
    MotionCommand,
    Received,
    Twist,
)
from sdt_tools.protocols import Observer
from sdt_tools.teleop.watch import Watch

MS = 1_000_000


class Clock:
    now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


def scan(stamp_ns: int) -> Received:
    return Received(stamp_ns, LidarScan(stamp_ns, np.full(RAYS, 2.0)))


def test_it_keeps_the_newest_of_everything() -> None:
    watch = Watch()
    assert isinstance(watch, Observer)
    assert watch.view().scan is None
    watch.observe(scan(1))
    watch.observe(scan(2))
    command = MotionCommand(2, MotionClass.STAY, Twist(0.0, 0.0), "expert")
    watch.observe(Received(2, command))
    watch.close()
    view = watch.view()
    assert view.scan is not None
    assert (view.scan.stamp_ns, view.command, view.image) == (2, command, None)


def test_rates_are_those_of_the_last_two_seconds_and_ages_go_on() -> None:
    clock = Clock()
    watch = Watch(clock)
    for n in range(200):
        clock.now_ns = n * 20 * MS
        watch.observe(scan(n))
    streams = watch.view().streams
    assert streams is not None
    assert streams["/lidar/scan"].rate_hz == pytest.approx(50.0)
    assert streams["/lidar/scan"].age_s == 0.0
    clock.now_ns += 5000 * MS
    streams = watch.view().streams
    assert streams is not None
    assert (streams["/lidar/scan"].rate_hz, streams["/lidar/scan"].age_s) == (0.0, 5.0)


def test_the_log_is_kept_in_order_and_bounded() -> None:
    watch = Watch()
    for n in range(80):
        watch.observe(Received(n, LogEntry(n, LogLevel.INFO, f"line {n}")))
    entries = watch.view().entries
    assert len(entries) == 50
    assert (entries[0].text, entries[-1].text) == ("line 30", "line 79")


def test_it_may_be_read_while_it_is_written() -> None:
    watch = Watch()
    ended = threading.Event()

    def write() -> None:
        for n in range(3000):
            watch.observe(scan(n))
            watch.observe(Received(n, LogEntry(n, LogLevel.INFO, "x")))
        ended.set()

    writer = threading.Thread(target=write)
    writer.start()
    seen = [0]
    while not ended.is_set():
        view = watch.view()
        if view.scan is not None:
            seen.append(view.scan.stamp_ns)
    writer.join()
    assert seen == sorted(seen)
    assert watch.view().scan is not None
