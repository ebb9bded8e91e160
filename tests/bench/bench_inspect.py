"""Inspection of a closed recording, which reads no message, and what gathering its numbers costs while recording."""

from pathlib import Path
from time import perf_counter

import numpy as np
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.frames import CameraImage, LidarScan, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.inspect import inspect_recording
from sdt_tools.recording.timing.stamps import StampLog
from sdt_tools.recording.timing.summary import timing_of
from sdt_tools.recording.writer import RecordingWriter

IMAGE_PERIOD_NS = 33_333_333
SCAN_PERIOD_NS = 20_000_000


def record(path: Path, megabytes: int) -> None:
    """Images of 49 kB and scans, so many megabytes of them."""
    rng = np.random.default_rng(0)
    picture, ranges_m = rng.bytes(49_000), np.round(rng.uniform(0.1, 20.0, 541), 3)
    with RecordingWriter(path, SourceInfo("scene", "bench", 0), "") as writer:
        for number in range(megabytes * 1_000_000 // 50_000):
            stamp_ns = FAST_EPOCH_NS + number * IMAGE_PERIOD_NS
            writer.write(Received(stamp_ns, LidarScan(stamp_ns, ranges_m)))
            writer.write(Received(stamp_ns, CameraImage(stamp_ns, picture)))


def test_inspecting_a_closed_gigabyte(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    record(path, 1000 if benchmark.enabled else 20)
    report = benchmark.pedantic(inspect_recording, (path,), rounds=5, warmup_rounds=1)
    assert not report.counted
    if benchmark.stats:
        begin = perf_counter()
        assert inspect_recording(path, full=True).disagreements == ()
        benchmark.extra_info |= {
            "megabytes": round(path.stat().st_size / 1e6),
            "seconds_full": round(perf_counter() - begin, 2),
        }


def test_gathering_times(benchmark: BenchmarkFixture) -> None:
    log = StampLog()

    def see() -> None:
        for stamp_ns in range(FAST_EPOCH_NS, FAST_EPOCH_NS + 10_000 * SCAN_PERIOD_NS, SCAN_PERIOD_NS):
            log.see("/lidar/scan", stamp_ns, stamp_ns)

    benchmark.pedantic(see, rounds=5)
    if benchmark.stats:
        benchmark.extra_info["ns_a_message"] = round(benchmark.stats.stats.min / 10_000 * 1e9)


def test_the_numbers_of_an_hour(benchmark: BenchmarkFixture) -> None:
    seconds = 3600 if benchmark.enabled else 10
    log = StampLog()
    for topic, period_ns in (("/lidar/scan", SCAN_PERIOD_NS), ("/camera/image", IMAGE_PERIOD_NS)):
        for number in range(seconds * 1_000_000_000 // period_ns):
            log.see(topic, FAST_EPOCH_NS + number * period_ns + 5_000_000, FAST_EPOCH_NS + number * period_ns)
    timing = benchmark.pedantic(timing_of, (log,), rounds=3)
    assert timing.pairs.unpaired == 0
