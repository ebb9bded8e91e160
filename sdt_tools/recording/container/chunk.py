"""One stretch of messages in an MCAP file, unpacked and walked."""

import struct
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from typing import Final, NamedTuple

import lz4.frame
import zstandard
from isal.isal_zlib import crc32
from mcap.opcode import Opcode

MAX_CHUNK_BYTES: Final = 1 << 30
"""A compressed chunk that claims to hold more is taken for damaged; writers make chunks of about a megabyte.

One that is not compressed may have any size: it is read where it lies in the file.
"""

_LZ4_MOST: Final = 256
"""lz4 packs no more than 255 bytes into one."""
_LZ4_PART: Final = 1 << 24
_ZSTD_PART: Final = 1 << 20
_BAD_DATA: Final = (RuntimeError, zstandard.ZstdError)
_RECORD_HEAD: Final = struct.Struct("<BQ")
_CHUNK_HEAD: Final = struct.Struct("<BQQQQII")
_MESSAGE_HEAD: Final = struct.Struct("<HIQQ")


class DamagedChunkError(Exception):
    """A chunk that cannot be unpacked, or is not what its checksum says."""


@dataclass(frozen=True)
class Segment:
    """A chunk record, or (``loose``) a run of messages that stand outside chunks.

    ``offset`` and ``length`` take in the record's head. ``index_offsets`` says where the message index of each channel
    lies; None where that is not known. Times are log times, ``end_ns`` inclusive. A ``cut`` chunk is the file's last,
    and incomplete.
    """

    offset: int
    length: int
    start_ns: int
    end_ns: int
    index_offsets: Mapping[int, int] | None = None
    loose: bool = False
    cut: bool = False

    def may_hold(self, channel_ids: Set[int]) -> bool:
        """Whether a message of one of these channels can be in it."""
        return self.index_offsets is None or not channel_ids.isdisjoint(self.index_offsets.keys())


class RawMessage(NamedTuple):
    """A message that has not been decoded: where its data lies in the buffer that was walked."""

    channel_id: int
    log_ns: int
    publish_ns: int
    start: int
    end: int


def read_segment(view: memoryview, segment: Segment) -> bytes | memoryview:
    """The records in ``segment`` of the file ``view``; of a cut chunk, what is left of them.

    Raises DamagedChunkError where they cannot be had.
    """
    end = segment.offset + segment.length
    if segment.loose:
        return view[segment.offset : end]
    try:
        *_, size, crc, name_length = _CHUNK_HEAD.unpack_from(view, segment.offset)
        at = segment.offset + _CHUNK_HEAD.size
        compression = bytes(view[at : at + name_length]).decode()
        (data_length,) = struct.unpack_from("<Q", view, at + name_length)
    except (struct.error, UnicodeDecodeError):
        if segment.cut:
            return b""
        raise DamagedChunkError("its head is unreadable") from None
    at += name_length + 8
    if compression and (size > MAX_CHUNK_BYTES or (compression == "lz4" and size > _LZ4_MOST * data_length)):
        raise DamagedChunkError(f"it claims {size} bytes, more than it can hold")
    if at + data_length > end and not segment.cut:
        raise DamagedChunkError("its data reaches beyond it")
    data = _decompress(compression, view[at : min(at + data_length, end)], size, segment.cut)
    if segment.cut:
        return data
    if len(data) != size:
        raise DamagedChunkError(f"it holds {len(data)} bytes where {size} are promised")
    if crc and crc32(data) != crc:
        raise DamagedChunkError("its checksum does not match")
    return data


def stored(view: memoryview, segment: Segment) -> memoryview | None:
    """What ``segment`` holds, where it lies in the file uncompressed; not held against a checksum. Else None."""
    end = segment.offset + segment.length
    if segment.loose:
        return view[segment.offset : end]
    head = segment.offset + _CHUNK_HEAD.size
    if segment.cut or head + 8 > end:
        return None
    compressed = _CHUNK_HEAD.unpack_from(view, segment.offset)[6]
    (length,) = struct.unpack_from("<Q", view, head)
    return None if compressed or head + 8 + length > end else view[head + 8 : head + 8 + length]


