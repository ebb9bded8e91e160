"""Whatever the MCAP specification allows is read, and as the mcap package reads it."""

import io
import itertools
import struct
import zlib
from pathlib import Path

import mcap_bytes as by_hand
import numpy as np
import pytest
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import CompressionType, IndexType, Writer
from mcap_bytes import attachment, channel, chunk, data_end, header, message, message_index, metadata, record, schema
from recording_samples import T0, scan

from sdt_tools.errors import RecordingError
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.inspect import inspect_recording
from sdt_tools.recording.messages.codec import encode
from sdt_tools.recording.messages.schemas import schema_data
from sdt_tools.recording.reader import Recording

Found = list[tuple[str, str, str, int, int, bytes]]
SCANS = [encode(scan(n).message) for n in range(6)]
LASER = schema(1, "foxglove.LaserScan", "protobuf", schema_data("foxglove.LaserScan"))
LIDAR = channel(1, 1, "/lidar/scan", "protobuf")
HEAD = header("", "by hand") + LASER + LIDAR
MESSAGES = [message(1, T0 + n, data) for n, data in enumerate(SCANS)]
BODY = b"".join(MESSAGES)
TIMES = (T0, T0 + 5)


def ours(path: Path) -> Found:
    with McapReader(path) as reader:
        assert not reader.truncated
        assert reader.damage == ()
        return [
            (
                (c := reader.channels[e.channel_id]).topic,
                c.message_encoding,
                reader.schema_name(c),
                e.log_ns,
                e.publish_ns,
                e.data,
            )
            for e in reader.entries()
        ]


def theirs(path: Path) -> Found:
    """By the mcap package; without its own use of the summary, which loses what the summary does not name."""
    reader = NonSeekingReader(io.BytesIO(path.read_bytes()))
    found = [
        (c.topic, c.message_encoding, s.name if s else "", m.log_time, m.publish_time, m.data)
        for s, c, m in reader.iter_messages(log_time_order=False)
    ]
    return sorted(found, key=lambda entry: entry[3])


def same_as_the_package(path: Path) -> Found:
    found = ours(path)
    assert found == theirs(path)
    return found


def put(tmp_path: Path, data: bytes) -> Path:
    path = tmp_path / "r.mcap"
    path.write_bytes(data)
    return path


LAYOUTS = list(
    itertools.product(
        [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD],
        [None, 400, 1 << 20],
        [IndexType.ALL, IndexType.NONE, IndexType.CHUNK, IndexType.MESSAGE, IndexType.ATTACHMENT],
        ["all", "no statistics", "nothing repeated", "no summary"],
    )
)


