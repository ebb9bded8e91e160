"""Where everything lies in an MCAP file: from its summary where that is whole, else by walking its records.

A walk goes as far as the file does: what a crash or a full disk cut off at the end costs nothing before it.
"""

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import Final

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, ChunkIndex, Metadata, MetadataIndex, Schema, Statistics

from sdt_tools.recording.chunk import DamagedChunkError, Segment, read_segment
from sdt_tools.recording.container import MAGIC

_HEAD: Final = struct.Struct("<BQ")
_FOOTER: Final = struct.Struct("<BQQQI")
_TAIL_BYTES: Final = _FOOTER.size + len(MAGIC)
_CHUNK_TIMES: Final = struct.Struct("<QQ")
_MESSAGE_FIXED: Final = 22
_RUN_BYTES: Final = 1 << 20
_UNREADABLE: Final = (McapError, struct.error, UnicodeDecodeError, IndexError, ValueError)
"""What the record classes raise on bytes that are not a record."""


@dataclass
class FileIndex:
    """What a file holds and where. ``counts`` (messages by channel) is None where only counting would tell."""

    segments: list[Segment] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    metadata: dict[str, Mapping[str, str]] = field(default_factory=dict)
    attachments: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Offset and length of the attachment records, by name."""
    counts: Mapping[int, int] | None = None
    truncated: bool = False

    def schema_name(self, channel: Channel) -> str:
        """The name of the schema of ``channel``; empty where it has none."""
        schema = self.schemas.get(channel.schema_id)
        return "" if schema is None else schema.name


def read_index(view: memoryview) -> FileIndex:
    """The index of the MCAP file whose bytes are ``view`` (which starts with the magic)."""
    try:
        from_summary = _read_summary(view)
    except _UNREADABLE:
        from_summary = None
    return from_summary if from_summary is not None else _walk(view)


def records(view: memoryview, start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Opcode, offset of the body and length of the body of each record; a last one may reach beyond ``end``."""
    at = start
    while at + _HEAD.size <= end:
        opcode, length = _HEAD.unpack_from(view, at)
        yield opcode, at + _HEAD.size, length
        at += _HEAD.size + length


def _body(view: memoryview, offset: int, length: int) -> ReadDataStream:
    return ReadDataStream(BytesIO(view[offset : offset + length]))


def _read_summary(view: memoryview) -> FileIndex | None:
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
        body = _body(view, at, length)
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
            metadata = Metadata.read(_body(view, entry.offset + _HEAD.size, entry.length - _HEAD.size))
            index.metadata[metadata.name] = metadata.metadata
        elif opcode == Opcode.ATTACHMENT_INDEX:
            attachment = AttachmentIndex.read(body)
            index.attachments[attachment.name] = (attachment.offset, attachment.length)
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


def _walk(view: memoryview) -> FileIndex:
    index = FileIndex(truncated=True)
    chunk: Segment | None = None
    indexes: dict[int, int] = {}
    loose: _LooseMessages = _LooseMessages(view)

    def settle() -> None:
        nonlocal chunk
        if chunk is not None:
            index.segments.append(_settled(view, index, chunk, indexes))
            chunk = None

    for opcode, at, length in records(view, len(MAGIC), len(view)):
        if opcode != Opcode.MESSAGE_INDEX:
            settle()
            indexes = {}
        if at + length > len(view):
            if opcode == Opcode.CHUNK and at + _CHUNK_TIMES.size <= len(view):
                chunk = _chunk_at(view, at, len(view) - at, cut=True)
            break
        if opcode == Opcode.CHUNK and length >= _CHUNK_TIMES.size:
            chunk = _chunk_at(view, at, length, cut=False)
        elif opcode == Opcode.MESSAGE_INDEX and length >= 6:
            indexes[int.from_bytes(view[at : at + 2], "little")] = at - _HEAD.size
        elif opcode == Opcode.MESSAGE and length >= _MESSAGE_FIXED:
            loose.add(at, length)
        elif opcode in (Opcode.DATA_END, Opcode.FOOTER):
            index.truncated = bytes(view[-len(MAGIC) :]) != MAGIC
            break
        else:
            _take_record(view, index, opcode, at, length)
    settle()
    index.segments += loose.segments()
    return index


def _chunk_at(view: memoryview, at: int, length: int, cut: bool) -> Segment:
    start_ns, end_ns = _CHUNK_TIMES.unpack_from(view, at)
    return Segment(at - _HEAD.size, _HEAD.size + length, start_ns, end_ns, cut=cut)


def _settled(view: memoryview, index: FileIndex, chunk: Segment, indexes: Mapping[int, int]) -> Segment:
    """``chunk`` with its message indexes; channels that it may announce are taken into ``index``."""
    if not indexes or not set(indexes) <= set(index.channels):
        try:
            data = memoryview(read_segment(view, chunk))
        except DamagedChunkError:
            return chunk  # it is met, and reported, again when its messages are read
        for opcode, at, length in records(data, 0, len(data)):
            _take_record(data, index, opcode, at, length)
    return Segment(chunk.offset, chunk.length, chunk.start_ns, chunk.end_ns, dict(indexes) or None, cut=chunk.cut)


def _take_record(view: memoryview, index: FileIndex, opcode: int, at: int, length: int) -> None:
    try:
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(_body(view, at, length))
            index.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(_body(view, at, length))
            index.channels[channel.id] = channel
        elif opcode == Opcode.METADATA:
            metadata = Metadata.read(_body(view, at, length))
            index.metadata[metadata.name] = metadata.metadata
        elif opcode == Opcode.ATTACHMENT:
            name_length = int.from_bytes(view[at + 16 : at + 20], "little")
            name = bytes(view[at + 20 : at + 20 + name_length]).decode()
            index.attachments[name] = (at - _HEAD.size, _HEAD.size + length)
    except _UNREADABLE:
        return  # a damaged record costs itself


class _LooseMessages:
    """Messages outside chunks, gathered in runs that can be read like chunks."""

    def __init__(self, view: memoryview) -> None:
        self._view = view
        self._runs: list[Segment] = []

    def add(self, at: int, length: int) -> None:
        log_ns = int.from_bytes(self._view[at + 6 : at + 14], "little")
        offset, end = at - _HEAD.size, at + length
        last = self._runs[-1] if self._runs else None
        if last is not None and last.offset + last.length == offset and last.length < _RUN_BYTES:
            start_ns, end_ns = min(last.start_ns, log_ns), max(last.end_ns, log_ns)
            self._runs[-1] = Segment(last.offset, end - last.offset, start_ns, end_ns, loose=True)
        else:
            self._runs.append(Segment(offset, end - offset, log_ns, log_ns, loose=True))

    def segments(self) -> list[Segment]:
        return self._runs
