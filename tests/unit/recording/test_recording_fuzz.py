"""Files that are cut, flipped, spliced, or lie about their lengths: read in little memory, or refused in one line.

All of it happens in a process whose address space is bounded. A case that does not answer is a hang: the bound in time
is a hundred times what a case needs.
"""

import json
import os
import random
import select
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import mcap_bytes as by_hand
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from mcap_bytes import attachment, channel, chunk, header, message, message_index, metadata, record, schema
from recording_samples import T0, image, one_of_each, scan, write

from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.messages.codec import encode
from sdt_tools.recording.messages.schemas import schema_data
from sdt_tools.recording.messages.topics import topic_of

ROOM_BYTES = 256 << 20
ANSWER_S = 60.0
DRIVE = [*one_of_each(), *(m for n in range(1, 8) for m in (scan(n), image(n, 300)))]
LIES = [0, 1, 2**31 - 1, 2**32 - 1, 2**40, 2**63 - 1, 2**63, 2**64 - 1]


class BoundedReader:
    """The process that reads."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "fuzzed.mcap"
        program = [sys.executable, Path(__file__).with_name("fuzzed_reading.py"), str(ROOM_BYTES)]
        self._process = subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        assert self._ask(write(folder / "warm.mcap", DRIVE)) == "ready"

    def read(self, data: bytes) -> dict[str, int | str]:
        """What every way of reading gives: a number of messages, or the text of an SdtError."""
        self._path.unlink(missing_ok=True)  # a file written anew over an old one is waited for
        self._path.write_bytes(data)
        answer = self._ask(self._path)
        assert answer, f"reading died; the file is {len(data)} bytes: {data[:2000].hex()}"
        return dict(zip(("inspect", "scans", "messages", "interval", "repair"), json.loads(answer), strict=True))

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()

    def _ask(self, path: Path) -> str:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{path}\n")
        self._process.stdin.flush()
        ready, _, _ = select.select([self._process.stdout], [], [], ANSWER_S)
        assert ready, f"no answer in {ANSWER_S} s"
        return self._process.stdout.readline().strip()


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BoundedReader]:
    bounded = BoundedReader(tmp_path_factory.mktemp("fuzz"))
    yield bounded
    bounded.close()


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """Sound files in every layout."""
    folder = tmp_path_factory.mktemp("sound")
    files = [write(folder / "ours.mcap", DRIVE, chunk_bytes=8000)]
    for compression in CompressionType:
        files.append(by_package(folder / f"{compression.name}.mcap", compression=compression, chunk_size=8000))
        files.append(
            by_package(
                folder / f"{compression.name}_0.mcap", compression=compression, chunk_size=8000, enable_crcs=False
            )
        )
    files.append(by_package(folder / "loose.mcap", use_chunking=False))
    return [path.read_bytes() for path in files]


def by_package(path: Path, **options) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start()
        channels: dict[str, int] = {}
        for received in DRIVE:
            topic = topic_of(received.message)
            if topic.name not in channels:
                number = writer.register_schema(topic.schema, "protobuf", schema_data(topic.schema))
                channels[topic.name] = writer.register_channel(topic.name, "protobuf", number)
            stamps = (received.received_ns, encode(received.message), received.message.stamp_ns)
            writer.add_message(channels[topic.name], *stamps)
        writer.add_metadata("theirs", {"a": "b"})
        writer.add_attachment(T0, T0, "notes.txt", "text/plain", b"hello" * 20)
        writer.finish()
    return path


def in_one_line(outcomes: dict[str, int | str]) -> bool:
    return all(isinstance(outcome, int) or "\n" not in outcome for outcome in outcomes.values())


damages = st.tuples(
    st.sampled_from(["flip", "lie", "lie short", "delete", "splice", "zero", "cut"]),
    st.floats(0, 1, exclude_max=True),
    st.integers(0, 2**16),
)


def damaged(data: bytes, others: list[bytes], kind: str, where: float, how: int) -> bytes:
    at = int(where * len(data))
    if kind == "flip":
        return data[:at] + bytes([data[at] ^ 1 << how % 8]) + data[at + 1 :]
    if kind == "lie":
        return data[:at] + struct.pack("<Q", LIES[how % len(LIES)]) + data[at + 8 :]
    if kind == "lie short":
        return data[:at] + struct.pack("<I", LIES[how % len(LIES)] & 0xFFFF_FFFF) + data[at + 4 :]
    if kind == "delete":
        return data[:at] + data[at + how % 3000 :]
    if kind == "zero":
        return data[:at] + bytes(min(how % 600, len(data) - at)) + data[at + how % 600 :]
    if kind == "cut":
        return data[:at]
    other = others[how % len(others)]
    start = how * 97 % len(other)
    return data[:at] + other[start : start + how % 9000] + data[at:]


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 7), st.lists(damages, min_size=1, max_size=4))
def test_whatever_happens_to_a_file_it_is_read_or_refused(reader, sound, number: int, done) -> None:
    data = sound[number]
    for kind, where, how in done:
        if data:
            data = damaged(data, sound, kind, where, how)
    outcomes = reader.read(data)
    assert in_one_line(outcomes)
    assert outcomes["messages"] == outcomes["interval"] or not isinstance(outcomes["messages"], int)


def test_lying_lengths_in_every_kind_of_record(reader: BoundedReader, sound: list[bytes]) -> None:
    """Each record of a file claims to be everything; so do the lengths within it."""
    data = sound[0]
    at, rng = 8, random.Random(0)
    seen: dict[int, int] = {}
    while at < len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        seen[opcode] = seen.get(opcode, 0) + 1
        if seen[opcode] <= 2:
            inside = range(at + 1, min(at + 9 + length, at + 60), 4)
            for place in rng.sample(inside, min(5, len(inside))):
                lie = struct.pack("<Q", rng.choice(LIES))
                outcomes = reader.read(data[:place] + lie + data[place + 8 :])
                assert isinstance(outcomes["repair"], int)
                assert outcomes["repair"] >= len(DRIVE) // 2
        at += 9 + length
    assert len(seen) >= 12


HEAD = (
    header()
    + schema(1, "foxglove.LaserScan", "protobuf", schema_data("foxglove.LaserScan"))
    + channel(1, 1, "/lidar/scan", "protobuf")
)
GOOD = chunk(message(1, T0 + 1, encode(scan(0).message)), (T0 + 1, T0 + 1), "lz4")


@pytest.mark.parametrize("compression", ["", "lz4", "zstd"])
@pytest.mark.parametrize("size", [2**30, 2**31 - 1, 2**40, 2**63 - 1, 2**64 - 1])
@pytest.mark.parametrize("whole", [True, False], ids=["whole", "cut"])
def test_a_chunk_that_claims_terabytes_costs_itself(
    reader: BoundedReader, compression: str, size: int, whole: bool
) -> None:
    body = message(1, T0, encode(scan(1).message))
    liar = chunk(body, (T0, T0), compression, size=size)
    data = by_hand.file(HEAD + GOOD + liar + GOOD) if whole else by_hand.MAGIC + HEAD + GOOD + liar[:-20]
    outcomes = reader.read(data)
    assert isinstance(outcomes["repair"], int)
    assert outcomes["inspect"] == outcomes["repair"] >= (2 if whole else 1)


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
@pytest.mark.parametrize("size", [1 << 16, 1 << 29])
def test_a_chunk_that_unpacks_to_far_more_than_it_claims_costs_itself(
    reader: BoundedReader, compression: str, size: int
) -> None:
    bomb = by_hand.packed(compression, bytes(1 << 20)) * 3
    liar = chunk(b"", (T0, T0), compression, data=bomb, size=size, crc=1)
    outcomes = reader.read(by_hand.file(HEAD + GOOD + liar + GOOD))
    assert (outcomes["inspect"], outcomes["repair"]) == (2, 2)


def test_thousands_of_fragments_are_read_in_time(reader: BoundedReader) -> None:
    """Half a million bytes in which records begin everywhere and lead nowhere."""
    rng = random.Random(1)
    pieces = [
        lambda: struct.pack("<BQ", rng.randrange(16), rng.randrange(400)),
        lambda: struct.pack("<BQ", rng.randrange(256), rng.choice(LIES)),
        lambda: message(1, T0, b"")[: rng.randrange(31)],
        lambda: message_index(1, [(T0, 0)] * rng.randrange(5)),
        lambda: record(rng.randrange(1, 16), bytes(rng.randrange(40))),
        lambda: metadata("m", {"a": "b"})[: rng.randrange(30)],
        lambda: attachment("a", b"b")[: rng.randrange(60)],
    ]
    data = b"".join(rng.choice(pieces)() for _ in range(25_000))
    assert in_one_line(reader.read(by_hand.MAGIC + HEAD + GOOD + data))
    assert in_one_line(reader.read(by_hand.MAGIC + bytes(500_000)))
    assert in_one_line(reader.read(by_hand.MAGIC + (b"\1" + bytes(8)) * 60_000))


STATE = schema(1, "sdt.OperatorState", "protobuf", b"") + channel(1, 1, "/operator/state", "protobuf")
CHUNKS = [(T0 + 10 * n, ["", "lz4", "zstd"][n % 3]) for n in range(4)]
CHUNKED = {start_ns + n for start_ns, _ in CHUNKS for n in range(3)}
LOOSE = {T0 + 50, T0 + 51}


def small_file() -> bytes:
    """Every kind of record in the least room: four chunks of three messages, and two messages outside them."""
    data = header("p", "l") + STATE + metadata("m", {"a": "b"})
    summary = STATE + by_hand.statistics({1: 14}, 14, 4)
    for start_ns, compression in CHUNKS:
        body = b"".join(message(1, start_ns + n, encode(one_of_each()[6].message)) for n in range(3))
        held = chunk(body, (start_ns, start_ns + 2), compression)
        index = message_index(1, [(start_ns + n, n * len(body) // 3) for n in range(3)])
        offset = len(by_hand.MAGIC + data)
        at = {1: offset + len(held)}
        summary += by_hand.Indexed(offset, len(held), (start_ns, start_ns + 2), at, len(index)).record
        data += held + index
    data += attachment("n", b"hello") + message(1, T0 + 50, b"") + message(1, T0 + 51, b"")
    return by_hand.file(data, summary)


def put(path: Path, place: int, value: int) -> None:
    with path.open("r+b") as file:
        file.seek(place)
        file.write(bytes([value]))


def test_a_file_cut_at_every_byte(reader: BoundedReader, tmp_path: Path) -> None:
    """What is read shrinks with the file, a message at a time; here and there it is also repaired."""
    data = small_file()
    before = 14
    path = tmp_path / "cut.mcap"
    path.write_bytes(data)
    for length in range(len(data), 7, -1):
        os.truncate(path, length)
        with McapReader(path) as opened:
            read = sum(1 for _ in opened.entries())
            assert read == sum(extent.count for extent in opened.extents.values())
            assert opened.truncated == (length < len(data))
            assert opened.damage == ()
        assert read <= before
        assert read == 14 or length < len(data)
        before = read
        if length % 97 == 0:
            outcomes = reader.read(data[:length])
            assert in_one_line(outcomes)
            assert outcomes["repair"] == outcomes["inspect"] == outcomes["messages"] or not read


@pytest.mark.parametrize("kept", ["whole", "cut"])
def test_a_bit_flipped_in_every_byte_costs_a_chunk_which_is_named(tmp_path: Path, kept: str) -> None:
    """Of the messages in chunks three at most, and the account covers their times; of those outside, one or two.

    What stands outside chunks has no checksum: a time that is flipped there is a time.
    """
    data = small_file()
    if kept == "cut":
        data = data[: data.index(by_hand.data_end())]
    announced = len(by_hand.MAGIC + header("p", "l") + STATE)  # what a channel was, nobody knows without its summary
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    at_most = 1 if kept == "whole" else 2  # before the end of a cut file two records may be a coincidence
    rng = random.Random(2)
    for place in range(8 if kept == "whole" else announced, len(data)):
        bit = rng.randrange(8)
        put(path, place, data[place] ^ 1 << bit)
        with McapReader(path) as opened:
            read = {entry.log_ns for entry in opened.entries()}
            damage = opened.damage
        put(path, place, data[place])
        lost = CHUNKED - read
        unnamed = {ns for ns in lost if not any(d.start_ns <= ns <= d.end_ns for d in damage)}
        assert len(lost) <= 3, (place, bit)
        assert not unnamed, (place, bit, damage)
        assert len(LOOSE - read) <= at_most, (place, bit)
