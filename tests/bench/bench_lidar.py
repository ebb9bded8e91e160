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

from lidar_rig import Slope

from sdt_tools.clock import HostClock
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.emulation.lms1xx.faults import Faults
from sdt_tools.frames import LidarScan
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
