"""Recordings of gigabytes: the memory that reading takes, and how soon one is inspected."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.frames import CameraImage, LidarScan, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.inspect import inspect_recording
from sdt_tools.recording.writer import RecordingWriter

JPEG_BYTES = 100_000
PERIOD_NS = 20_000_000
MOST_MB = 300
SMALL_BYTES = 20_000_000
"""What stands for the gigabytes where nothing is measured."""

READ = """
import json, sys
from pathlib import Path
from sdt_tools.recording.reader import Recording

def anonymous_mb():
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("RssAnon"))
    return int(line.split()[1]) / 1024

scans = messages = most_mb = 0
with Recording.open(Path(sys.argv[1])) as recording:
    for batch in recording.scan_batches():
        scans += len(batch)
        most_mb = max(most_mb, anonymous_mb())
    for message in recording.messages():
        messages += 1
        if messages % 100 == 0:
            most_mb = max(most_mb, anonymous_mb())
print(json.dumps([scans, messages, round(most_mb)]))
"""


def drive(size_bytes: int) -> Iterator[Received]:
    """Scans and pictures that do not compress, until they make so many bytes."""
    rng = np.random.default_rng(0)
    noise = np.frombuffer(rng.bytes(4 << 20), np.uint8)
    for number in range(size_bytes // (JPEG_BYTES + 1500)):
        stamp_ns = FAST_EPOCH_NS + number * PERIOD_NS
        ranges_m = np.round(rng.uniform(0.1, 20.0, 541), 3)
        start = number * 7919 % (noise.size - JPEG_BYTES)
        yield Received(stamp_ns, LidarScan(stamp_ns, ranges_m))
        yield Received(stamp_ns, CameraImage(stamp_ns, noise[start : start + JPEG_BYTES].tobytes()))


@pytest.fixture
def large(tmp_path: Path, benchmark: BenchmarkFixture, request: pytest.FixtureRequest) -> Iterator[tuple[Path, int]]:
    """A recording of so many bytes, removed afterwards; and the number of its messages."""
    path = tmp_path / "large.mcap"
    with RecordingWriter(path, SourceInfo("scene", "bench", 0), "") as writer:
        for received in drive(request.param if benchmark.enabled else SMALL_BYTES):
            writer.write(received)
    yield path, writer.counts.total()
    path.unlink()


@pytest.mark.parametrize("large", [2 << 30], indirect=True, ids=["2 GB"])
def test_reading_takes_little_memory(benchmark: BenchmarkFixture, large: tuple[Path, int]) -> None:
    path, messages = large
    command = [sys.executable, "-c", READ, str(path)]
    ran = benchmark.pedantic(subprocess.run, (command,), {"capture_output": True, "check": True}, rounds=1)
    scans, read, most_mb = json.loads(ran.stdout)
    assert (scans, read) == (messages // 2, messages)
    assert most_mb < MOST_MB
    benchmark.extra_info |= {"anonymous_mb": most_mb, "file_mb": round(path.stat().st_size / 1e6)}


@pytest.mark.parametrize("large", [1 << 30], indirect=True, ids=["1 GB"])
def test_inspecting_is_instant(benchmark: BenchmarkFixture, large: tuple[Path, int]) -> None:
    path, messages = large
    report = benchmark.pedantic(inspect_recording, (path,), rounds=3)
    assert report.messages == messages
    if not benchmark.stats:
        return
    assert benchmark.stats.stats.max <= 1.0
    benchmark.extra_info["file_mb"] = round(path.stat().st_size / 1e6)
