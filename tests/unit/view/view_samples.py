"""A drive whose every number is known in closed form, and ways to read an .rrd back without our writer."""

import math
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import polars as pl
from rerun.chunk import RrdReader

from sdt_tools.config import MotionConfig
from sdt_tools.frames import (
    LIDAR_AHEAD_M,
    CameraCalibration,
    CameraImage,
    FrameTransform,
    Gesture,
    LidarScan,
    LogEntry,
    LogLevel,
    Mode,
    MotionClass,
    MotionCommand,
    Odometry,
    OperatorPose,
    OperatorState,
    Pose2D,
    Received,
    ray_angles_rad,
)
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter

START_NS = 1_700_000_000_123_456_789
SCAN_NS = 20_000_000
SCANS = 100
LEFT_M, RIGHT_M, AHEAD_M = 2.0, 3.0, 4.0
"""Walls of the room, from the LiDAR; behind it the room is open."""
CODED_RAYS = slice(0, 10)
ROBOT = Pose2D(1.0, 2.0, math.pi / 2)
OPERATOR = Pose2D(1.0, 2.0 + LIDAR_AHEAD_M + 1.5, -math.pi / 2)
"""He stands 1.5 m ahead of the LiDAR and looks at it."""
MAGENTA_BGR = (200, 30, 220)


def scan_ns(number: int) -> int:
    return START_NS + number * SCAN_NS


def room_ranges_m() -> np.ndarray:
    angles = ray_angles_rad()
    c, s = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):
        to_ahead = np.where(c > 1e-9, AHEAD_M / c, np.inf)
        to_side = np.where(s > 1e-9, LEFT_M / s, np.where(s < -1e-9, -RIGHT_M / s, np.inf))
    ranges_m = np.minimum(np.minimum(to_ahead, to_side), 20.0)
    ranges_m[CODED_RAYS] = (0.0, 0.002, 0.003, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return ranges_m


def jpeg() -> bytes:
    picture = np.full((480, 640, 3), MAGENTA_BGR, np.uint8)
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()


def messages(camera: bool = True, truth: bool = True) -> Iterator[Received]:
    """Two seconds: scans at 50 Hz, images and decisions at 10 Hz; ``stay`` in the first second, ``forward`` after."""
    motions, picture, ranges_m = MotionConfig(), jpeg(), room_ranges_m()
    introduction = [
        FrameTransform(START_NS, "base_link", "lidar", (LIDAR_AHEAD_M, 0.0, 0.35), (0.0, 0.0, 0.0, 1.0)),
        CameraCalibration(START_NS, 640, 480, 500.0, 500.0, 320.0, 240.0),
        LogEntry(START_NS, LogLevel.WARNING, "a mark"),
    ]
    yield from (Received(START_NS, message) for message in introduction)
    for number in range(SCANS):
        now_ns = scan_ns(number)
        news: list = [LidarScan(now_ns, ranges_m)]
        if truth:
            news += [Odometry(now_ns, ROBOT), OperatorPose(now_ns, OPERATOR)]
        if number % 5 == 0:
            motion = label_of(number)
            news.append(MotionCommand(now_ns, motion, motions.twist(motion), "expert", Mode.ACTIVE, expert=motion))
            if camera:
                news.append(CameraImage(now_ns + 1, picture))
            if truth:
                gesture = Gesture.ENABLE if number < 50 else Gesture.IDLE
                news.append(OperatorState(now_ns, gesture, Mode.ACTIVE))
        yield from (Received(message.stamp_ns, message) for message in news)


def label_of(number: int) -> MotionClass:
    return MotionClass.STAY if number < 50 else MotionClass.FORWARD


def write_recording(path: Path, camera: bool = True, truth: bool = True) -> str:
    """Write the drive; returns its id."""
    with RecordingWriter(path, SourceInfo("scene", "room", 0), "") as writer:
        for message in messages(camera, truth):
            writer.write(message)
        return writer.recording_id


def labels() -> pl.DataFrame:
    numbers = range(0, SCANS, 5)
    return pl.DataFrame(
        {
            "stamp_ns": [scan_ns(number) for number in numbers],
            "label": [label_of(number).label for number in numbers],
            "source": "truth",
        }
    )


def predictions(recording_id: str, model: str = "follow-0", wrong: range = range(60, 71)) -> pl.DataFrame:
    """Right but for the frames ``wrong``, on which the model says ``backward``; labelled as ``labels`` are."""
    numbers = range(SCANS)
    label = [label_of(number).label if number % 5 == 0 else None for number in numbers]
    predicted = ["backward" if number in wrong else label_of(number).label for number in numbers]
    loss = [None if name is None else 2.5 if number in wrong else 0.25 for number, name in enumerate(label)]
    return pl.DataFrame(
        {
            "recording_id": recording_id,
            "model": model,
            "stamp_ns": [scan_ns(number) for number in numbers],
            "label": pl.Series(label, dtype=pl.String),
            "predicted": predicted,
            "loss_ce": pl.Series(loss, dtype=pl.Float32),
        }
    )


def tags(recording_id: str, tag: str, model: str = "follow-0", wrong: range = range(60, 71)) -> pl.DataFrame:
    numbers = range(0, SCANS, 5)
    return pl.DataFrame(
        {
            "recording_id": recording_id,
            "model": model,
            "stamp_ns": [scan_ns(number) for number in numbers],
            "tag": [tag if number in wrong else "correct" for number in numbers],
        }
    )


def rows(rrd: Path, entity: str, component: str, static: bool = False) -> list[tuple[int, int, list]]:
    """(time in ns, frame, values) of each row of a component, in order; for static ones time and frame are 0."""
    found = []
    for chunk in RrdReader(rrd).stream().to_chunks():
        if chunk.entity_path != f"/{entity}" or chunk.is_static != static:
            continue
        batch = chunk.to_record_batch()
        if component not in batch.schema.names or (not static and "time" not in batch.schema.names):
            continue
        values = batch.column(component).to_pylist()
        times = [0] * len(values) if static else batch.column("time").cast("int64").to_pylist()
        frames = [0] * len(values) if static else batch.column("frame").to_pylist()
        found += zip(times, frames, values, strict=True)
    return sorted(found, key=lambda row: row[:2])


def at_errors(rrd: Path, entity: str, component: str) -> list[tuple[int, list]]:
    """(number of the error, values) of each row of a component on the timeline that steps through errors, in order."""
    found = []
    for chunk in RrdReader(rrd).stream().to_chunks():
        batch = chunk.to_record_batch()
        if chunk.entity_path == f"/{entity}" and {component, "error"} <= set(batch.schema.names):
            found += zip(batch.column("error").to_pylist(), batch.column(component).to_pylist(), strict=True)
    return sorted(found, key=lambda row: row[0])


def entities_of(rrd: Path) -> set[str]:
    return {chunk.entity_path for chunk in RrdReader(rrd).stream().to_chunks()}
