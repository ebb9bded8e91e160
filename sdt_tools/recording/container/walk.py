"""A file's index by walking its records, for files without a summary.

A walk goes as far as the file does: what a crash or a full disk cut off at the end costs nothing before it. Where bytes
are no record, because one of its lengths is damaged, the walk goes on at the next one that is whole, and says so.
"""

import re
import struct
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from mcap.opcode import Opcode

from sdt_tools.recording.container.chunk import DamagedChunkError, Segment, read_segment, walk_messages
from sdt_tools.recording.container.file import MAGIC
from sdt_tools.recording.container.lengths import adds_up, chunk_fits, chunk_reaches_beyond
from sdt_tools.recording.container.records import HEAD, FileIndex, Gap, records, take_record

_TIMES: Final = struct.Struct("<QQ")
_INDEX_HEAD_BYTES: Final = HEAD.size + 6  # channel, length of the entries
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
        self._gap_is_open = False
        self._walk()
        self._settle()
        self.index.segments += self._loose.segments()

    def _walk(self) -> None:
        view = self._view
        ended = False
        before = at = len(MAGIC)
        while at + HEAD.size <= len(view):
            opcode, length = HEAD.unpack_from(view, at)
            body, end = at + HEAD.size, at + HEAD.size + length
            if not self._is_record(opcode, body, length):
                if opcode == Opcode.CHUNK and chunk_reaches_beyond(view, body, length):
                    self._cut(opcode, body)
                    break  # it is not searched for records: it is full of them
                found = self._next_record(at if self._is_vouched(before, at) else before + 1)
                if found is None:
                    self._cut(opcode, body)
                    break
                self._skip()
                before = at = found
                continue
            if opcode not in (Opcode.CHUNK, Opcode.MESSAGE) and self._is_chunk_by_another_name(body, length):
                opcode = Opcode.CHUNK
            if opcode != Opcode.MESSAGE_INDEX:
                self._settle()
            if opcode == Opcode.FOOTER:
                self.index.truncated = bytes(view[end : end + len(MAGIC)]) != MAGIC
                if end + len(MAGIC) < len(view):
                    self.index.harmless.append(f"{len(view) - end - len(MAGIC)} bytes follow its end")
                return
            ended = ended or opcode == Opcode.DATA_END
            self._take(opcode, body, length)
            before, at = at, end
        if ended and bytes(view[-len(MAGIC) :]) == MAGIC:
            self.index.truncated = False
            self.index.harmless.append("its footer is damaged")

    def _is_record(self, opcode: int, body: int, length: int) -> bool:
        """Whether a whole record stands here, as far as its head can tell."""
        end = body + length
        if opcode == 0 or end > len(self._view):
            return False
        if opcode == Opcode.FOOTER:  # what follows it is the magic, or what is left of that
            tail = bytes(self._view[end : end + len(MAGIC)])
            return tail == MAGIC or (end + len(MAGIC) > len(self._view) and MAGIC.startswith(tail))
        return opcode != Opcode.CHUNK or chunk_fits(self._view, body, length)

    def _is_chunk_by_another_name(self, body: int, length: int) -> bool:
        """Whether all but the kind of a record says that it is a chunk: its lengths, and a message index behind it."""
        end = body + length
        if end + HEAD.size > len(self._view) or self._view[end] != Opcode.MESSAGE_INDEX:
            return False
        _, index_length = HEAD.unpack_from(self._view, end)
        index_body = end + HEAD.size
        return (
            adds_up(self._view, Opcode.CHUNK, body, length)
            and index_body + index_length <= len(self._view)
            and adds_up(self._view, Opcode.MESSAGE_INDEX, index_body, index_length)
        )

    def _is_vouched(self, before: int, at: int) -> bool:
        """Whether the record before ``at`` is whole beyond doubt; else its length may be what is damaged."""
        if before == at:
            return True
        body = before + HEAD.size
        return adds_up(self._view, self._view[before], body, at - body)

    def _take(self, opcode: int, body: int, length: int) -> None:
        if opcode == Opcode.CHUNK:
            self._chunk = _chunk_at(self._view, body, length)
            self._end_gap(self._chunk.start_ns)
            self._last_ns = self._chunk.end_ns
        elif opcode == Opcode.MESSAGE_INDEX and length >= 6:
            channel_id = int.from_bytes(self._view[body : body + 2], "little")
            self._message_indexes[channel_id] = body - HEAD.size
        elif opcode == Opcode.MESSAGE and length >= _MESSAGE_FIXED:
            self._last_ns = self._loose.add(body, length)
            self._end_gap(self._last_ns)
        else:
            take_record(self._view, self.index, opcode, body, length)

    def _settle(self) -> None:
        """The chunk before is whole, with all its message indexes; indexes without a chunk tell what is lost."""
        if self._chunk is not None:
            self.index.segments.append(_settled(self._view, self.index, self._chunk, self._message_indexes))
        elif (times := _indexed_times(self._view, self._message_indexes)) is not None:
            self._note_gap(*times)
        self._chunk, self._message_indexes = None, {}

    def _cut(self, opcode: int, body: int) -> None:
        """The file ends here; of a chunk, what there is of it counts."""
        self._settle()
        if opcode == Opcode.CHUNK and body + _TIMES.size <= len(self._view):
            self._chunk = _chunk_at(self._view, body, len(self._view) - body, cut=True)

    def _skip(self) -> None:
        """Note that some bytes are no records: what they held lay between the message before and the one behind."""
        self._settle()
        self._note_gap(self._last_ns, self._last_ns)
        self._gap_is_open = True

    def _note_gap(self, start_ns: int, end_ns: int) -> None:
        gaps = self.index.gaps
        if gaps and self._gap_is_open:  # still the same one: nothing was read in between
            last = gaps.pop()
            start_ns, end_ns = min(last.start_ns or start_ns, start_ns or last.start_ns), max(last.end_ns, end_ns)
        gaps.append(Gap(start_ns, end_ns, "records between these times are unreadable"))

    def _end_gap(self, next_ns: int) -> None:
        """A message was read again."""
        if self._gap_is_open:
            self._note_gap(next_ns, next_ns)
        self._gap_is_open = False

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


