"""Small recordings for tests, and readings of them by others' code."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.frames import (
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
    RawPicture,
    Received,
    Twist,
)
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter

T0 = FAST_EPOCH_NS
PERIOD_NS = 20_000_000
INFO = SourceInfo("scene", "plain", 7, {"lidar": "simulated SICK LMS1xx"})
CONFIG = "answer = 42\n"


def scan(number: int, rays: int = 541, delay_ns: int = 0) -> Received:
    """Scan ``number``: quantised to millimetres, with invalid codes, received ``delay_ns`` after it was taken."""
    rng = np.random.default_rng(number)
    ranges_m = np.round(rng.uniform(0.05, 20.0, rays), 3)
    ranges_m[:: 1 + number % 50] = (0.0, 0.002, 0.003)[number % 3]
    stamp_ns = T0 + number * PERIOD_NS
    return Received(stamp_ns + delay_ns, LidarScan(stamp_ns, ranges_m))


def image(number: int, size: int = 3000) -> Received:
    """Image ``number``: bytes that do not compress, in the place of a JPEG."""
    stamp_ns = T0 + number * 33_333_333
    return Received(stamp_ns, CameraImage(stamp_ns, np.random.default_rng(number).bytes(size)))


def raw_picture(number: int) -> RawPicture:
    """Image ``number`` as a camera gives it."""
    stamp_ns = T0 + number * 33_333_333
    return RawPicture(stamp_ns, stamp_ns, np.full((12, 16, 3), number * 10 % 256, np.uint8))


def one_of_each(stamp_ns: int = T0) -> list[Received]:
    """A message of each kind."""
    messages = [
        FrameTransform(stamp_ns, "base_link", "lidar", (0.197, 0.0, 0.35), (0.0, 0.0, 0.0, 1.0)),
        CameraCalibration(stamp_ns, 640, 480, 500.0, 501.0, 319.5, 239.5),
        scan(0).message,
        CameraImage(stamp_ns, b"\xff\xd8not really a picture\xff\xd9"),
        Odometry(stamp_ns, Pose2D(1.5, -2.0, 0.25)),
        OperatorPose(stamp_ns, Pose2D(3.0, 0.5, -3.0)),
        OperatorState(stamp_ns, Gesture.DISABLE, Mode.ACTIVE, "phone_call"),
        MotionCommand(stamp_ns, MotionClass.LEFT_BACKWARD, Twist(-0.25, 0.9), "expert", expert=MotionClass.STAY),
        LogEntry(stamp_ns, LogLevel.WARNING, "a gap", "lidar"),
    ]
    return [Received(stamp_ns + 1000 + place, message) for place, message in enumerate(messages)]


def write(path: Path, messages: Iterable[Received], **options: Any) -> Path:
    """Write ``messages`` with our writer."""
    with RecordingWriter(path, INFO, CONFIG, **options) as writer:
        for received in messages:
            writer.write(received)
    return path


def parsed(schema: Schema, data: bytes) -> Any:
    """``data`` by protobuf alone, with the schema as it stands in the file."""
    pool = descriptor_pool.DescriptorPool()
    for file in FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString(data)


def read_by_mcap(path: Path) -> list[tuple[Schema, Channel, Message]]:
    """Everything in ``path`` as the mcap package reads it, checksums compared."""
    with path.open("rb") as file:
        return [
            (schema, channel, message)
            for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages()
            if schema is not None
        ]
