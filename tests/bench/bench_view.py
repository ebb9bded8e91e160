"""A minute of scans, images and predictions into one .rrd; beside it scans and images alone, logged one by one."""

from collections.abc import Iterator
from itertools import count
from pathlib import Path
from time import perf_counter

import numpy as np
import polars as pl
import pytest
import rerun as rr
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.frames import CameraImage, LidarScan, Odometry, OperatorPose, Pose2D, Received, ray_angles_rad
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter
from sdt_tools.view.log import write_rrd

SECONDS, SCAN_HZ, IMAGE_HZ, IMAGE_BYTES = 60, 50, 30, 50_000


def minute() -> Iterator[Received]:
    rng = np.random.default_rng(0)
    picture = rng.bytes(IMAGE_BYTES)  # JPEG hardly compresses either; nothing here decodes it
    stamps = [(FAST_EPOCH_NS + k * 1_000_000_000 // SCAN_HZ, "scan") for k in range(SECONDS * SCAN_HZ)]
    stamps += [(FAST_EPOCH_NS + k * 1_000_000_000 // IMAGE_HZ, "image") for k in range(SECONDS * IMAGE_HZ)]
    for stamp_ns, kind in sorted(stamps):
        if kind == "image":
            yield Received(stamp_ns, CameraImage(stamp_ns, picture))
            continue
        yield Received(stamp_ns, LidarScan(stamp_ns, rng.uniform(0.5, 8.0, 541)))
        yield Received(stamp_ns, Odometry(stamp_ns, Pose2D(0.0, 0.0, 0.0)))
        yield Received(stamp_ns, OperatorPose(stamp_ns, Pose2D(1.0, 0.0, 0.0)))


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("view") / "minute.mcap"
    with RecordingWriter(path, SourceInfo("scene"), "") as writer:
        for received in minute():
            writer.write(received)
    return path


def predictions(recording: Path) -> pl.DataFrame:
    with Recording.open(recording) as source:
        stamps_ns, recording_id = source.scans().stamps_ns, source.recording_id
    label = ["forward" if k % 5 == 0 else None for k in range(len(stamps_ns))]
    predicted = ["stay" if k % 100 < 10 else "forward" for k in range(len(stamps_ns))]
    frame = pl.DataFrame({"stamp_ns": stamps_ns, "label": label, "predicted": predicted, "loss_ce": 0.5})
    return frame.with_columns(pl.lit(recording_id).alias("recording_id"), pl.lit("m").alias("model"))


def row_by_row(recording: Path, out: Path) -> None:
    """The scans of a recording as points and its images, a call each."""
    angles = ray_angles_rad()
    c, s = np.cos(angles), np.sin(angles)
    stream = rr.RecordingStream("rows", recording_id="rows")
    stream.save(out)
    with Recording.open(recording) as source:
        for received in source.messages([LIDAR_SCAN, CAMERA_IMAGE]):
            message = received.message
            stream.set_time("time", timestamp=np.datetime64(message.stamp_ns, "ns"))
            if isinstance(message, LidarScan):
                points = np.column_stack([-message.ranges_m * s, -message.ranges_m * c])
                stream.log("scan/points", rr.Points2D(points))
            elif isinstance(message, CameraImage):
                stream.log("camera/image", rr.EncodedImage(contents=message.data, media_type="image/jpeg"))
    stream.disconnect()


def test_a_minute_is_written(benchmark: BenchmarkFixture, recording: Path, tmp_path: Path) -> None:
    numbers = count()
    known = [predictions(recording)]

    def write() -> None:
        write_rrd(recording, tmp_path / f"{next(numbers)}.rrd", predictions=known)

    benchmark.pedantic(write, rounds=3, iterations=1, warmup_rounds=1)
    started = perf_counter()
    row_by_row(recording, tmp_path / "rows.rrd")
    benchmark.extra_info["scans_and_images_row_by_row_s"] = round(perf_counter() - started, 2)
