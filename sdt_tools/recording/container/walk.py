"""A file's index by walking its records, for files without a summary.

A walk goes as far as the file does: what a crash or a full disk cut off at the end costs nothing before it. Where bytes
are no record, because one of its lengths is damaged, the walk goes on at the next one that is whole, and says so.
"""

import re
import struct
from collections.abc import Mapping
from typing import Final

from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema

from sdt_tools.recording.container.chunk import MAX_CHUNK_BYTES, DamagedChunkError, Segment, read_segment
from sdt_tools.recording.container.file import MAGIC
from sdt_tools.recording.container.records import HEAD, UNREADABLE, FileIndex, Gap, body_of, records

_CHUNK_HEAD: Final = struct.Struct("<QQQII")
_CHUNK_FIXED: Final = _CHUNK_HEAD.size + 8  # and the name of the compression
_MESSAGE_FIXED: Final = 22
_RUN_BYTES: Final = 1 << 20
_KNOWN: Final = frozenset(Opcode)
_RECORD: Final = re.compile(rb"[\x01-\x0f](?=.{4}\0{4})", re.DOTALL)
_CHAIN: Final = 3
"""So many records in a row are no coincidence; nor is a chunk, whose lengths have to agree."""


def walk(view: memoryview) -> FileIndex:
    """The index of the MCAP file whose bytes are ``view``: ``truncated`` where it has no end."""
    return _Walk(view).index


class _Walk:
    """One walk from the magic to the end."""

    def __init__(self, view: memoryview) -> None:
        self.index = FileIndex(truncated=True)
        self._view = view
        self._chunk: Segment | None = None
        self._message_indexes: dict[int, int] = {}
        self._loose = _LooseMessages(view)
        self._last_ns = 0
        before = at = len(MAGIC)
        while at + HEAD.size <= len(view):
            opcode, length = HEAD.unpack_from(view, at)
            body, end = at + HEAD.size, at + HEAD.size + length
            if not self._is_record(opcode, body, length):
                # the length of the record before may be what is damaged; a chunk's has been checked
                found = self._next_record(at if view[before] == Opcode.CHUNK else before + 1)
                if found is None:
                    self._cut(opcode, body)
                    break
                self._skip(found)
                before = at = found
                continue
            if opcode != Opcode.MESSAGE_INDEX:
                self._settle()
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                self.index.truncated = bytes(view[-len(MAGIC) :]) != MAGIC
                break
            self._take(opcode, body, length)
            before, at = at, end
        self._settle()
        self.index.segments += self._loose.segments()

    def _is_record(self, opcode: int, body: int, length: int) -> bool:
        """Whether a whole record stands here, as far as its head can tell."""
        if opcode == 0 or body + length > len(self._view):
            return False
        return opcode != Opcode.CHUNK or _chunk_fits(self._view, body, length)

    def _take(self, opcode: int, body: int, length: int) -> None:
        if opcode == Opcode.CHUNK:
            self._chunk = _chunk_at(self._view, body, length)
            self._last_ns = self._chunk.end_ns
        elif opcode == Opcode.MESSAGE_INDEX and length >= 6:
            channel_id = int.from_bytes(self._view[body : body + 2], "little")
            self._message_indexes[channel_id] = body - HEAD.size
        elif opcode == Opcode.MESSAGE and length >= _MESSAGE_FIXED:
            self._last_ns = self._loose.add(body, length)
        else:
            _take_record(self._view, self.index, opcode, body, length)

    def _settle(self) -> None:
        """The chunk before is whole, with all its message indexes."""
        if self._chunk is not None:
            self.index.segments.append(_settled(self._view, self.index, self._chunk, self._message_indexes))
        self._chunk, self._message_indexes = None, {}

    def _cut(self, opcode: int, body: int) -> None:
        """The file ends here; of a chunk, what there is of it counts."""
        self._settle()
        if opcode == Opcode.CHUNK and body + _CHUNK_HEAD.size <= len(self._view):
            self._chunk = _chunk_at(self._view, body, len(self._view) - body, cut=True)

    def _skip(self, found: int) -> None:
        """Note that nothing could be read up to ``found``."""
        self._settle()
        opcode, _ = HEAD.unpack_from(self._view, found)
        times_at = found + HEAD.size + (6 if opcode == Opcode.MESSAGE else 0)
        next_ns = self._last_ns
        if opcode in (Opcode.CHUNK, Opcode.MESSAGE):
            next_ns = int.from_bytes(self._view[times_at : times_at + 8], "little")
        first_ns = min(self._last_ns or next_ns, next_ns)
        self.index.gaps.append(Gap(first_ns, next_ns, "records between these times are unreadable"))

    def _next_record(self, start: int) -> int | None:
        """Where from ``start`` on records go on: the first of some that follow each other."""
        for match in _RECORD.finditer(self._view, start):
            if self._is_chain(match.start()):
                return match.start()
        return None

    def _is_chain(self, at: int) -> bool:
        """Whether some records in a row stand here, or a chunk or the footer among the first of them."""
        for _ in range(_CHAIN):
            if at + HEAD.size > len(self._view):
                return False
            opcode, length = HEAD.unpack_from(self._view, at)
            if opcode not in _KNOWN or not self._is_record(opcode, at + HEAD.size, length):
                return False
            if opcode in (Opcode.CHUNK, Opcode.FOOTER):
                return True
            at += HEAD.size + length
        return True


