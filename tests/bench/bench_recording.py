"""Recordings, written and read, beside the mcap package with protobuf objects in the same run."""

import itertools
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.frames import CameraImage, LidarScan, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.messages.schemas import schema_data
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter

INFO = SourceInfo("scene", "bench", 0)
JPEG_BYTES = 49_000
PERIOD_NS = 20_000_000


def drive(scans: int, images: bool) -> list[Received]:
    """A robot in a room, standing and turning: neighbouring scans resemble each other but for noise."""
    rng = np.random.default_rng(0)
    room_m = np.abs(rng.normal(0, 0.06, 541).cumsum()) + 1.0
    picture = rng.bytes(JPEG_BYTES)
    received = []
    for number in range(scans):
        stamp_ns = FAST_EPOCH_NS + number * PERIOD_NS
        ranges_m = np.round(np.roll(room_m, number // 4) + rng.normal(0, 0.011, 541), 3)
        ranges_m[rng.random(541) < 0.012] = 0.0
        received.append(Received(stamp_ns, LidarScan(stamp_ns, ranges_m)))
        if images:
            received.append(Received(stamp_ns, CameraImage(stamp_ns, picture)))
    return received


@dataclass(frozen=True)
class Best:
    """The best of some rounds: by the clock, and seconds of processor of all threads, which others do not disturb."""

    wall_s: float
    cpu_s: float

    def times(self, other: "Best") -> str:
        """How often as much the other takes, by the clock and of processor."""
        return f"{other.wall_s / self.wall_s:.1f} (cpu {other.cpu_s / self.cpu_s:.1f})"


def side_by_side(works: Mapping[str, Callable[[Path], object]], folder: Path, rounds: int = 7) -> dict[str, Best]:
    """The best of each, in turns, so that what else the machine does meets all; each gets a path of its own."""
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            path = folder / "side.mcap"
            path.unlink(missing_ok=True)
            begin_s, begin_cpu_s = time.perf_counter(), time.process_time()
            work(path)
            taken[name].append((time.perf_counter() - begin_s, time.process_time() - begin_cpu_s))
    return {name: Best(*map(min, zip(*rounds, strict=True))) for name, rounds in taken.items()}


def write_ours(path: Path, received: list[Received]) -> None:
    with RecordingWriter(path, INFO, "") as writer:
        for message in received:
            writer.write(message)


def write_by_mcap(path: Path, received: list[Received], compression: CompressionType) -> None:
    """The same messages as protobuf objects through the mcap package's writer, brought to the disk as ours are."""
    with path.open("wb") as file:
        writer = Writer(file, compression=compression)
        writer.start()
        channels = {}
        for topic, schema in (("/lidar/scan", "foxglove.LaserScan"), ("/camera/image", "foxglove.CompressedImage")):
            number = writer.register_schema(schema, "protobuf", schema_data(schema))
            channels[topic] = writer.register_channel(topic, "protobuf", number)
        for entry in received:
            source = entry.message
            if isinstance(source, LidarScan):
                topic, message = "/lidar/scan", LaserScan(frame_id="lidar", ranges=source.ranges_m)
                message.start_angle, message.end_angle = source.start_angle_rad, source.end_angle_rad
            else:
                assert isinstance(source, CameraImage)
                topic, message = "/camera/image", CompressedImage(frame_id="camera", data=source.data, format="jpeg")
            message.timestamp.seconds, message.timestamp.nanos = divmod(source.stamp_ns, 10**9)
            writer.add_message(channels[topic], entry.received_ns, message.SerializeToString(), source.stamp_ns)
        writer.finish()
        file.flush()
        os.fsync(file.fileno())


def read_by_mcap(path: Path, scans: int) -> np.ndarray:
    """Ranges by the mcap package and protobuf, into one array."""
    ranges_m = np.empty((scans, 541))
    with path.open("rb") as file:
        for row, (_, _, message) in enumerate(make_reader(file).iter_messages(topics=["/lidar/scan"])):
            ranges_m[row] = LaserScan.FromString(message.data).ranges
    return ranges_m


@pytest.mark.parametrize("images", [False, True], ids=["scans", "scans and images"])
def test_writing(benchmark: BenchmarkFixture, tmp_path: Path, images: bool) -> None:
    received = drive(1500, images)
    numbers = itertools.count()
    benchmark.pedantic(lambda: write_ours(tmp_path / f"ours_{next(numbers)}.mcap", received), rounds=3, warmup_rounds=1)
    if not benchmark.stats:
        return
    peers = {"none": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}
    works: dict[str, Callable[[Path], object]] = {"ours": lambda path: write_ours(path, received)}
    for name, kind in peers.items():
        works[name] = lambda path, kind=kind: write_by_mcap(path, received, kind)
    best = side_by_side(works, tmp_path)
    benchmark.extra_info |= {
        "messages_per_s": round(len(received) / best["ours"].wall_s),
        "bytes_per_scan": round((tmp_path / "ours_0.mcap").stat().st_size / 1500 - images * JPEG_BYTES),
        **{f"times_mcap_package_{name}": best["ours"].times(best[name]) for name in peers},
    }


@pytest.mark.parametrize("images", [False, True], ids=["scans", "scans and images"])
def test_reading_scans(benchmark: BenchmarkFixture, tmp_path: Path, images: bool) -> None:
    scans = 1500 if images else 6000
    path = tmp_path / "r.mcap"
    write_ours(path, drive(scans, images))
    with Recording.open(path) as recording:
        series = benchmark.pedantic(recording.scans, rounds=5, warmup_rounds=1)
        assert np.array_equal(series.ranges_m, read_by_mcap(path, scans))
        if not benchmark.stats:
            return
        works = {"ours": lambda _: recording.scans(), "peer": lambda _: read_by_mcap(path, scans)}
        best = side_by_side(works, tmp_path, 15)
    benchmark.extra_info |= {
        "scans_per_s": round(scans / best["ours"].wall_s),
        "times_mcap_package": best["ours"].times(best["peer"]),
    }


def test_opening(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    write_ours(path, drive(3000, images=True))

    def look() -> int:
        with Recording.open(path) as recording:
            return recording.topics["/lidar/scan"].count

    assert benchmark(look) == 3000
    benchmark.extra_info["megabytes"] = round(path.stat().st_size / 1e6)
