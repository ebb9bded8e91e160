import logging
import struct
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from mcap.records import Chunk, ChunkIndex
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer
from recording_samples import CONFIG, T0, image, one_of_each, read_by_mcap, scan, write

from sdt_tools.errors import RecordingError
from sdt_tools.frames import CameraImage, LidarScan, Odometry, Pose2D, Received
from sdt_tools.recording.messages.codec import encode
from sdt_tools.recording.messages.schemas import schema_data
from sdt_tools.recording.messages.topics import topic_of
from sdt_tools.recording.reader import Recording

ODOMETRY = Received(T0, Odometry(T0, Pose2D(0.0, 0.0, 0.0)))
DRIVE = [message for n in range(200) for message in (scan(n, delay_ns=3_000_000), image(n), ODOMETRY)]


def stamps(messages: list[Received]) -> list[int]:
    return [received.message.stamp_ns for received in messages]


def by_protobuf(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scans by the mcap package and protobuf."""
    read = [message for _, channel, message in read_by_mcap(path) if channel.topic == "/lidar/scan"]
    ranges = np.array([LaserScan.FromString(message.data).ranges for message in read])
    return np.array([m.publish_time for m in read]), np.array([m.log_time for m in read]), ranges


def foreign(path: Path, messages: list[Received], *, extra: bool = False, **options: object) -> Path:
    """The same messages in a file that the mcap package writes."""
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start()
        channels: dict[str, int] = {}
        if extra:
            schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
            channel = writer.register_channel("/chatter", "cdr", schema)
            writer.add_message(channel, T0, b"\0\1\0\0hello", T0)
        for received in messages:
            topic = topic_of(received.message)
            if topic.name not in channels:
                schema = writer.register_schema(topic.schema, "protobuf", schema_data(topic.schema))
                channels[topic.name] = writer.register_channel(topic.name, "protobuf", schema)
            data = encode(received.message)
            writer.add_message(channels[topic.name], received.received_ns, data, received.message.stamp_ns)
        writer.finish()
    return path


def test_scans_are_those_that_protobuf_reads(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", DRIVE, chunk_bytes=50_000)
    with Recording.open(path) as recording:
        series = recording.scans()
    publish, log, ranges = by_protobuf(path)
    assert np.array_equal(series.stamps_ns, publish)
    assert np.array_equal(series.received_ns, log)
    assert series.ranges_m.tobytes() == ranges.tobytes()


@pytest.mark.parametrize("size", [1, 7, 200, 1000])
def test_batches_are_the_scans_in_parts(tmp_path: Path, size: int) -> None:
    path = write(tmp_path / "r.mcap", DRIVE, chunk_bytes=50_000)
    with Recording.open(path) as recording:
        batches = list(recording.scan_batches(size))
        whole = recording.scans()
    assert [len(batch) for batch in batches[:-1]] == [size] * (len(batches) - 1)
    assert np.array_equal(np.concatenate([batch.ranges_m for batch in batches]), whole.ranges_m)
    assert np.array_equal(np.concatenate([batch.stamps_ns for batch in batches]), whole.stamps_ns)


def test_invalid_codes_stay_what_they_are(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [scan(n) for n in range(3)])
    with Recording.open(path) as recording:
        assert [series[0] for series in recording.scans().ranges_m] == [0.0, 0.002, 0.003]


def test_a_recording_without_scans_gives_an_empty_series(tmp_path: Path) -> None:
    with Recording.open(write(tmp_path / "r.mcap", [image(0)])) as recording:
        assert recording.scans().ranges_m.shape == (0, 541)


def test_messages_come_in_order_of_receipt_even_between_chunks(tmp_path: Path) -> None:
    shuffled = [DRIVE[place] for place in np.random.default_rng(0).permutation(len(DRIVE))]
    with Recording.open(write(tmp_path / "r.mcap", shuffled, chunk_bytes=20_000)) as recording:
        times = [received.received_ns for received in recording.messages()]
        series = recording.scans()
    assert times == sorted(received.received_ns for received in DRIVE)
    assert np.all(np.diff(series.received_ns) > 0)


def test_scans_of_one_chunk_come_in_order_of_receipt(tmp_path: Path) -> None:
    with Recording.open(write(tmp_path / "r.mcap", [scan(n) for n in (3, 1, 2, 0)])) as recording:
        series = recording.scans()
    assert list(series.stamps_ns) == [T0 + n * 20_000_000 for n in range(4)]
    assert np.array_equal(series.ranges_m[1], scan(1).message.ranges_m)


def test_messages_of_chosen_topics_in_a_half_open_interval(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [m for n in range(100) for m in (scan(n), image(n))], chunk_bytes=30_000)
    start_ns, end_ns = T0 + 10 * 20_000_000, T0 + 20 * 20_000_000
    with Recording.open(path) as recording:
        scans = list(recording.messages(["/lidar/scan"], start_ns, end_ns))
        images = list(recording.messages(["/camera/image"], start_ns, end_ns))
    assert stamps(scans) == [T0 + n * 20_000_000 for n in range(10, 20)]
    assert all(isinstance(received.message, CameraImage) for received in images)
    assert len(images) == 6  # 7 to 12, at 30 Hz


def test_a_message_comes_back_whole(tmp_path: Path) -> None:
    written = one_of_each()
    with Recording.open(write(tmp_path / "r.mcap", written)) as recording:
        read = list(recording.messages())
    for before, after in zip(written, read, strict=True):
        if isinstance(before.message, LidarScan):
            assert isinstance(after.message, LidarScan)
            assert np.array_equal(before.message.ranges_m, after.message.ranges_m)
        elif not hasattr(before.message, "pose"):
            assert before == after


def test_what_the_recording_says_about_itself(tmp_path: Path) -> None:
    path = write(tmp_path / "drive_7.mcap", [scan(n) for n in range(101)])
    with Recording.open(path) as recording:
        assert recording.stem == "drive_7"
        assert recording.session["scenario"] == "plain"
        assert recording.recording_id == recording.session["recording_id"]
        assert recording.config_toml == CONFIG
        topic = recording.topics["/lidar/scan"]
    assert (topic.count, topic.first_ns, topic.last_ns) == (101, T0, T0 + 2 * 10**9)
    assert topic.hz == 50.0


def record_starts(data: bytes) -> list[int]:
    starts, at = [], 8
    while at < len(data) - 8:
        starts.append(at)
        at += 9 + struct.unpack_from("<Q", data, at + 1)[0]
    return starts


def test_a_file_cut_anywhere_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    whole = write(tmp_path / "whole.mcap", [m for n in range(24) for m in (scan(n), image(n, 500))], chunk_bytes=30_000)
    data = whole.read_bytes()
    starts = record_starts(data)
    cuts = {start + into for start in starts[2:] for into in (0, 5, 20)} | set(range(len(data) - 9, len(data)))
    read_before = 0
    for cut in sorted(cut for cut in cuts if cut < len(data)):
        path = tmp_path / "cut.mcap"
        path.write_bytes(data[:cut])
        with Recording.open(path) as recording:
            assert recording.truncated
            assert not recording.damage
            scans = recording.scans()
            total = len(list(recording.messages()))
            assert total == sum(topic.count for topic in recording.topics.values())
        assert list(scans.stamps_ns) == [T0 + n * 20_000_000 for n in range(len(scans))]
        assert total >= read_before
        read_before = total
    assert read_before == 48


@pytest.mark.parametrize("tenths", range(1, 10))
def test_a_cut_is_no_damage(tmp_path: Path, tenths: int) -> None:
    whole = write(tmp_path / "r.mcap", DRIVE, chunk_bytes=500_000).read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) * tenths // 10])
    with Recording.open(tmp_path / "cut.mcap") as recording:
        assert list(recording.messages())
        assert recording.truncated
        assert recording.damage == ()


def test_an_image_chunk_that_is_cut_gives_its_first_images(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [image(n) for n in range(20)])
    data = path.read_bytes()
    path.write_bytes(data[: data.index(np.random.default_rng(10).bytes(3000)) + 10])
    with Recording.open(path) as recording:
        assert stamps(list(recording.messages())) == [T0 + n * 33_333_333 for n in range(10)]


def test_a_lying_length_ends_the_reading_and_nothing_else(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [scan(n) for n in range(60)], chunk_bytes=60_000)
    data = bytearray(path.read_bytes())
    chunk = [start for start in record_starts(bytes(data)) if data[start] == 6][2]
    data[chunk + 1 : chunk + 9] = struct.pack("<Q", 2**63 - 1)
    path.write_bytes(data[:-100])
    with Recording.open(path) as recording:
        assert recording.truncated
        assert len(recording.scans()) >= 28


def test_a_damaged_chunk_costs_itself_and_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = write(tmp_path / "r.mcap", [image(n) for n in range(60)], chunk_bytes=60_000)
    data = bytearray(path.read_bytes())
    data[data.index(np.random.default_rng(25).bytes(3000)) + 100] ^= 1
    path.write_bytes(data)
    with Recording.open(path) as recording, caplog.at_level(logging.WARNING):
        read = stamps(list(recording.messages()))
        (damage,) = recording.damage
    assert damage.reason == "its checksum does not match"
    assert 0 < len(read) < 60
    lost = {T0 + n * 33_333_333 for n in range(60)} - set(read)
    assert T0 + 25 * 33_333_333 in lost
    assert (damage.start_ns, damage.end_ns) == (min(lost), max(lost))
    assert "r.mcap: damaged at byte" in caplog.text
    assert "its checksum does not match; times" in caplog.text


def test_a_chunk_that_does_not_decompress_costs_itself(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [scan(n) for n in range(60)], chunk_bytes=60_000)
    data = bytearray(path.read_bytes())
    at = data.index(b"\x04\x22\x4d\x18", data.index(b"\x04\x22\x4d\x18") + 1)  # the second lz4 frame
    data[at + 40 : at + 200] = bytes(160)
    path.write_bytes(data)
    with Recording.open(path) as recording:
        scans = recording.scans()
        assert len(recording.damage) == 1
    assert 0 < len(scans) < 60


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"compression": CompressionType.ZSTD},
        {"compression": CompressionType.LZ4, "chunk_size": 20_000},
        {"compression": CompressionType.NONE, "chunk_size": 20_000},
        {"use_chunking": False},
        {"index_types": IndexType.NONE},
        {"index_types": IndexType.CHUNK},
        {"use_statistics": False},
        {"repeat_channels": False, "repeat_schemas": False},
        {"enable_crcs": False, "use_summary_offsets": False},
    ],
    ids=str,
)
def test_files_of_other_writers_are_read(tmp_path: Path, options: dict[str, object]) -> None:
    path = foreign(tmp_path / "r.mcap", DRIVE, extra=True, **options)
    with Recording.open(path) as recording:
        assert not recording.truncated
        series = recording.scans()
        assert recording.topics["/lidar/scan"].count == 200
        assert recording.topics["/robot/odometry"].count == 200
        assert recording.topics["/lidar/scan"].hz == pytest.approx(50.0)
        assert recording.foreign_topics == ("/chatter",)
        assert len(list(recording.messages())) == 600
        assert recording.session == {}
        assert len(recording.recording_id) == 36
    assert np.array_equal(series.stamps_ns, [T0 + n * 20_000_000 for n in range(200)])
    assert np.array_equal(series.ranges_m[7], scan(7).message.ranges_m)


def test_chunks_of_others_that_overlap_in_time_are_put_in_order(tmp_path: Path) -> None:
    shuffled = [scan(int(n)) for n in np.random.default_rng(1).permutation(100)]
    path = foreign(tmp_path / "r.mcap", shuffled, compression=CompressionType.NONE, chunk_size=30_000)
    with path.open("rb") as file:
        assert sum(isinstance(record, ChunkIndex) for record in StreamReader(file, emit_chunks=True).records) > 5
    with Recording.open(path) as recording:
        assert list(recording.scans().stamps_ns) == [T0 + n * 20_000_000 for n in range(100)]


def test_scans_of_another_number_of_rays_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [scan(0), scan(1, rays=1081)])
    with Recording.open(path) as recording:
        assert [m.message.ranges_m.size for m in recording.messages()] == [541, 1081]
        with pytest.raises(RecordingError, match=r"r\.mcap: /lidar/scan at \d+ ns has 1081 rays, 541 expected"):
            recording.scans()


def bad_text(path: Path) -> Path:
    path.write_text("step,state\n0,1\n")
    return path


def bad_empty(path: Path) -> Path:
    path.touch()
    return path


def bad_folder(path: Path) -> Path:
    path.mkdir()
    return path


def bad_topics(path: Path) -> Path:
    return foreign(path, [], extra=True)


def bad_magic_alone(path: Path) -> Path:
    path.write_bytes(b"\x89MCAP0\r\n")
    return path


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: path, "no such recording; check the path"),
        (bad_text, "not an MCAP file; `sdt import` reads other formats"),
        (bad_empty, "is empty; nothing was recorded"),
        (bad_folder, r"is a folder; name the \.mcap file in it"),
        (bad_topics, r"holds none of our topics .*; it has /chatter; check that it is a recording"),
        (bad_magic_alone, "was cut off before its first topic; nothing can be read of it"),
    ],
)
def test_what_is_no_recording_is_refused_in_one_line(tmp_path: Path, make, message: str) -> None:
    path = make(tmp_path / "x.mcap")
    with pytest.raises(RecordingError, match=rf"x\.mcap: {message}") as error:
        Recording.open(path)
    assert "\n" not in str(error.value)


def test_our_topic_in_the_schema_of_others_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("sensor_msgs/msg/LaserScan", "ros2msg", b"float32[] ranges")
        writer.add_message(writer.register_channel("/lidar/scan", "cdr", schema), T0, b"\0\1\0\0", T0)
        writer.finish()
    with pytest.raises(RecordingError, match="none of our topics"):
        Recording.open(path)


def test_a_file_is_let_go_while_an_iterator_waits(tmp_path: Path) -> None:
    with Recording.open(write(tmp_path / "r.mcap", [image(n) for n in range(9)])) as recording:
        waiting = recording.messages()
        first = next(waiting)
    assert isinstance(first.message, CameraImage)


def test_scans_alone_never_touch_the_images(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [m for n in range(60) for m in (scan(n), image(n))], chunk_bytes=30_000)
    data = bytearray(path.read_bytes())
    with path.open("rb") as file:
        images = [r for r in StreamReader(file, emit_chunks=True).records if isinstance(r, Chunk) and not r.compression]
    for chunk in images:
        data[data.index(chunk.data) + 40] ^= 1
    path.write_bytes(data)
    with Recording.open(path) as recording:
        assert len(recording.scans()) == 60
        assert recording.damage == ()
