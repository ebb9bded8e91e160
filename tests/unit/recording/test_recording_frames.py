"""Frames by number, against the reader that streams."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sdt_tools.errors import RecordingError
from sdt_tools.frames import RAYS, CameraImage, LidarScan, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter

START_NS = 1_735_689_600_000_000_000
STEP_NS = 20_000_000


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """300 scans and 150 pictures in chunks of about ten, received late by more or less."""
    path, rng = tmp_path / "drive.mcap", np.random.default_rng(0)
    with RecordingWriter(path, SourceInfo("scene", "plain", 1), "", chunk_bytes=40_000) as writer:
        for number in range(300):
            stamp_ns = START_NS + number * STEP_NS
            scan = LidarScan(stamp_ns, np.round(rng.uniform(0.1, 5.0, RAYS), 3))
            writer.write(Received(stamp_ns + int(rng.integers(1, 60_000_000)), scan))
            if number % 2:
                image = CameraImage(stamp_ns + 5, rng.bytes(4_000))
                writer.write(Received(stamp_ns + int(rng.integers(1, 60_000_000)), image))
    return path


def streamed(path: Path, topic: str) -> dict[int, Received]:
    with Recording.open(path) as recording:
        return {received.message.stamp_ns: received for received in recording.messages([topic])}


def equal(one: Received, other: Received) -> bool:
    return repr(one) == repr(other) and (
        not isinstance(one.message, LidarScan) or np.array_equal(one.message.ranges_m, other.message.ranges_m)
    )


def whole(path: Path) -> None:
    del path


def without_its_end(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])


@pytest.mark.parametrize("topic", [LIDAR_SCAN, CAMERA_IMAGE])
@pytest.mark.parametrize("happens", [whole, without_its_end])
def test_every_frame_is_what_streaming_gives(drive: Path, topic: str, happens: Callable[[Path], None]) -> None:
    happens(drive)
    expected = streamed(drive, topic)
    assert len(expected) > 80
    with Recording.open(drive) as recording:
        frames = recording.frames(topic)
        assert frames.stamps_ns.tolist() == sorted(expected)
        for row in np.random.default_rng(1).permutation(len(frames)):
            assert equal(frames.at(int(row)), expected[int(frames.stamps_ns[row])])


def test_of_two_frames_with_one_stamp_the_first_received_counts(tmp_path: Path) -> None:
    path = tmp_path / "twice.mcap"
    with RecordingWriter(path, SourceInfo("scene", "plain", 1), "") as writer:
        for received_ns, range_m in ((START_NS + 2, 2.0), (START_NS + 1, 1.0)):
            writer.write(Received(received_ns, LidarScan(START_NS, np.full(RAYS, range_m))))
    with Recording.open(path) as recording:
        frames = recording.frames(LIDAR_SCAN)
        message = frames.at(0).message
        assert len(frames) == 1
        assert isinstance(message, LidarScan)
        assert message.ranges_m[0] == 1.0


def test_a_topic_that_is_not_there_has_no_frames(drive: Path) -> None:
    with Recording.open(drive) as recording:
        assert len(recording.frames("/operator/state")) == 0


def test_the_nearest_frame(drive: Path) -> None:
    with Recording.open(drive) as recording:
        frames = recording.frames(LIDAR_SCAN)
        stamps_ns = frames.stamps_ns.tolist()
        asked = [0, START_NS + 9_999_999, START_NS + 10_000_000, START_NS + 10_000_001, stamps_ns[-1] + 1]
        for stamp_ns in asked:
            assert frames.nearest(stamp_ns) == min(range(300), key=lambda row: abs(stamps_ns[row] - stamp_ns))


def test_a_damaged_chunk_costs_its_frames_and_a_damaged_picture_says_so(drive: Path) -> None:
    with Recording.open(drive) as recording:
        before = len(recording.frames(LIDAR_SCAN))
    data = bytearray(drive.read_bytes())
    at = data.find(b"\x04\x22\x4d\x18", len(data) // 2)  # an lz4 frame begins
    data[at + 200 : at + 220] = bytes(20)
    drive.write_bytes(data)
    with Recording.open(drive) as recording:
        frames = recording.frames(LIDAR_SCAN)
        assert 0 < before - len(frames) < 50
        assert len(recording.damage) == 1


def test_a_picture_that_does_not_parse_is_told_with_its_place(drive: Path) -> None:
    stamp_ns = START_NS + STEP_NS + 5
    picture = streamed(drive, CAMERA_IMAGE)[stamp_ns].message
    assert isinstance(picture, CameraImage)
    data = bytearray(drive.read_bytes())
    at = data.find(picture.data[:50])
    data[at - 3 : at] = b"\xff" * 3
    drive.write_bytes(data)
    with Recording.open(drive) as recording:
        frames = recording.frames(CAMERA_IMAGE)
        with pytest.raises(RecordingError, match=f"at {stamp_ns} ns"):
            frames.at(frames.nearest(stamp_ns))
