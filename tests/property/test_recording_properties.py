"""Codecs and files, whatever is put in."""

import math
import struct
import tempfile
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from google.protobuf.message import DecodeError
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sdt_tools.frames import (
    CameraCalibration,
    CameraImage,
    FrameTransform,
    Gesture,
    LidarScan,
    LogEntry,
    LogLevel,
    Message,
    Mode,
    MotionClass,
    MotionCommand,
    Odometry,
    OperatorPose,
    OperatorState,
    Pose2D,
    Received,
    Twist,
)
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.messages.codec import decode, encode
from sdt_tools.recording.messages.topics import topic_of
from sdt_tools.recording.messages.wire import decode_scan, varint
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.scan_kernel import find_ranges
from sdt_tools.recording.writer import RecordingWriter

stamps = st.integers(0, 2**62)
numbers = st.floats(allow_nan=False)
words = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
yaws = st.floats(-3.14159, 3.14159)
poses = st.builds(Pose2D, numbers, numbers, yaws)
ranges = hnp.arrays(np.float64, st.integers(0, 20), elements=st.floats(allow_nan=False, width=64))
kinds = {
    LidarScan: st.builds(LidarScan, stamps, ranges, numbers, numbers, words),
    CameraImage: st.builds(CameraImage, stamps, st.binary(max_size=300), words, words),
    CameraCalibration: st.builds(
        CameraCalibration, stamps, st.integers(0, 9999), st.integers(0, 9999), numbers, numbers, numbers, numbers, words
    ),
    FrameTransform: st.builds(
        FrameTransform, stamps, words, words, st.tuples(*[numbers] * 3), st.tuples(*[numbers] * 4)
    ),
    Odometry: st.builds(Odometry, stamps, poses, words),
    OperatorPose: st.builds(OperatorPose, stamps, poses, words),
    MotionCommand: st.builds(
        MotionCommand,
        stamps,
        st.sampled_from(MotionClass),
        st.builds(Twist, numbers, numbers),
        words,
        st.sampled_from(Mode),
        st.booleans(),
        st.none() | st.sampled_from(MotionClass),
    ),
    OperatorState: st.builds(OperatorState, stamps, st.sampled_from(Gesture), st.sampled_from(Mode), words),
    LogEntry: st.builds(LogEntry, stamps, st.sampled_from(LogLevel), words, words),
}
messages = st.one_of(*kinds.values())


def same(one: Message, other: Message) -> bool:
    """Equality to the bit, but for a yaw, which goes through sine and cosine."""
    if isinstance(one, LidarScan) and isinstance(other, LidarScan):
        ends = [(s.stamp_ns, s.start_angle_rad, s.end_angle_rad, s.frame_id) for s in (one, other)]
        return ends[0] == ends[1] and one.ranges_m.tobytes() == other.ranges_m.tobytes()
    if isinstance(one, Odometry | OperatorPose) and isinstance(other, Odometry | OperatorPose):
        places = [(p.stamp_ns, p.frame_id, p.pose.x_m, p.pose.y_m) for p in (one, other)]
        return places[0] == places[1] and math.isclose(one.pose.yaw_rad, other.pose.yaw_rad, abs_tol=1e-12)
    return one == other


@given(messages)
def test_every_message_comes_back(message: Message) -> None:
    topic = topic_of(message)
    assert same(decode(topic.name, topic.schema, encode(message), message.stamp_ns), message)


@given(kinds[LidarScan])
def test_a_scan_is_what_protobuf_would_write(scan: LidarScan) -> None:
    expected = LaserScan(frame_id=scan.frame_id, start_angle=scan.start_angle_rad, end_angle=scan.end_angle_rad)
    expected.timestamp.seconds, expected.timestamp.nanos = divmod(scan.stamp_ns, 10**9)
    expected.ranges.extend(scan.ranges_m)
    assert encode(scan) == expected.SerializeToString()


