"""An MCAP file of anyone's, read: streaming, memory-mapped, a chunk at a time.

Whole files are read by their summary, files that were cut off as far as they go (``truncated``). A chunk that is
damaged costs itself: what it held is missing, the rest is read, and ``damage`` names the interval. So does a message
that is damaged, where whoever knows what it means says so (``lose``).
"""

import contextlib
import logging
import mmap
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

from mcap.records import Attachment, Channel, Header, Metadata, Schema

from sdt_tools.errors import RecordingError
from sdt_tools.recording.container.attachments import read_attachment
from sdt_tools.recording.container.chunk import (
    DamagedChunkError,
    RawMessage,
    Segment,
    ends_within_a_record,
    is_checked,
    read_segment,
    walk_messages,
)
from sdt_tools.recording.container.extents import Extent, indexed_extents
from sdt_tools.recording.container.file import MAGIC
from sdt_tools.recording.container.index import read_index
from sdt_tools.recording.container.places import Places, Unpack, find_places, message_data
from sdt_tools.recording.container.records import HEAD, FileIndex

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Damage:
    """An interval of log time, both ends inclusive, in which messages are lost, and why."""

    start_ns: int
    end_ns: int
    reason: str

    @property
    def text(self) -> str:
        """The same for people; what costs no message has no interval."""
        if not self.end_ns:
            return self.reason
        return f"lost from {self.start_ns} to {self.end_ns} ns: {self.reason}"


class RawEntry(NamedTuple):
    """A message as it lies in the file. Entries sort by log time, then by their place in the file."""

    log_ns: int
    offset: int
    start: int
    end: int
    publish_ns: int
    channel_id: int
    chunk: bytes | memoryview

    @property
    def data(self) -> bytes:
        """A copy of what the message holds."""
        return bytes(self.chunk[self.start : self.end])


