"""Recordings, read: streaming, from memory-mapped files, a chunk at a time.

Whole files are read by their summary, files that were cut off as far as they go (``truncated``). A chunk that is
damaged costs itself: what it held is missing, the rest is read, and ``damage`` names the interval.
"""

import contextlib
import logging
import mmap
import zlib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Final, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.records import Attachment

from sdt_tools.errors import RecordingError
from sdt_tools.frames import Received
from sdt_tools.recording.chunk import DamagedChunkError, Segment, read_segment, walk_messages
from sdt_tools.recording.codec import decode
from sdt_tools.recording.container import MAGIC
from sdt_tools.recording.index import FileIndex, read_index
from sdt_tools.recording.series import ScanSeries, joined
from sdt_tools.recording.session import CONFIG_NAME, SESSION, STATS, derived_id
from sdt_tools.recording.summary import Extent, TopicSummary, indexed_extents
from sdt_tools.recording.topics import LIDAR_SCAN, TOPICS, is_ours

_RECORD_HEAD_BYTES: Final = 9
_log = logging.getLogger(__name__)
SCAN_BATCH: Final = 4096
"""Scans in a batch unless told otherwise: 18 MB."""
SCAN_MIN_BYTES: Final = 17
"""No scan of 541 doubles compresses to less: lz4, the tightest of what we write, packs at most 255 to 1."""


@dataclass(frozen=True)
class Damage:
    """An interval of log time, both ends inclusive, in which messages are lost, and why."""

    start_ns: int
    end_ns: int
    reason: str


class _Entry(NamedTuple):
    log_ns: int
    offset: int
    start: int
    end: int
    publish_ns: int
    channel_id: int
    data: bytes | memoryview


