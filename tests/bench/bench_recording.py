"""Recordings, written and read, beside the mcap package with protobuf objects in the same run."""

import itertools
import time
from collections.abc import Callable
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


def seconds_of(work: Callable[[], object], rounds: int = 3) -> float:
    """The best of some rounds."""
    best = float("inf")
    for _ in range(rounds):
        begin = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - begin)
    return best


def write_ours(path: Path, received: list[Received]) -> None:
    with RecordingWriter(path, INFO, "") as writer:
        for message in received:
            writer.write(message)


def write_by_mcap(path: Path, received: list[Received], compression: CompressionType) -> None:
    """The same messages as protobuf objects through the mcap package's writer."""
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
    peers = {"none": CompressionType.NONE, "lz4": CompressionType.LZ4}
    seconds = {
        name: seconds_of(lambda kind=kind: write_by_mcap(tmp_path / "peer.mcap", received, kind))
        for name, kind in peers.items()
    }
    ours_s = benchmark.stats.stats.min
    benchmark.extra_info |= {
        "messages_per_s": round(len(received) / ours_s),
        "bytes_per_scan": round((tmp_path / "ours_0.mcap").stat().st_size / 1500 - images * JPEG_BYTES),
        **{f"times_mcap_package_{name}": round(peer_s / ours_s, 1) for name, peer_s in seconds.items()},
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
    peer_s = seconds_of(lambda: read_by_mcap(path, scans))
    ours_s = benchmark.stats.stats.min
    benchmark.extra_info |= {
        "scans_per_s": round(scans / ours_s),
        "times_mcap_package": round(peer_s / ours_s, 1),
    }


def test_opening(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    write_ours(path, drive(3000, images=True))

    def look() -> int:
        with Recording.open(path) as recording:
            return recording.topics["/lidar/scan"].count

    assert benchmark(look) == 3000
    benchmark.extra_info["megabytes"] = round(path.stat().st_size / 1e6)