def _chunk_at(view: memoryview, body: int, length: int, cut: bool = False) -> Segment:
    start_ns, end_ns = _TIMES.unpack_from(view, body)
    return Segment(body - HEAD.size, HEAD.size + length, start_ns, end_ns, cut=cut)


def _settled(view: memoryview, index: FileIndex, chunk: Segment, message_indexes: Mapping[int, int]) -> Segment:
    """``chunk``, its times vouched for by its message indexes or its messages; channels in it come into ``index``.

    It keeps no message indexes: nothing says that none of them is missing.
    """
    times = (chunk.start_ns, chunk.end_ns)
    known = not chunk.cut and set(message_indexes) <= set(index.channels)
    if known and _indexed_times(view, message_indexes) == times:
        return chunk
    try:
        data = memoryview(read_segment(view, chunk))
    except DamagedChunkError:
        return chunk  # it is met, and reported, again when its messages are read
    for opcode, body, length in records(data, 0, len(data)):
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            take_record(data, index, opcode, body, length)
    logged = [message.log_ns for message in walk_messages(data)]
    return replace(chunk, start_ns=min(logged), end_ns=max(logged)) if logged else chunk


def _indexed_times(view: memoryview, message_indexes: Mapping[int, int]) -> tuple[int, int] | None:
    """First and last log time by the message indexes; None where they have no entries."""
    times = []
    for at in message_indexes.values():
        entries_at = at + _INDEX_HEAD_BYTES
        length = min(int.from_bytes(view[entries_at - 4 : entries_at], "little"), len(view) - entries_at)
        found = np.frombuffer(view, "<u8", length // 16 * 2, entries_at)[::2]
        times += [int(found.min()), int(found.max())] if found.size else []
    return (min(times), max(times)) if times else None


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