@pytest.mark.parametrize("shuffled", [False, True], ids=["in order", "out of order"])
@pytest.mark.parametrize("messages", [0, 1, 60])
def test_every_layout_of_the_packages_writer(tmp_path: Path, shuffled: bool, messages: int) -> None:
    """All of compression, chunking, indexes and summary, with topics in five encodings."""
    order = list(range(messages))
    if shuffled:
        np.random.default_rng(0).shuffle(order)
    for number, (compression, chunk_size, indexes, summary) in enumerate(LAYOUTS):
        if messages < 60 and number % 7:
            continue  # there is little to lay out
        path = tmp_path / f"{number}.mcap"
        with path.open("wb") as file:
            repeat = summary in ("all", "no statistics")
            writer = Writer(
                file,
                chunk_size=chunk_size or 1,
                compression=compression,
                index_types=indexes,
                repeat_channels=repeat,
                repeat_schemas=repeat,
                use_chunking=chunk_size is not None,
                use_statistics=summary in ("all", "nothing repeated"),
                use_summary_offsets=summary == "all",
                enable_crcs=number % 2 == 0,
                enable_data_crcs=number % 3 == 0,
            )
            write_topics(writer, order)
        found = same_as_the_package(path)
        assert [entry[3] for entry in found] == sorted(T0 + n // 2 for n in order)
        with McapReader(path) as reader:
            counted = sum(extent.count for extent in reader.extents.values())
            assert counted == messages
            assert [attached.data for attached in reader.attachments()] == [b"hello"]
            assert [kept.name for kept in reader.metadata] == ["theirs"]


def write_topics(writer: Writer, order: list[int]) -> None:
    writer.start("prøfil", "bibliothèque ☃")
    kinds = [
        ("/json", "json", ("thing", "jsonschema", b"{}")),
        ("/ros1", "ros1", ("std_msgs/String", "ros1msg", b"string data")),
        ("/ros2", "cdr", ("std_msgs/msg/String", "ros2msg", b"string data")),
        ("/lidar/scan", "protobuf", ("foxglove.LaserScan", "protobuf", schema_data("foxglove.LaserScan"))),
        ("/bare", "", None),
        ("/json", "json", ("other", "jsonschema", b"[]")),
    ]
    channels = [
        writer.register_channel(topic, encoding, writer.register_schema(*kind) if kind else 0, {"n": str(n)})
        for n, (topic, encoding, kind) in enumerate(kinds)
    ]
    writer.add_metadata("theirs", {"ключ": "значение"})
    for n in order:
        writer.add_message(channels[n % 6], T0 + n // 2, bytes([n]) * (n * 7 % 90), T0 - n, n)
    writer.add_attachment(T0, T0, "notes.txt", "text/plain", b"hello")
    writer.finish()


def test_a_summary_that_names_the_chunks_alone_hides_no_loose_message(tmp_path: Path) -> None:
    first = header() + LASER + LIDAR
    held = chunk(BODY, TIMES)
    indexes = message_index(1, [(T0, 0)])
    offset = len(by_hand.MAGIC + first)
    indexed = by_hand.Indexed(offset, len(held), TIMES, {1: offset + len(held)}, len(indexes))
    data = first + held + indexes + message(1, T0 + 50, SCANS[0])
    summary = LASER + LIDAR + by_hand.statistics({1: 7}, 7, 1) + indexed.record
    assert len(same_as_the_package(put(tmp_path, by_hand.file(data, summary)))) == 7


@pytest.mark.parametrize("extra", [b"", b"\1\2\3"], ids=["exact", "extended records"])
@pytest.mark.parametrize("counts", [{1: 6}, {}], ids=["counted", "not by channel"])
@pytest.mark.parametrize("indexed_messages", [True, False])
@pytest.mark.parametrize("crc", [None, 0], ids=["crc", "no crc"])
def test_summaries_by_hand(tmp_path: Path, extra: bytes, counts, indexed_messages: bool, crc: int | None) -> None:
    first = header("ros2", "x", extra) + schema(1, "foxglove.LaserScan", "protobuf", b"", extra)
    first += channel(1, 1, "/lidar/scan", "protobuf", extra) + metadata("m", {"a": "b"}, extra)
    held = chunk(BODY, TIMES, "zstd", extra=extra)
    indexes = message_index(1, [(T0 + n, 0) for n in range(6)], extra) if indexed_messages else b""
    offset = len(by_hand.MAGIC + first)
    at = {1: offset + len(held)} if indexed_messages else {}
    chunk_index = by_hand.Indexed(offset, len(held), TIMES, at, len(indexes)).record
    data = first + held + indexes + attachment("a.txt", b"abc", extra=extra)
    summary = LASER + LIDAR + by_hand.statistics(counts, 6, 1, TIMES) + chunk_index
    path = put(tmp_path, by_hand.file(data, summary, crc=crc, end=data_end(extra=extra)))
    assert len(same_as_the_package(path)) == 6
    with McapReader(path) as reader:
        assert (reader.extents[1].count, reader.extents[1].first_ns, reader.extents[1].last_ns) == (6, *TIMES)
        assert [a.data for a in reader.attachments()] == [b"abc"]


@pytest.mark.parametrize("opcode", [0x10, 0x7F, 0x80, 0xFF])
@pytest.mark.parametrize("where", ["loose", "chunked"])
def test_records_of_unknown_kinds_are_skipped(tmp_path: Path, opcode: int, where: str) -> None:
    strange = record(opcode, b"whatever" * 5) + record(opcode)
    body = strange + strange.join(MESSAGES) + strange
    data = strange + HEAD + strange + (body if where == "loose" else chunk(body, TIMES, "lz4")) + strange
    for summary in (b"", strange + LASER + LIDAR + strange):
        path = put(tmp_path, by_hand.file(data, summary))
        assert len(ours(path)) == 6
        with Recording.open(path) as recording:
            assert len(recording.scans()) == 6


@pytest.mark.parametrize("crc", ["right", "zero", "wrong"])
def test_the_checksum_of_the_data_section_hinders_nobody(tmp_path: Path, crc: str) -> None:
    whole = zlib.crc32(by_hand.MAGIC + HEAD + BODY)
    value = {"right": whole, "zero": 0, "wrong": whole ^ 1}[crc]
    assert len(ours(put(tmp_path, by_hand.file(HEAD + BODY, end=data_end(value))))) == 6


@pytest.mark.parametrize("compression", ["", "lz4", "zstd"])
@pytest.mark.parametrize("crc", ["right", "zero", "wrong"])
def test_the_checksum_of_a_chunk(tmp_path: Path, compression: str, crc: str) -> None:
    value = {"right": None, "zero": 0, "wrong": 12345}[crc]
    bad = chunk(BODY, TIMES, compression, crc=value)
    path = put(tmp_path, by_hand.file(HEAD + bad + chunk(message(1, T0 + 9, SCANS[0]), (T0 + 9, T0 + 9))))
    with McapReader(path) as reader:
        found = [entry.log_ns for entry in reader.entries()]
        damage = [(d.start_ns, d.end_ns, d.reason) for d in reader.damage]
    if crc == "wrong":
        assert found == [T0 + 9]
        assert damage == [(*TIMES, "its checksum does not match")]
    else:
        assert found == [*range(T0, T0 + 6), T0 + 9]
        assert damage == []


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
def test_a_chunk_of_several_frames(tmp_path: Path, compression: str) -> None:
    half = len(BODY) // 2
    data = by_hand.packed(compression, BODY[:half]) + by_hand.packed(compression, BODY[half:])
    path = put(tmp_path, by_hand.file(HEAD + chunk(BODY, TIMES, compression, data=data)))
    assert [entry[-1] for entry in ours(path)] == SCANS


def test_a_summary_with_a_wrong_checksum_is_not_believed(tmp_path: Path) -> None:
    lie = channel(1, 1, "/elsewhere", "protobuf")
    path = put(tmp_path, by_hand.file(HEAD + chunk(BODY, TIMES), LASER + lie, crc=7))
    with McapReader(path) as reader:
        assert [reader.channels[entry.channel_id].topic for entry in reader.entries()] == ["/lidar/scan"] * 6
        assert [damage.reason for damage in reader.damage] == [
            "the checksum of its summary does not match; nothing is lost by that"
        ]


def test_a_footer_with_more_fields_is_a_footer(tmp_path: Path) -> None:
    assert len(ours(put(tmp_path, by_hand.file(HEAD + BODY, extra=b"new field")))) == 6


def test_schema_zero_is_no_schema(tmp_path: Path) -> None:
    data = header() + schema(0, "lie", "protobuf", b"") + channel(1, 0, "/bare", "json") + message(1, 5, b"{}")
    assert ours(put(tmp_path, by_hand.file(data))) == [("/bare", "json", "", 5, 5, b"{}")]


@pytest.mark.parametrize("data", [header(), HEAD, header() + metadata("a", {}), b""])
def test_files_without_messages(tmp_path: Path, data: bytes) -> None:
    path = put(tmp_path, by_hand.file(data))
    assert ours(path) == []
    if data == HEAD:
        assert inspect_recording(path).topics["/lidar/scan"].count == 0
    else:
        with pytest.raises(RecordingError, match="holds none of our topics"):
            inspect_recording(path)


def test_a_chunk_may_hold_no_message_or_nothing(tmp_path: Path) -> None:
    empty, announcing = chunk(b"", (0, 0)), chunk(LASER + LIDAR, (0, 0), "zstd")
    data = header() + empty + announcing + chunk(BODY, TIMES, "lz4") + chunk(b"", (0, 0), "lz4")
    assert len(same_as_the_package(put(tmp_path, by_hand.file(data)))) == 6


def test_chunks_that_lie_in_each_other_come_in_order(tmp_path: Path) -> None:
    spans = [(0, 100), (10, 90), (20, 30), (5, 95), (40, 60), (0, 0), (100, 100)]
    chunks = b""
    for start, end in spans:
        inside = [message(1, T0 + at, struct.pack("<QQ", start, at)) for at in (end, start, (start + end) // 2)]
        chunks += chunk(b"".join(inside), (T0 + start, T0 + end), "lz4")
    times = [entry[3] for entry in same_as_the_package(put(tmp_path, by_hand.file(HEAD + chunks)))]
    assert times == sorted(times)
    assert len(times) == 3 * len(spans)


@pytest.mark.parametrize(("compression", "chunked"), [("", False), ("", True), ("lz4", True), ("zstd", True)])
def test_a_message_of_64_megabytes_beside_one_of_none(tmp_path: Path, compression: str, chunked: bool) -> None:
    huge = np.random.default_rng(0).bytes(1 << 20) * 64
    body = message(2, T0, huge) + message(2, T0 + 1, b"")
    data = header() + channel(2, 0, "/huge", "raw")
    data += chunk(body, (T0, T0 + 1), compression) if chunked else body
    path = put(tmp_path, by_hand.file(data))
    with McapReader(path) as reader:
        big, none = reader.entries()
        assert (zlib.crc32(big.data), len(big.data), none.data) == (zlib.crc32(huge), 64 << 20, b"")


def test_times_to_the_last_bit(tmp_path: Path) -> None:
    last = 2**64 - 1
    data = HEAD + message(1, last, SCANS[0], 0) + message(1, 0, SCANS[1], last)
    path = put(tmp_path, by_hand.file(data))
    assert [entry[3:5] for entry in same_as_the_package(path)] == [(0, last), (last, 0)]
    with Recording.open(path) as recording:
        assert len(recording.scans()) == 0
        (damage,) = recording.damage
    assert damage.reason == "2 messages on /lidar/scan that are stamped after the year 2262"
    assert (damage.start_ns, damage.end_ns) == (0, last)


def test_the_same_topic_on_two_channels_is_one_topic(tmp_path: Path) -> None:
    other = channel(2, 1, "/lidar/scan", "protobuf")
    data = HEAD + other + b"".join(message(1 + n % 2, T0 + n, SCANS[n]) for n in range(6))
    path = put(tmp_path, by_hand.file(data))
    with Recording.open(path) as recording:
        topic = recording.topics["/lidar/scan"]
        assert (topic.count, topic.first_ns, topic.last_ns) == (6, *TIMES)
        assert list(recording.scans().received_ns) == list(range(T0, T0 + 6))


def test_attachments_with_wrong_checksums_are_left_out_and_named(tmp_path: Path) -> None:
    good, unchecked, bad = attachment("a", b"1"), attachment("b", b"2", crc=0), attachment("c", b"3", crc=5)
    path = put(tmp_path, by_hand.file(HEAD + good + unchecked + bad + BODY))
    with McapReader(path) as reader:
        assert [a.name for a in reader.attachments()] == ["a", "b"]
        assert [damage.reason for damage in reader.damage] == ["an attachment is damaged and left out"]


def test_bytes_behind_the_end_are_named_and_not_read(tmp_path: Path) -> None:
    whole = by_hand.file(HEAD + BODY)
    path = put(tmp_path, whole + whole)
    with McapReader(path) as reader:
        assert len(list(reader.entries())) == 6
        assert [d.reason for d in reader.damage] == [f"{len(whole)} bytes follow its end; nothing is lost by that"]


def test_our_files_as_the_seeking_package_reads_them(tmp_path: Path) -> None:
    """The package by its other way, with a summary, where that is whole."""
    first = HEAD
    held = chunk(BODY, TIMES)
    offset = len(by_hand.MAGIC + first)
    starts = itertools.accumulate(map(len, MESSAGES[:-1]), initial=0)
    indexes = message_index(1, [(T0 + n, start) for n, start in enumerate(starts)])
    indexed = by_hand.Indexed(offset, len(held), TIMES, {1: offset + len(held)}, len(indexes))
    summary = LASER + LIDAR + by_hand.statistics({1: 6}, 6, 1, TIMES) + indexed.record
    path = put(tmp_path, by_hand.file(first + held + indexes, summary))
    with path.open("rb") as stream:
        package = [m.data for _, _, m in make_reader(stream, validate_crcs=True).iter_messages()]
    assert package == [entry[-1] for entry in ours(path)] == SCANS
