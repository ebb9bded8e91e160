"""A file's index from its summary."""

import struct
import zlib
from typing import Final

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, ChunkIndex, Metadata, MetadataIndex, Schema, Statistics

from sdt_tools.recording.container.chunk import Segment
from sdt_tools.recording.container.file import MAGIC
from sdt_tools.recording.container.records import HEAD, UNREADABLE, FileIndex, body_of, records

_FOOTER: Final = struct.Struct("<BQQQI")
_TAIL_BYTES: Final = _FOOTER.size + len(MAGIC)


def read_summary(view: memoryview) -> FileIndex | None:
    """What the summary of ``view`` says; None where there is none, or it is damaged, or does not suffice."""
    try:
        return _read(view)
    except UNREADABLE:
        return None


def _read(view: memoryview) -> FileIndex | None:
    footer_at = len(view) - _TAIL_BYTES
    if footer_at < len(MAGIC) or bytes(view[-len(MAGIC) :]) != MAGIC:
        return None
    opcode, _, summary_start, _, crc = _FOOTER.unpack_from(view, footer_at)
    if opcode != Opcode.FOOTER or not len(MAGIC) <= summary_start < footer_at:
        return None
    if crc and zlib.crc32(view[summary_start : footer_at + _FOOTER.size - 4]) != crc:
        return None
    index = FileIndex()
    chunks: list[ChunkIndex] = []
    for opcode, at, length in records(view, summary_start, footer_at):
        body = body_of(view, at, length)
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(body)
            index.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(body)
            index.channels[channel.id] = channel
        elif opcode == Opcode.STATISTICS:
            index.counts = Statistics.read(body).channel_message_counts
        elif opcode == Opcode.CHUNK_INDEX:
            chunks.append(ChunkIndex.read(body))
        elif opcode == Opcode.METADATA_INDEX:
            entry = MetadataIndex.read(body)
            index.metadata.append(Metadata.read(body_of(view, entry.offset + HEAD.size, entry.length - HEAD.size)))
        elif opcode == Opcode.ATTACHMENT_INDEX:
            attachment = AttachmentIndex.read(body)
            index.attachments.append((attachment.offset, attachment.length))
    index.segments = [_segment_of(chunk) for chunk in chunks]
    return index if _is_complete(index, view) else None


def _segment_of(chunk: ChunkIndex) -> Segment:
    return Segment(
        offset=chunk.chunk_start_offset,
        length=chunk.chunk_length,
        start_ns=chunk.message_start_time,
        end_ns=chunk.message_end_time,
        index_offsets=chunk.message_index_offsets or None,
    )


def _is_complete(index: FileIndex, view: memoryview) -> bool:
    """Whether the summary alone suffices: all messages lie in indexed chunks and belong to known channels."""
    if index.counts is None or not set(index.counts) <= set(index.channels):
        return False
    if not index.segments and any(index.counts.values()):
        return False
    return all(
        segment.offset + segment.length <= len(view)
        and view[segment.offset] == Opcode.CHUNK
        and set(segment.index_offsets or ()) <= set(index.channels)
        for segment in index.segments
    )
