"""A file's index from its summary, and from what stands between the chunks.

A summary need not tell everything: messages may stand outside chunks, attachments and metadata may have no index. So
the records between the chunks are walked as well, which is quick, for it leaps over the chunks.
"""

import struct
from collections.abc import Sequence
from typing import Final

from isal.isal_zlib import crc32
from mcap.opcode import Opcode
from mcap.records import ChunkIndex, Statistics

from sdt_tools.recording.container.chunk import Segment
from sdt_tools.recording.container.file import MAGIC
from sdt_tools.recording.container.records import HEAD, UNREADABLE, FileIndex, body_of, records, take_record

_FOOTER: Final = struct.Struct("<BQQQI")
_TAIL_BYTES: Final = _FOOTER.size + len(MAGIC)
_TIMES: Final = struct.Struct("<QQ")


class DamagedSummaryError(Exception):
    """A summary that is there but is not what it was."""


def read_summary(view: memoryview) -> FileIndex | None:
    """What the summary of ``view`` says; None where there is none, or it does not suffice.

    Raises DamagedSummaryError.
    """
    footer_at = len(view) - _TAIL_BYTES
    if footer_at < len(MAGIC) or bytes(view[-len(MAGIC) :]) != MAGIC:
        return None
    opcode, length, summary_start, _, crc = _FOOTER.unpack_from(view, footer_at)
    if (opcode, length) != (Opcode.FOOTER, _FOOTER.size - HEAD.size) or summary_start == 0:
        return None
    if not len(MAGIC) <= summary_start <= footer_at:
        raise DamagedSummaryError("its footer does not lead to its summary")
    if crc and crc32(view[summary_start : footer_at + _FOOTER.size - 4]) != crc:
        raise DamagedSummaryError("the checksum of its summary does not match")
    try:
        return _read(view, summary_start, footer_at, checked=crc != 0)
    except UNREADABLE as error:
        raise DamagedSummaryError(f"its summary does not parse ({error})") from None


def _read(view: memoryview, summary_start: int, footer_at: int, checked: bool) -> FileIndex | None:
    index = FileIndex()
    chunks: list[ChunkIndex] = []
    for opcode, at, length in records(view, summary_start, footer_at):
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            take_record(view, index, opcode, at, length)
        elif opcode == Opcode.STATISTICS:
            statistics = Statistics.read(body_of(view, at, length))
            if statistics.channel_message_counts or not statistics.message_count:
                index.counts = statistics.channel_message_counts
        elif opcode == Opcode.CHUNK_INDEX:
            chunks.append(ChunkIndex.read(body_of(view, at, length)))
    if not all(_leads_to_its_chunk(view, chunk, checked) for chunk in chunks):
        return None
    index.segments = [_segment_of(chunk) for chunk in chunks]
    if not _take_rest(view, index, chunks, summary_start) or not _knows_its_channels(index):
        return None
    return index


def _leads_to_its_chunk(view: memoryview, chunk: ChunkIndex, checked: bool) -> bool:
    """Whether there is a chunk where the index says; without a checksum all that it says is compared."""
    at = chunk.chunk_start_offset
    if at + chunk.chunk_length > len(view) or chunk.chunk_length < HEAD.size + _TIMES.size:
        return False
    if HEAD.unpack_from(view, at) != (Opcode.CHUNK, chunk.chunk_length - HEAD.size):
        return False
    if checked:
        return True
    times = _TIMES.unpack_from(view, at + HEAD.size)
    return times == (chunk.message_start_time, chunk.message_end_time) and all(
        bytes(view[offset : offset + 1]) == bytes((Opcode.MESSAGE_INDEX,))
        and int.from_bytes(view[offset + HEAD.size : offset + HEAD.size + 2], "little") == channel_id
        for channel_id, offset in chunk.message_index_offsets.items()
    )


def _segment_of(chunk: ChunkIndex) -> Segment:
    return Segment(
        offset=chunk.chunk_start_offset,
        length=chunk.chunk_length,
        start_ns=chunk.message_start_time,
        end_ns=chunk.message_end_time,
        index_offsets=chunk.message_index_offsets or None,
    )


def _take_rest(view: memoryview, index: FileIndex, chunks: Sequence[ChunkIndex], summary_start: int) -> bool:
    """Take what stands outside the chunks; whether all messages lie in them, up to the end of the data."""
    behind = {chunk.chunk_start_offset: chunk.chunk_length + chunk.message_index_length for chunk in chunks}
    at, passed = len(MAGIC), 0
    while at + HEAD.size <= summary_start:
        if at in behind:
            at, passed = at + behind[at], passed + 1
            continue
        opcode, length = HEAD.unpack_from(view, at)
        end = at + HEAD.size + length
        if opcode in (0, Opcode.MESSAGE, Opcode.CHUNK, Opcode.FOOTER) or end > summary_start:
            return False
        if opcode == Opcode.DATA_END:
            return passed == len(chunks)
        take_record(view, index, opcode, at + HEAD.size, length)
        at = end
    return False


def _knows_its_channels(index: FileIndex) -> bool:
    """Whether all messages belong to channels that are known without opening a chunk."""
    indexed = all(segment.index_offsets is not None for segment in index.segments)
    if index.counts is None and not indexed:
        return False
    channels = {number for segment in index.segments for number in segment.index_offsets or ()}
    return channels | set(index.counts or ()) <= set(index.channels)