class Recording:
    """An MCAP file that holds topics of ours; topics of others are passed over.

    Raises RecordingError, saying what to do, for a path that is missing, not an MCAP, or without a topic of ours.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._map = _map_file(path)
        self._view = memoryview(self._map)
        self._damage: dict[int, Damage] = {}
        self._index: FileIndex = read_index(self._view)
        channels = self._index.channels
        self._ours = {
            number: channel
            for number, channel in channels.items()
            if is_ours(channel.topic, self._index.schema_name(channel), channel.message_encoding)
        }
        if not self._ours and SESSION not in self._index.metadata:
            self.close()
            found = ", ".join(sorted({channel.topic for channel in channels.values()})) or "no topics at all"
            raise RecordingError(
                f"{path}: holds none of our topics ({', '.join(topic.name for topic in TOPICS[:2])} …) in our schemas; "
                f"it has {found}; check that it is a recording"
            )

    @classmethod
    def open(cls, path: Path) -> "Recording":
        """The recording at ``path``; close it, or use it in a ``with`` statement, to let go of the file."""
        return cls(path)

    def close(self) -> None:
        """Let go of the file; may be called twice."""
        self._view.release()
        with contextlib.suppress(BufferError):  # an iterator still holds a chunk: the map goes when the iterator does
            self._map.close()

    def __enter__(self) -> "Recording":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    @property
    def stem(self) -> str:
        """The file's name without its ending, by which its labels are found."""
        return self.path.stem

    @property
    def size_bytes(self) -> int:
        """The file's size."""
        return len(self._view)

    @property
    def truncated(self) -> bool:
        """Whether the file ends before its footer: a recording that was cut off, or is still being written."""
        return self._index.truncated

    @property
    def damage(self) -> tuple[Damage, ...]:
        """Chunks met so far that could not be read."""
        return tuple(self._damage.values())

    @property
    def session(self) -> Mapping[str, str]:
        """The metadata ``sdt.session``; empty in files that others wrote."""
        return self._index.metadata.get(SESSION, {})

    @property
    def stats(self) -> Mapping[str, str]:
        """The metadata ``sdt.stats``; empty where the recording was cut off."""
        return self._index.metadata.get(STATS, {})

    @property
    def recording_id(self) -> str:
        """The recording's UUID; for files without one, derived from how they begin."""
        return self.session.get("recording_id") or self._derived_id

    @cached_property
    def _derived_id(self) -> str:
        return derived_id("foreign", str(len(self._view)), str(zlib.crc32(self._view[: 1 << 20])))

    @property
    def config_toml(self) -> str:
        """The configuration that the recording was made with; empty where there is none."""
        place = self._index.attachments.get(CONFIG_NAME)
        if place is None:
            return ""
        offset, length = place
        record = ReadDataStream(BytesIO(self._view[offset + _RECORD_HEAD_BYTES : offset + length]))
        config: bytes = Attachment.read(record).data
        return config.decode(errors="replace")

    @cached_property
    def topics(self) -> Mapping[str, TopicSummary]:
        """What the recording holds, by topic, as its summary says it; counted where there is none."""
        extents = self._extents()
        summaries: dict[str, TopicSummary] = {}
        for number, channel in self._ours.items():
            extent = extents.get(number, Extent())
            known = summaries.get(channel.topic)
            if known is not None and known.first_ns is not None and known.last_ns is not None:
                extent.add(known.count, known.first_ns, known.last_ns)
            schema = self._index.schema_name(channel)
            summaries[channel.topic] = TopicSummary(
                channel.topic, schema, extent.count, extent.first_ns, extent.last_ns
            )
        return dict(sorted(summaries.items()))

    @property
    def foreign_topics(self) -> tuple[str, ...]:
        """Topics in the file that are passed over."""
        return tuple(sorted({c.topic for number, c in self._index.channels.items() if number not in self._ours}))

    def messages(
        self, topics: Collection[str] | None = None, start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[Received]:
        """Messages of ``topics`` (all of ours without) received in ``[start_ns, end_ns)``, in order of receipt.

        Raises RecordingError for a message that does not parse.
        """
        for entry in self._ordered(self._numbers(topics), start_ns, end_ns):
            channel = self._ours[entry.channel_id]
            data = bytes(entry.data[entry.start : entry.end])
            yield Received(
                entry.log_ns, decode(channel.topic, self._index.schema_name(channel), data, entry.publish_ns)
            )

    def scans(self) -> ScanSeries:
        """All scans as one series, 4.3 kB a scan, in order of receipt; no scans make an empty series.

        Raises RecordingError where a scan has another number of rays than 541.
        """
        return joined(list(self.scan_batches(self._expected_scans() or SCAN_BATCH)))

    def scan_batches(self, size: int = SCAN_BATCH) -> Iterator[ScanSeries]:
        """The same in batches of ``size``, the last one smaller; one batch and one chunk are in memory at a time."""
        # numba takes most of a second to import, and only arrays of scans need it
        from sdt_tools.recording.scans import batches_from_chunks, batches_from_messages

        wanted = self._numbers((LIDAR_SCAN,))
        segments = self._segments(wanted, None, None)
        if any(later.start_ns < earlier.end_ns for earlier, later in pairwise(segments)):
            return batches_from_messages(self.messages((LIDAR_SCAN,)), size, self.path)
        chunks = (data for segment in segments if (data := self._unpacked(segment)) is not None)
        return batches_from_chunks(chunks, wanted, size, self.path)

    def _numbers(self, topics: Collection[str] | None) -> frozenset[int]:
        return frozenset(n for n, channel in self._ours.items() if topics is None or channel.topic in topics)

    def _expected_scans(self) -> int:
        """The number of scans if the summary says it, and the file can hold as many: room is made for them."""
        counts = self._index.counts or {}
        count = sum(counts.get(number, 0) for number in self._numbers((LIDAR_SCAN,)))
        return count if count * SCAN_MIN_BYTES <= self.size_bytes else 0

    def _extents(self) -> dict[int, Extent]:
        counts = self._index.counts
        if counts is not None:
            ours = {number: counts.get(number, 0) for number in self._ours}
            indexed = indexed_extents(self._view, self._index.segments, ours)
            if indexed is not None:
                return indexed
        counted: dict[int, Extent] = {number: Extent() for number in self._ours}
        for segment in self._segments(frozenset(self._ours), None, None):
            for raw in walk_messages(self._unpacked(segment) or b""):
                if raw.channel_id in counted:
                    counted[raw.channel_id].add(1, raw.log_ns, raw.log_ns)
        return counted

    def _ordered(self, wanted: frozenset[int], start_ns: int | None, end_ns: int | None) -> Iterator[_Entry]:
        segments = self._segments(wanted, start_ns, end_ns)
        pending: list[_Entry] = []
        for segment in segments:
            ready = 0
            while ready < len(pending) and pending[ready].log_ns < segment.start_ns:
                ready += 1
            yield from pending[:ready]
            pending = pending[ready:]
            pending += self._entries(segment, wanted, start_ns, end_ns)
            pending.sort()
        yield from pending

    def _entries(
        self, segment: Segment, wanted: frozenset[int], start_ns: int | None, end_ns: int | None
    ) -> Iterator[_Entry]:
        data = self._unpacked(segment)
        if data is None:
            return
        for raw in walk_messages(data):
            if raw.channel_id in wanted and _within(raw.log_ns, start_ns, end_ns):
                yield _Entry(raw.log_ns, segment.offset, raw.start, raw.end, raw.publish_ns, raw.channel_id, data)

    def _segments(self, wanted: frozenset[int], start_ns: int | None, end_ns: int | None) -> list[Segment]:
        chosen = [
            segment
            for segment in self._index.segments
            if segment.may_hold(wanted)
            and (start_ns is None or segment.end_ns >= start_ns)
            and (end_ns is None or segment.start_ns < end_ns)
        ]
        return sorted(chosen, key=lambda segment: (segment.start_ns, segment.offset))

    def _unpacked(self, segment: Segment) -> bytes | memoryview | None:
        try:
            return read_segment(self._view, segment)
        except DamagedChunkError as error:
            if segment.offset not in self._damage:
                self._damage[segment.offset] = Damage(segment.start_ns, segment.end_ns, str(error))
                _log.warning(
                    "%s: a chunk is damaged: %s; messages from %d to %d ns are lost",
                    self.path,
                    error,
                    segment.start_ns,
                    segment.end_ns,
                )
            return None


def _within(log_ns: int, start_ns: int | None, end_ns: int | None) -> bool:
    return (start_ns is None or log_ns >= start_ns) and (end_ns is None or log_ns < end_ns)


def _map_file(path: Path) -> mmap.mmap:
    try:
        with path.open("rb") as file:
            head = file.read(len(MAGIC))
            if not head:
                raise RecordingError(f"{path}: is empty; nothing was recorded")
            if head != MAGIC:
                raise RecordingError(f"{path}: not an MCAP file; `sdt import` reads other formats")
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such recording; check the path") from None
    except IsADirectoryError:
        raise RecordingError(f"{path}: is a folder; name the .mcap file in it") from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from None
