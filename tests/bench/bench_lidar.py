"""The LiDAR's driver for minutes at 50 Hz: what is missed, how far its stamps are from the truth, what it costs.

``SDT_SOAK_S`` sets the seconds; without it, ten. The emulated device runs in a process of its own, with a clock that is
50 ppm too fast and up to 5 ms of delay, so that the processor time told is the driver's.
"""

import multiprocessing
import os
import resource
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

sys.path.append(str(Path(__file__).parents[1] / "unit" / "robot"))

from lidar_rig import Slope, rig

from sdt_tools.clock import HostClock
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.emulation.lms1xx.faults import Faults
from sdt_tools.frames import LidarScan, LogEntry, Received
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.driver import Lms1xx
from sdt_tools.robot.lms1xx.framing import Dialect, framed, splitter_for
from sdt_tools.robot.lms1xx.scan_telegram import ScanTelegram, read_scan, write_scan
from sdt_tools.robot.lms1xx.scans import ranges_m
from sdt_tools.robot.lms1xx.telegram import parse_telegram
from sdt_tools.robot.lms1xx.writing import writer_for

SECONDS = float(os.environ.get("SDT_SOAK_S", "10"))


def shared_clock() -> HostClock:
    """The machine's monotonic clock, which all processes share."""
    return HostClock(time.monotonic_ns, time.monotonic_ns)


def be_lidar(protocol: str, pipe: Connection) -> None:
    """Serve until told to end; then tell when each scan began."""
    truth_ns: list[int] = []
    faults = Faults(jitter_ms=5, drift_ppm=50)
    device = EmulatedConfig(port=0, protocol=protocol)
    clock = shared_clock()
    with EmulatedLms1xx(Slope(), device, faults, clock, lambda _, at_ns: truth_ns.append(at_ns)) as emulator:
        pipe.send(emulator.port)
        pipe.recv()
    pipe.send(truth_ns)


@pytest.mark.parametrize("protocol", ["a", "b"])
def test_a_soak(benchmark: BenchmarkFixture, protocol: str) -> None:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    device = context.Process(target=be_lidar, args=(protocol, theirs))
    device.start()
    clock = shared_clock()
    lidar = Lms1xx(Lms1xxConfig(host="127.0.0.1", port=ours.recv(), protocol=protocol), clock)
    stamps_ns: list[int] = []

    def soak() -> float:
        before = resource.getrusage(resource.RUSAGE_SELF)
        end_s = time.monotonic() + SECONDS
        while time.monotonic() < end_s:
            lidar.wait(0.1)
            messages = [received.message for received in lidar.read(clock.now_ns())]
            stamps_ns.extend(message.stamp_ns for message in messages if isinstance(message, LidarScan))
        after = resource.getrusage(resource.RUSAGE_SELF)
        return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / SECONDS

    core = benchmark.pedantic(soak, rounds=1)
    status = lidar.status
    lidar.close()
    ours.send("end")
    truth_ns = np.array(ours.recv())
    device.join()
    behind = np.clip(np.searchsorted(truth_ns, stamps_ns), 1, len(truth_ns) - 1)
    nearest = np.minimum(np.abs(truth_ns[behind] - stamps_ns), np.abs(truth_ns[behind - 1] - stamps_ns))
    benchmark.extra_info.update(
        scans=len(stamps_ns),
        missing=status.missing,
        damaged=status.damaged,
        drift_ppm=status.drift_ppm,
        worst_stamp_ms=float(nearest.max()) / 1e6,
        p99_stamp_ms=float(np.percentile(nearest, 99)) / 1e6,
        share_of_a_core=core,
    )


TROUBLES = 10


@pytest.mark.parametrize("trouble", ["silence", "cable", "power"])
def test_a_trouble_is_reported_and_got_over(benchmark: BenchmarkFixture, trouble: str) -> None:
    """How long after the last scan the log says so, and how long after the device is back scans come again."""
    reported_ms: list[float] = []
    back_ms: list[float] = []

    def suffer() -> None:
        with rig(EmulatedConfig(port=0, start_s=0.0)) as robot:
            for _ in range(TROUBLES):
                robot.more_scans(5)
                last_ns = robot.received[-1].received_ns
                robot.received.clear()
                start, end = TROUBLE[trouble]
                start(robot.emulator)
                robot.until(lambda: any("no scan" in line or "lost" in line for line in robot.log))
                scans = [one.received_ns for one in robot.received if isinstance(one.message, LidarScan)]
                words = next(one for one in robot.received if isinstance(one.message, LogEntry) and trouble_in(one))
                reported_ms.append((words.received_ns - max([last_ns, *scans])) / 1e6)
                robot.until(lambda: robot.lidar.age_s > 1.0)
                robot.received.clear()
                back_ns = robot.clock.now_ns()
                end(robot.emulator)
                robot.more_scans(1)
                first = next(one for one in robot.received if isinstance(one.message, LidarScan))
                back_ms.append((first.received_ns - back_ns) / 1e6)

    benchmark.pedantic(suffer, rounds=1)
    benchmark.extra_info.update(worst_report_ms=max(reported_ms), worst_back_ms=max(back_ms))


def trouble_in(received: Received) -> bool:
    assert isinstance(received.message, LogEntry)
    return "no scan" in received.message.text or "lost" in received.message.text


TROUBLE = {
    "silence": (lambda device: setattr(device, "silent", True), lambda device: setattr(device, "silent", False)),
    "cable": (lambda device: device.unplug(), lambda device: device.unplug(False)),
    "power": (lambda device: device.switch_off(), lambda device: device.switch_on()),
}


@pytest.mark.parametrize("dialect", Dialect, ids=lambda dialect: dialect.label)
def test_a_scan_is_read(benchmark: BenchmarkFixture, dialect: Dialect) -> None:
    frame = framed(dialect, body_of(dialect))

    def read() -> ScanTelegram:
        (body,) = splitter_for(dialect).feed(frame)
        scan = read_scan(parse_telegram(dialect, body).fields)
        ranges_m(scan.channels_16bit[0])
        return scan

    assert len(benchmark(read).channels_16bit[0].values) == 541


def body_of(dialect: Dialect) -> bytes:
    from sdt_tools.emulation.lms1xx.making import make_scan
    from sdt_tools.robot.lms1xx.settings import DataSettings, OutputRange, ScanSettings

    settings = ScanSettings(5000, 5000), DataSettings(), OutputRange(5000)
    fields = writer_for(dialect)
    write_scan(fields, make_scan(Slope().ranges_at(0), *settings, (0, 2_429), (1, 1)))
    return fields.body("sSN LMDscandata")