def is_checked(view: memoryview, offset: int) -> bool:
    """Whether the segment at ``offset`` is a chunk with a checksum, not a run of messages."""
    return view[offset] != Opcode.MESSAGE and _CHUNK_HEAD.unpack_from(view, offset)[5] != 0


def ends_within_a_record(view: memoryview, segment: Segment, data: bytes | memoryview) -> bool:
    """Whether the last record in ``data``, of an unpacked chunk, reaches beyond it.

    Only chunks without a checksum are looked through: what a checksum covers is as it was written.
    """
    if segment.loose or segment.cut or is_checked(view, segment.offset):
        return False
    at, size = 0, len(data)
    while at + _RECORD_HEAD.size <= size:
        at += _RECORD_HEAD.size + _RECORD_HEAD.unpack_from(data, at)[1]
    return at != size


def walk_messages(data: bytes | memoryview) -> Iterator[RawMessage]:
    """The messages among the records of an unpacked chunk; stops at a record that is cut off."""
    at, size = 0, len(data)
    while at + _RECORD_HEAD.size <= size:
        opcode, length = _RECORD_HEAD.unpack_from(data, at)
        at += _RECORD_HEAD.size
        end = at + length
        if end > size:
            return
        if opcode == Opcode.MESSAGE and length >= _MESSAGE_HEAD.size:
            channel_id, _, log_ns, publish_ns = _MESSAGE_HEAD.unpack_from(data, at)
            yield RawMessage(channel_id, log_ns, publish_ns, at + _MESSAGE_HEAD.size, end)
        at = end


def _decompress(compression: str, data: memoryview, size: int, cut: bool) -> bytes | memoryview:
    if compression == "":
        return data
    if compression not in ("lz4", "zstd"):
        raise DamagedChunkError(f"it is compressed with {compression!r}; lz4, zstd and none are known")
    if compression == "lz4" and not cut and size <= _LZ4_PART:
        return _unpack_lz4_at_once(data, size)
    parts: list[bytes] = []
    try:
        parts.extend((_lz4_parts if compression == "lz4" else _zstd_parts)(data, size))
    except _BAD_DATA as error:
        if not cut:
            raise DamagedChunkError(f"it does not decompress ({error})") from None
    return b"".join(parts)


def _unpack_lz4_at_once(data: memoryview, size: int) -> bytes:
    try:
        if lz4.frame.get_frame_info(data)["content_size"] == size:
            unpacked: bytes = lz4.frame.decompress(data)
            return unpacked
        return b"".join(_lz4_parts(data, size))
    except _BAD_DATA as error:
        raise DamagedChunkError(f"it does not decompress ({error})") from None


def _lz4_parts(data: memoryview, size: int) -> Iterator[bytes]:
    """At most ``size`` bytes out of lz4 frames, in parts: no room is made for much more than there is."""
    decompressor, left = lz4.frame.LZ4FrameDecompressor(), size
    packed: bytes | memoryview = data
    while left:
        part = decompressor.decompress(packed, max_length=min(left, _LZ4_PART))
        packed = b""
        left -= len(part)
        yield part
        if decompressor.eof:
            if not decompressor.unused_data:
                return
            packed, decompressor = decompressor.unused_data, lz4.frame.LZ4FrameDecompressor()
        elif decompressor.needs_input or not part:
            return


def _zstd_parts(data: memoryview, size: int) -> Iterator[bytes]:
    """The same out of zstd frames."""
    with zstandard.ZstdDecompressor().stream_reader(data, read_across_frames=True) as stream:
        left = size
        while left and (part := stream.read(min(left, _ZSTD_PART))):
            left -= len(part)
            yield part
