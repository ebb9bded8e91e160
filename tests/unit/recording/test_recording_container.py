"""The files themselves, read by others: the mcap package, protobuf with the schemas in the file, and Rerun."""

import struct
import zlib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Attachment, Chunk, ChunkIndex, DataEnd, MessageIndex, Metadata, SummaryOffset
from mcap.stream_reader import StreamReader
from recording_samples import CONFIG, T0, image, one_of_each, parsed, read_by_mcap, scan, write

from sdt_tools.errors import OutputExistsError
from sdt_tools.frames import LidarScan
from sdt_tools.recording.container.file import MAGIC, McapFile


def plain_records(path: Path) -> list[object]:
    with path.open("rb") as file:
        return list(StreamReader(file, emit_chunks=True, validate_crcs=True).records)


def test_each_message_keeps_both_of_its_times(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [scan(number, delay_ns=4_000_000 + number) for number in range(5)])
    times = [(message.publish_time, message.log_time) for _, _, message in read_by_mcap(path)]
    assert times == [(T0 + n * 20_000_000, T0 + n * 20_000_000 + 4_000_000 + n) for n in range(5)]


def test_each_kind_reads_field_by_field_with_the_schema_in_the_file(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", one_of_each())
    read = {channel.topic: parsed(schema, message.data) for schema, channel, message in read_by_mcap(path)}
    assert {schema.encoding for schema, _, _ in read_by_mcap(path)} == {"protobuf"}
    for message in read.values():
        assert (message.timestamp.seconds, message.timestamp.nanos) == divmod(T0, 10**9)

    tf = read["/tf"]
    assert (tf.parent_frame_id, tf.child_frame_id) == ("base_link", "lidar")
    assert (tf.translation.x, tf.translation.y, tf.translation.z, tf.rotation.w) == (0.197, 0.0, 0.35, 1.0)
    camera = read["/camera/calibration"]
    assert (camera.width, camera.height, camera.frame_id) == (640, 480, "camera")
    assert list(camera.K) == [500.0, 0.0, 319.5, 0.0, 501.0, 239.5, 0.0, 0.0, 1.0]
    assert list(camera.P) == [500.0, 0.0, 319.5, 0.0, 0.0, 501.0, 239.5, 0.0, 0.0, 0.0, 1.0, 0.0]
    sweep, original = read["/lidar/scan"], scan(0).message
    assert isinstance(original, LidarScan)
    assert np.array_equal(np.array(sweep.ranges), original.ranges_m)
    assert (sweep.frame_id, sweep.start_angle, sweep.end_angle) == ("lidar", np.deg2rad(-135), np.deg2rad(135))
    picture = read["/camera/image"]
    assert (picture.format, picture.frame_id, picture.data[:2]) == ("jpeg", "camera", b"\xff\xd8")
    base = read["/robot/odometry"]
    assert (base.frame_id, base.pose.position.x, base.pose.position.y) == ("odom", 1.5, -2.0)
    assert (base.pose.orientation.z, base.pose.orientation.w) == (np.sin(0.125), np.cos(0.125))
    operator = read["/operator/pose"]
    assert (operator.pose.position.x, operator.pose.orientation.z) == (3.0, np.sin(-1.5))
    state = read["/operator/state"]
    assert (state.gesture, state.commanded_mode) == (2, 1)
    command = read["/robot/command"]
    assert (command.motion, command.linear_mps, command.angular_radps) == (5, -0.25, 0.9)
    assert (command.driver, command.mode, command.intervention) == ("expert", 1, False)
    assert command.HasField("expert")
    assert command.expert == 0
    log = read["/session/log"]
    assert (log.level, log.message, log.name) == (3, "a gap", "lidar")


def test_summary_and_indexes_are_whole(tmp_path: Path) -> None:
    path = write(
        tmp_path / "r.mcap", one_of_each() + [scan(n) for n in range(1, 300)] + [image(n) for n in range(1, 60)]
    )
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {record.name: record.data for record in reader.iter_attachments()}
    assert summary is not None
    assert summary.statistics is not None
    counts = {summary.channels[n].topic: count for n, count in summary.statistics.channel_message_counts.items()}
    assert counts == Counter(channel.topic for _, channel, _ in read_by_mcap(path))
    assert counts["/lidar/scan"] == 300
    assert summary.statistics.message_count == sum(counts.values())
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 2
    assert summary.statistics.schema_count == len(summary.schemas) == 8
    assert summary.statistics.channel_count == len(summary.channels) == 9
    assert (summary.statistics.metadata_count, summary.statistics.attachment_count) == (2, 1)
    times = [message.log_time for _, _, message in read_by_mcap(path)]
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (min(times), max(times))
    assert set(metadata) == {"sdt.session", "sdt.stats"}
    assert attachments == {"config.toml": CONFIG.encode()}


def test_every_index_leads_to_what_it_says(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [scan(n) for n in range(50)] + [image(n) for n in range(50)], chunk_bytes=40_000)
    data, records = path.read_bytes(), plain_records(path)
    chunks = [record for record in records if isinstance(record, ChunkIndex)]
    assert len(chunks) == sum(isinstance(record, Chunk) for record in records) > 4
    for chunk in chunks:
        assert data[chunk.chunk_start_offset] == Opcode.CHUNK
        assert struct.unpack_from("<Q", data, chunk.chunk_start_offset + 1)[0] == chunk.chunk_length - 9
        assert all(data[offset] == Opcode.MESSAGE_INDEX for offset in chunk.message_index_offsets.values())
        end = chunk.chunk_start_offset + chunk.chunk_length
        assert min(chunk.message_index_offsets.values()) == end
        assert data[end + chunk.message_index_length] in (Opcode.CHUNK, Opcode.METADATA, Opcode.CHANNEL, Opcode.SCHEMA)
    for offset in (record for record in records if isinstance(record, SummaryOffset)):
        assert data[offset.group_start] == offset.group_opcode
        assert offset.group_start + offset.group_length < len(data)


def test_message_indexes_point_at_their_messages(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [image(n) for n in range(20)])
    chunk: Chunk | None = None
    entries = 0
    for record in plain_records(path):
        if isinstance(record, Chunk):
            chunk = record
        if isinstance(record, MessageIndex):
            assert chunk is not None
            assert chunk.compression == ""
            for log_time, offset in record.records:
                opcode, _, channel, _, logged = struct.unpack_from("<BQHIQ", chunk.data, offset)
                assert (opcode, channel, logged) == (Opcode.MESSAGE, record.channel_id, log_time)
                entries += 1
    assert entries == 20


def test_images_are_left_uncompressed_and_apart_from_scans(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [message for n in range(100) for message in (scan(n), image(n))])
    chunks = [record for record in plain_records(path) if isinstance(record, ChunkIndex)]
    by_channel = {(tuple(chunk.message_index_offsets), chunk.compression) for chunk in chunks}
    assert by_channel == {((1,), "lz4"), ((2,), "")}


def test_schemas_and_channels_stand_before_the_chunks(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", one_of_each())
    names = [type(record).__name__ for record in plain_records(path)]
    before_chunks = names[: names.index("Chunk")]
    assert (before_chunks.count("Channel"), before_chunks.count("Schema")) == (9, 8)


def test_checksums_are_there_and_right(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", one_of_each())
    data = path.read_bytes()
    assert data[:8] == data[-8:] == MAGIC
    _, _, summary_start, _, crc = struct.unpack("<BQQQI", data[-37:-8])
    assert crc == zlib.crc32(data[summary_start:-12]) != 0
    assert all(record.uncompressed_crc for record in plain_records(path) if isinstance(record, Chunk))


def test_a_file_without_messages_is_whole(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [])
    kinds = [type(record) for record in plain_records(path)]
    assert kinds.count(Metadata) == 2
    assert kinds.count(Attachment) == kinds.count(DataEnd) == 1
    assert read_by_mcap(path) == []


def test_a_file_that_exists_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    path.write_text("mine")
    with pytest.raises(OutputExistsError, match=r"r\.mcap exists already"):
        McapFile(path, "test")
    assert path.read_text() == "mine"


def test_rerun_reads_every_topic(tmp_path: Path) -> None:
    from rerun.chunk import McapReader

    path = write(tmp_path / "r.mcap", one_of_each() + [scan(n) for n in range(1, 40)])
    rows: Counter[str] = Counter()
    for chunk in McapReader(str(path)).stream():
        if not chunk.is_static:
            rows[chunk.entity_path] += chunk.num_rows
    ours = {topic: count for topic, count in rows.items() if not topic.startswith("/__")}
    assert ours == Counter(channel.topic for _, channel, _ in read_by_mcap(path))