def _chunk_fits(view: memoryview, body: int, length: int) -> bool:
    """Whether the lengths in a chunk's head agree with each other."""
    if length < _CHUNK_FIXED:
        return False
    start_ns, end_ns, size, _, name_length = _CHUNK_HEAD.unpack_from(view, body)
    data_length_at = body + _CHUNK_HEAD.size + name_length
    if start_ns > end_ns or size > MAX_CHUNK_BYTES or _CHUNK_FIXED + name_length > length:
        return False
    data_length = int.from_bytes(view[data_length_at : data_length_at + 8], "little")
    return bool(_CHUNK_FIXED + name_length + data_length == length)


def _chunk_at(view: memoryview, body: int, length: int, cut: bool = False) -> Segment:
    start_ns, end_ns, *_ = _CHUNK_HEAD.unpack_from(view, body)
    return Segment(body - HEAD.size, HEAD.size + length, start_ns, end_ns, cut=cut)


def _settled(view: memoryview, index: FileIndex, chunk: Segment, message_indexes: Mapping[int, int]) -> Segment:
    """``chunk`` with its message indexes; channels that it may announce are taken into ``index``."""
    if not message_indexes or not set(message_indexes) <= set(index.channels):
        try:
            data = memoryview(read_segment(view, chunk))
        except DamagedChunkError:
            return chunk  # it is met, and reported, again when its messages are read
        for opcode, body, length in records(data, 0, len(data)):
            _take_record(data, index, opcode, body, length)
    offsets = dict(message_indexes) or None
    return Segment(chunk.offset, chunk.length, chunk.start_ns, chunk.end_ns, offsets, cut=chunk.cut)


def _take_record(view: memoryview, index: FileIndex, opcode: int, body: int, length: int) -> None:
    try:
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(body_of(view, body, length))
            index.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(body_of(view, body, length))
            index.channels[channel.id] = channel
        elif opcode == Opcode.METADATA:
            index.metadata.append(Metadata.read(body_of(view, body, length)))
        elif opcode == Opcode.ATTACHMENT:
            index.attachments.append((body - HEAD.size, HEAD.size + length))
    except UNREADABLE:
        return  # a damaged record costs itself


class _LooseMessages:
    """Messages outside chunks, gathered in runs that can be read like chunks."""

    def __init__(self, view: memoryview) -> None:
        self._view = view
        self._runs: list[Segment] = []

    def add(self, body: int, length: int) -> int:
        """Take in a message; its log time."""
        log_ns = int.from_bytes(self._view[body + 6 : body + 14], "little")
        offset, end = body - HEAD.size, body + length
        last = self._runs[-1] if self._runs else None
        if last is not None and last.offset + last.length == offset and last.length < _RUN_BYTES:
            start_ns, end_ns = min(last.start_ns, log_ns), max(last.end_ns, log_ns)
            self._runs[-1] = Segment(last.offset, end - last.offset, start_ns, end_ns, loose=True)
        else:
            self._runs.append(Segment(offset, end - offset, log_ns, log_ns, loose=True))
        return log_ns

    def segments(self) -> list[Segment]:
        """The runs so far."""
        return self._runs