@given(kinds[CameraImage])
def test_an_image_is_what_protobuf_would_write(image: CameraImage) -> None:
    expected = CompressedImage(frame_id=image.frame_id, data=image.data, format=image.format)
    expected.timestamp.seconds, expected.timestamp.nanos = divmod(image.stamp_ns, 10**9)
    assert encode(image) == expected.SerializeToString()


@st.composite
def laser_scan_fields(draw: st.DrawFn) -> bytes:
    """Fields of a LaserScan in any order and layout, sometimes cut short."""
    doubles = st.floats(allow_nan=False).map(lambda value: struct.pack("<d", value))
    packed = st.lists(doubles, max_size=5).map(b"".join)
    prefixed = st.one_of(packed, st.binary(max_size=9)).map(lambda body: varint(len(body)) + body)
    field = st.one_of(
        packed.map(lambda body: b"\x32" + varint(len(body)) + body),
        doubles.map(lambda body: b"\x31" + body),
        doubles.map(lambda body: b"\x21" + body),
        doubles.map(lambda body: b"\x29" + body),
        packed.map(lambda body: b"\x3a" + varint(len(body)) + body),
        st.just(b"\x12\x05lidar"),
        prefixed.map(lambda body: b"\x7a" + body),
        st.integers(0, 2**40).map(lambda value: b"\x48" + varint(value)),
        st.binary(max_size=4),
    )
    data = b"".join(draw(st.lists(field, max_size=6)))
    return data[: draw(st.integers(0, len(data)))] if draw(st.booleans()) else data


def by_protobuf(data: bytes) -> bytes | None:
    try:
        return struct.pack(f"<{len(scan.ranges)}d", *scan.ranges) if (scan := LaserScan.FromString(data)) else b""
    except DecodeError:
        return None


@settings(max_examples=250, deadline=None)
@given(laser_scan_fields())
def test_ranges_are_found_where_protobuf_finds_them_and_nowhere_else(data: bytes) -> None:
    expected = by_protobuf(data)
    try:
        found: bytes | None = decode_scan(data).ranges_m.tobytes()
    except DecodeError:
        found = None
    assert expected is None or found == expected


@settings(max_examples=250, deadline=None)
@given(laser_scan_fields(), st.binary(max_size=9))
def test_compiled_code_finds_the_same_ranges_or_leaves_them_to_protobuf(data: bytes, around: bytes) -> None:
    buffer = np.frombuffer(around + data + around, np.uint8)
    offset, length = find_ranges(buffer, len(around), len(around) + len(data))
    expected = by_protobuf(data)
    if offset >= 0 and expected is not None:
        assert buffer[offset : offset + length].tobytes() == expected
        assert len(around) <= offset + length <= len(around) + len(data) or length == 0


received = st.builds(
    lambda delay, message: Received(message.stamp_ns + delay, message), st.integers(0, 10**9), messages
)


@settings(max_examples=60, deadline=None)
@given(st.lists(received, max_size=25), st.sampled_from([1, 200, 1 << 20]), st.floats(0, 1))
def test_a_recording_gives_back_what_was_written_and_a_cut_one_a_part_of_it(
    written: list[Received], chunk_bytes: int, cut: float
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "r.mcap"
        with RecordingWriter(path, SourceInfo("scene", "s", 1), "", chunk_bytes=chunk_bytes) as writer:
            for message in written:
                writer.write(message)
        with Recording.open(path) as recording:
            back = list(recording.messages())
        data = path.read_bytes()
        session_ends = data.index(b"config.toml")
        path.write_bytes(data[: session_ends + int(cut * (len(data) - session_ends))])
        with Recording.open(path) as recording:
            rest = list(recording.messages())
    assert [message.received_ns for message in back] == sorted(message.received_ns for message in written)
    assert is_part_of(back, written)
    assert is_part_of(rest, back)


def is_part_of(some: list[Received], others: list[Received]) -> bool:
    """Whether each of ``some`` is there among ``others``, as often."""
    left = list(others)
    for message in some:
        for place, other in enumerate(left):
            if message.received_ns == other.received_ns and same(message.message, other.message):
                del left[place]
                break
        else:
            return False
    return True
