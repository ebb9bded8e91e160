import struct
from pathlib import Path

import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import Writer
from recording_samples import T0, image, one_of_each, read_by_mcap, scan, write
from rerun.chunk import McapReader as RerunReader

from sdt_tools.errors import OutputExistsError, RecordingError
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.repair import repair_recording

DRIVE = [*one_of_each(), *(m for n in range(1, 40) for m in (scan(n), image(n, 800)))]
IMAGE_CHUNK_NS = 33_333_333


def broken(path: Path, change) -> Path:
    data = bytearray(write(path, DRIVE, chunk_bytes=20_000).read_bytes())
    change(data)
    path.write_bytes(data)
    return path


def records_of(data: bytes | bytearray, opcode: Opcode) -> list[int]:
    """Where the records of one kind begin."""
    found, at = [], 8
    while at < len(data) - 8:
        if data[at] == opcode:
            found.append(at)
        at += 9 + struct.unpack_from("<Q", data, at + 1)[0]
    return found


def contents(path: Path) -> list[tuple[str, int, int, bytes]]:
    return [(channel.topic, m.log_time, m.publish_time, m.data) for _, channel, m in read_by_mcap(path)]


def test_a_cut_recording_is_saved_as_far_as_it_goes(tmp_path: Path) -> None:
    path = broken(tmp_path / "cut.mcap", lambda data: data.__delitem__(slice(len(data) * 2 // 3, None)))
    before = path.read_bytes()
    report = repair_recording(path, tmp_path / "new.mcap")
    assert path.read_bytes() == before
    assert report.truncated
    assert not report.sound
    assert report.lost is None
    with McapReader(path) as cut:
        kept = [(cut.channels[e.channel_id].topic, e.log_ns, e.publish_ns, e.data) for e in cut.entries()]
    assert contents(tmp_path / "new.mcap") == kept
    assert 40 < len(kept) < len(DRIVE)
    with Recording.open(path) as cut_recording, Recording.open(tmp_path / "new.mcap") as new:
        assert not new.truncated
        assert new.recording_id == cut_recording.recording_id
        assert new.config_toml == cut_recording.config_toml


def test_what_is_whole_comes_through_unchanged(tmp_path: Path) -> None:
    path = write(tmp_path / "whole.mcap", DRIVE)
    report = repair_recording(path, tmp_path / "new.mcap")
    assert report.sound
    assert contents(tmp_path / "new.mcap") == contents(path)
    with Recording.open(path) as old, Recording.open(tmp_path / "new.mcap") as new:
        assert dict(new.stats) == dict(old.stats)


def test_rerun_opens_what_was_repaired(tmp_path: Path) -> None:
    path = broken(tmp_path / "cut.mcap", lambda data: data.__delitem__(slice(len(data) // 2, None)))
    report = repair_recording(path, tmp_path / "new.mcap")
    rows = sum(chunk.num_rows for chunk in RerunReader(tmp_path / "new.mcap", decoders=["raw"]).stream())
    assert rows >= sum(report.messages.values())


def test_a_damaged_chunk_costs_that_chunk_and_is_named(tmp_path: Path) -> None:
    def change(data: bytearray) -> None:
        data[records_of(data, Opcode.CHUNK)[4] + 200] ^= 8

    path = broken(tmp_path / "flipped.mcap", change)
    report = repair_recording(path, tmp_path / "new.mcap")
    (damage,) = report.damage
    lost = {(r.received_ns, type(r.message).__name__) for r in DRIVE}
    with Recording.open(tmp_path / "new.mcap") as new:
        lost -= {(r.received_ns, type(r.message).__name__) for r in new.messages()}
    assert lost
    assert {kind for _, kind in lost} <= {"LidarScan"} or {kind for _, kind in lost} <= {"CameraImage"}
    assert (damage.start_ns, damage.end_ns) == (min(ns for ns, _ in lost), max(ns for ns, _ in lost))
    assert report.lost is not None
    assert sum(report.lost.values()) == len(lost)


@pytest.mark.parametrize("opcode", [op for op in Opcode if op not in (Opcode.MESSAGE, Opcode.FOOTER)], ids=str)
@pytest.mark.parametrize("place", [0, 1, 4, 8, 9, 12, 20])
@pytest.mark.parametrize("cut", [False, True])
def test_a_flipped_bit_in_any_kind_of_record_costs_a_chunk_at_most(
    tmp_path: Path, opcode: Opcode, place: int, cut: bool
) -> None:
    def change(data: bytearray) -> None:
        starts = records_of(data, opcode)
        at = starts[len(starts) // 2] + place
        if cut:
            del data[records_of(data, Opcode.DATA_END)[0] :]
        if at < len(data):
            data[at] ^= 0x10

    path = broken(tmp_path / "flipped.mcap", change)
    report = repair_recording(path, tmp_path / "new.mcap")
    kept = contents(tmp_path / "new.mcap")
    assert len(kept) == sum(report.messages.values())
    if opcode in (Opcode.CHANNEL, Opcode.SCHEMA) and cut:
        return  # without summary or announcement nobody knows what the topic was
    assert len(kept) >= len(DRIVE) - 30


def test_the_first_bytes_may_be_damaged(tmp_path: Path) -> None:
    path = broken(tmp_path / "flipped.mcap", lambda data: data.__setitem__(3, 0x00))
    report = repair_recording(path, tmp_path / "new.mcap")
    assert sum(report.messages.values()) == len(DRIVE)
    assert "first bytes" in report.damage[0].reason


def test_topics_of_others_come_along(tmp_path: Path) -> None:
    path = tmp_path / "foreign.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=1000)
        writer.start("ros2", "other")
        schema = writer.register_schema("pkg/msg/Thing", "ros2msg", b"float64 x")
        channel = writer.register_channel("/thing", "cdr", schema, {"offered_qos": "best"})
        bare = writer.register_channel("/bare", "json", 0)
        for n in range(100):
            writer.add_message(channel, T0 + n, bytes([n] * 60), T0 + n - 5)
            writer.add_message(bare, T0 + n, b"{}", T0 + n)
        writer.add_metadata("theirs", {"a": "b"})
        writer.add_attachment(1, 2, "notes.txt", "text/plain", b"hello")
        writer.finish()
    path.write_bytes(path.read_bytes()[:-300])
    repair_recording(path, tmp_path / "new.mcap")
    with (tmp_path / "new.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        found = [(s.name if s else "", c.topic, c.message_encoding, c.metadata) for s, c, _ in reader.iter_messages()]
        assert [(a.data, a.create_time, a.log_time) for a in reader.iter_attachments()] == [(b"hello", 1, 2)]
        assert (reader.get_header().profile, reader.get_header().library) == ("ros2", "other")
        assert {m.name for m in reader.iter_metadata()} == {"theirs", "sdt.repair"}
    assert found.count(("pkg/msg/Thing", "/thing", "cdr", {"offered_qos": "best"})) == 100
    assert found.count(("", "/bare", "json", {})) == 100


def test_nothing_is_written_over_and_nothing_half_is_left(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", DRIVE)
    with pytest.raises(OutputExistsError):
        repair_recording(path, path)
    garbage = tmp_path / "garbage.mcap"
    garbage.write_bytes(b"\x89MCAP0\r\n" + bytes(300))
    with pytest.raises(RecordingError, match=r"garbage\.mcap: nothing in it can be read"):
        repair_recording(garbage, tmp_path / "new.mcap")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["garbage.mcap", "r.mcap"]