class McapReader:
    """The records of an MCAP file, whatever they mean; close it, or use it in a ``with`` statement.

    Raises RecordingError, saying what to do, for a path that is missing or not an MCAP.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._map = _map_file(path)
        self._view = memoryview(self._map)
        self._damage: dict[tuple[int, str], Damage] = {}
        self._lost: dict[tuple[int, str], dict[int, int]] = {}
        self._index: FileIndex = read_index(self._view)

    def close(self) -> None:
        """Let go of the file; may be called twice."""
        self._view.release()
        with contextlib.suppress(BufferError):  # an iterator still holds a chunk: the map goes when the iterator does
            self._map.close()

    def __enter__(self) -> "McapReader":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    @property
    def size_bytes(self) -> int:
        """The file's size."""
        return len(self._view)

    @property
    def beginning(self) -> memoryview:
        """The file's first megabyte."""
        return self._view[: 1 << 20]

    @property
    def header(self) -> Header:
        """The profile that the file keeps to and the library that wrote it; empty where it does not say."""
        return self._index.header

    @property
    def truncated(self) -> bool:
        """Whether the file ends before its footer: a recording that was cut off, or is still being written."""
        return self._index.truncated

    @property
    def damage(self) -> tuple[Damage, ...]:
        """Stretches met so far that could not be read, in the order of their time."""
        skipped = [Damage(gap.start_ns, gap.end_ns, gap.reason) for gap in self._index.gaps]
        if bytes(self._view[: len(MAGIC)]) != MAGIC:
            skipped.append(_harmless("the file's first bytes are not those of an MCAP"))
        skipped += map(_harmless, self._index.harmless)
        for (_, reason), lost in self._lost.items():
            skipped.append(Damage(min(lost.values()), max(lost.values()), f"{len(lost)} {reason}"))
        return tuple(sorted([*skipped, *self._damage.values()], key=lambda damage: damage.start_ns))

    @property
    def channels(self) -> Mapping[int, Channel]:
        """The file's channels by number."""
        return self._index.channels

    @property
    def metadata(self) -> tuple[Metadata, ...]:
        """The metadata records in the order of the file; a name may come more than once."""
        return tuple(self._index.metadata)

    @property
    def counts(self) -> Mapping[int, int] | None:
        """Messages by channel, as the summary says; None where only counting would tell."""
        return self._index.counts

    def schema(self, channel: Channel) -> Schema | None:
        """The schema of ``channel``, where it has one."""
        return self._index.schemas.get(channel.schema_id)

    def schema_name(self, channel: Channel) -> str:
        """The name of the schema of ``channel``; empty where it has none."""
        schema = self.schema(channel)
        return "" if schema is None else schema.name

    def attachments(self) -> Iterator[Attachment]:
        """The attachments in the order of the file; those that are damaged are left out and named in ``damage``."""
        for offset, length in self._index.attachments:
            attachment = read_attachment(self._view[offset + HEAD.size : offset + length])
            if attachment is None:
                self._note(offset, "an attachment is damaged and left out", 0, 0)
            else:
                yield attachment

    @cached_property
    def extents(self) -> Mapping[int, Extent]:
        """Number, first and last log time of the messages of each channel."""
        if self._index.counts is not None:
            counts = {number: self._index.counts.get(number, 0) for number in self.channels}
            indexed = indexed_extents(self._view, self._index.segments, counts)
            if indexed is not None:
                return indexed
        counted = {number: Extent() for number in self.channels}
        for segment in self.segments():
            strangers = []
            for raw in walk_messages(self.unpacked(segment) or b""):
                if raw.channel_id in counted:
                    counted[raw.channel_id].add(1, raw.log_ns, raw.log_ns)
                else:
                    strangers.append(raw)
            self._note_strangers(segment, strangers)
        return counted

    def entries(
        self, channel_ids: Set[int] | None = None, start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[RawEntry]:
        """Messages of some channels (of all without) logged in ``[start_ns, end_ns)``, in the order of their log time.

        Messages of a channel that the file does not announce are left out, and named in ``damage``.
        """
        wanted = frozenset(self.channels if channel_ids is None else channel_ids)
        pending: list[RawEntry] = []
        for segment in self.segments(wanted, start_ns, end_ns):
            ready = 0
            while ready < len(pending) and pending[ready].log_ns < segment.start_ns:
                ready += 1
            yield from pending[:ready]
            pending = pending[ready:]
            pending += self._entries(segment, wanted, start_ns, end_ns)
            pending.sort()
        yield from pending

    def segments(
        self, channel_ids: Set[int] | None = None, start_ns: int | None = None, end_ns: int | None = None
    ) -> list[Segment]:
        """Stretches of the file that may hold such messages, in the order of the time at which they begin."""
        chosen = [
            segment
            for segment in self._index.segments
            if (channel_ids is None or segment.may_hold(channel_ids))
            and (start_ns is None or segment.end_ns >= start_ns)
            and (end_ns is None or segment.start_ns < end_ns)
        ]
        return sorted(chosen, key=lambda segment: (segment.start_ns, segment.offset))

    def places(self, channel_ids: Set[int]) -> Places:
        """Where the messages of some channels lie, and when they were taken."""
        return find_places(self._view, self.segments(channel_ids), channel_ids, self.unpacked)

    def data_at(self, places: Places, row: int, unpack: Unpack) -> bytes | None:
        """What message ``row`` of ``places`` holds; None where its chunk, opened by ``unpack``, is damaged."""
        return message_data(self._view, places.segments[int(places.owners[row])], int(places.starts[row]), unpack)

    def unpacked(self, segment: Segment) -> bytes | memoryview | None:
        """The records in ``segment``; None, a warning, and an entry in ``damage`` where they cannot be had."""
        try:
            data = read_segment(self._view, segment)
        except DamagedChunkError as error:
            self._note(segment.offset, str(error), segment.start_ns, segment.end_ns)
            return None
        if ends_within_a_record(self._view, segment, data):
            reason = "a record in it is longer than it is; what follows that record is lost"
            self._note(segment.offset, reason, segment.start_ns, segment.end_ns)
        return data

    def is_checked(self, offset: int) -> bool:
        """Whether a checksum vouches for what is read of the segment at ``offset``."""
        return is_checked(self._view, offset)

    def lose(self, offset: int, place: int, log_ns: int, reason: str) -> None:
        """Name in ``damage`` a message that was found and is not what it should be; it counts once, however often read.

        It begins at ``place`` in the segment at ``offset``; ``reason`` says in the plural what such messages are.
        """
        lost = self._lost.setdefault((offset, reason), {})
        if not lost:
            _log.warning("%s: damaged at byte %d: %s; the first at %d ns", self.path, offset, reason, log_ns)
        lost[place] = log_ns

    def _entries(
        self, segment: Segment, wanted: frozenset[int], start_ns: int | None, end_ns: int | None
    ) -> Iterator[RawEntry]:
        data = self.unpacked(segment)
        if data is None:
            return
        strangers = []
        for raw in walk_messages(data):
            if raw.channel_id in wanted:
                if _within(raw.log_ns, start_ns, end_ns):
                    yield RawEntry(raw.log_ns, segment.offset, raw.start, raw.end, raw.publish_ns, raw.channel_id, data)
            elif raw.channel_id not in self.channels:
                strangers.append(raw)
        self._note_strangers(segment, strangers)

    def _note_strangers(self, segment: Segment, strangers: list[RawMessage]) -> None:
        """Messages that belong to nothing: the announcement of their channel, or their number, is damaged."""
        if strangers:
            times = [raw.log_ns for raw in strangers]
            reason = f"{len(strangers)} messages of channels that the file does not announce"
            self._note(segment.offset, reason, min(times), max(times))

    def _note(self, offset: int, reason: str, start_ns: int, end_ns: int) -> None:
        if (offset, reason) in self._damage:
            return
        self._damage[offset, reason] = Damage(start_ns, end_ns, reason)
        _log.warning("%s: damaged at byte %d: %s; times %d to %d ns", self.path, offset, reason, start_ns, end_ns)


def overlapping(segments: list[Segment]) -> bool:
    """Whether some of these, which are in the order of their beginning, overlap in time."""
    return any(later.start_ns < earlier.end_ns for earlier, later in pairwise(segments))


def _harmless(reason: str) -> Damage:
    return Damage(0, 0, f"{reason}; nothing is lost by that")


def _within(log_ns: int, start_ns: int | None, end_ns: int | None) -> bool:
    return (start_ns is None or log_ns >= start_ns) and (end_ns is None or log_ns < end_ns)


def _nearly_magic(head: bytes) -> bool:
    """Whether these are an MCAP's first bytes, one of them damaged at most."""
    return len(head) == len(MAGIC) and sum(a != b for a, b in zip(head, MAGIC, strict=True)) <= 1


def _map_file(path: Path) -> mmap.mmap:
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            raise RecordingError(f"{path}: is not a file that can be read twice; name a recording on a disk")
        with path.open("rb") as file:
            head = file.read(len(MAGIC))
            if not head:
                raise RecordingError(f"{path}: is empty; nothing was recorded")
            if not _nearly_magic(head):
                raise RecordingError(f"{path}: not an MCAP file; `sdt import` reads other formats")
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such recording; check the path") from None
    except IsADirectoryError:
        raise RecordingError(f"{path}: is a folder; name the .mcap file in it") from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from None
