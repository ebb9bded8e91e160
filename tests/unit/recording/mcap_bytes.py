"""MCAP files assembled by hand from the specification: what no writer of a package makes."""

import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK, INDEX = 3, 4, 5, 6, 7
CHUNK_INDEX, ATTACHMENT, STATISTICS, METADATA, DATA_END = 8, 9, 11, 12, 15


def record(opcode: int, body: bytes = b"", extra: bytes = b"") -> bytes:
    return struct.pack("<BQ", opcode, len(body) + len(extra)) + body + extra


def text(value: str) -> bytes:
    return struct.pack("<I", len(value.encode())) + value.encode()


def pairs(values: Mapping[str, str]) -> bytes:
    body = b"".join(text(key) + text(value) for key, value in values.items())
    return struct.pack("<I", len(body)) + body


def header(profile: str = "", library: str = "", extra: bytes = b"") -> bytes:
    return record(1, text(profile) + text(library), extra)


def schema(number: int, name: str, encoding: str, data: bytes, extra: bytes = b"") -> bytes:
    body = struct.pack("<H", number) + text(name) + text(encoding) + struct.pack("<I", len(data)) + data
    return record(SCHEMA, body, extra)


def channel(number: int, schema_id: int, topic: str, encoding: str, extra: bytes = b"") -> bytes:
    return record(CHANNEL, struct.pack("<HH", number, schema_id) + text(topic) + text(encoding) + pairs({}), extra)


def message(channel_id: int, log_ns: int, data: bytes, publish_ns: int | None = None, sequence: int = 0) -> bytes:
    publish_ns = log_ns if publish_ns is None else publish_ns
    return record(MESSAGE, struct.pack("<HIQQ", channel_id, sequence, log_ns, publish_ns) + data)


def metadata(name: str, values: Mapping[str, str], extra: bytes = b"") -> bytes:
    return record(METADATA, text(name) + pairs(values), extra)


def attachment(name: str, data: bytes, log_ns: int = 0, extra: bytes = b"", crc: int | None = None) -> bytes:
    body = struct.pack("<QQ", log_ns, log_ns) + text(name) + text("text/plain") + struct.pack("<Q", len(data)) + data
    return record(ATTACHMENT, body + struct.pack("<I", zlib.crc32(body) if crc is None else crc), extra)


def data_end(crc: int = 0, extra: bytes = b"") -> bytes:
    return record(DATA_END, struct.pack("<I", crc), extra)


def packed(compression: str, plain: bytes) -> bytes:
    if compression == "lz4":
        return bytes(lz4.frame.compress(plain, store_size=False))
    return zstandard.compress(plain) if compression == "zstd" else plain


def chunk(
    content: bytes,
    times: tuple[int, int],
    compression: str = "",
    *,
    crc: int | None = None,
    extra: bytes = b"",
    data: bytes | None = None,
    size: int | None = None,
) -> bytes:
    data = packed(compression, content) if data is None else data
    head = struct.pack("<QQQ", *times, len(content) if size is None else size)
    head += struct.pack("<I", zlib.crc32(content) if crc is None else crc) + text(compression)
    return record(CHUNK, head + struct.pack("<Q", len(data)) + data, extra)


def message_index(channel_id: int, entries: Iterable[tuple[int, int]], extra: bytes = b"") -> bytes:
    body = b"".join(struct.pack("<QQ", *entry) for entry in entries)
    return record(INDEX, struct.pack("<HI", channel_id, len(body)) + body, extra)


@dataclass(frozen=True)
class Indexed:
    """A chunk for the summary: where it lies, and its message indexes by channel."""

    offset: int
    length: int
    times: tuple[int, int]
    indexes: Mapping[int, int]
    indexes_length: int

    @property
    def record(self) -> bytes:
        body = struct.pack("<QQQQ", *self.times, self.offset, self.length)
        offsets = b"".join(struct.pack("<HQ", *entry) for entry in self.indexes.items())
        body += struct.pack("<I", len(offsets)) + offsets + struct.pack("<Q", self.indexes_length)
        return record(CHUNK_INDEX, body + text("") + struct.pack("<QQ", 0, 0))


def statistics(counts: Mapping[int, int], messages: int, chunks: int, times: tuple[int, int] = (0, 0)) -> bytes:
    by_channel = b"".join(struct.pack("<HQ", *entry) for entry in counts.items())
    fixed = struct.pack("<QHIIIIQQ", messages, 0, len(counts), 0, 0, chunks, *times)
    return record(STATISTICS, fixed + struct.pack("<I", len(by_channel)) + by_channel)


def file(data: bytes, summary: bytes = b"", *, crc: int | None = None, extra: bytes = b"", end: bytes = b"") -> bytes:
    """A whole file; ``data`` goes from the header on, its end is appended unless given."""
    before = MAGIC + data + (end or data_end())
    start = len(before) if summary else 0
    fixed = struct.pack("<BQQQ", 2, 20 + len(extra), start, 0)
    crc = zlib.crc32(summary + fixed) if crc is None else crc
    return before + summary + fixed + struct.pack("<I", crc) + extra + MAGIC
