"""Recordings, read: streaming, a chunk at a time, whole or cut off or damaged."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Final

from isal.isal_zlib import crc32

from sdt_tools.errors import RecordingError
from sdt_tools.frames import Message, Received
from sdt_tools.recording.container.extents import Extent
from sdt_tools.recording.container.reader import Damage, McapReader, RawEntry
from sdt_tools.recording.frames import Frames
from sdt_tools.recording.messages.codec import decode
from sdt_tools.recording.messages.topics import LIDAR_SCAN, TOPIC_BY_NAME, TOPICS, Topic, is_ours
from sdt_tools.recording.series import ScanSeries, joined
from sdt_tools.recording.session import CONFIG_NAME, SESSION, STATS, derived_id
from sdt_tools.recording.summary import TopicSummary
from sdt_tools.recording.timing.pauses import Pauses, pauses_in
from sdt_tools.recording.timing.stamps import StampLog, read_stamps

ROS2: Final = "ros2"
"""The profile of an MCAP that is a ROS 2 bag."""
SCAN_BATCH: Final = 4096
"""Scans in a batch unless told otherwise: 18 MB."""
SCAN_MIN_BYTES: Final = 17
"""No scan of 541 doubles compresses to less: lz4, the tightest of what we write, packs at most 255 to 1."""


class Recording:
    """An MCAP file that holds topics of ours; topics of others are passed over.

    Raises RecordingError, saying what to do, for a path that is missing, not an MCAP, or without a topic of ours.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = McapReader(path)
        channels = self._file.channels
        self._ours = {
            number: channel
            for number, channel in channels.items()
            if is_ours(channel.topic, self._file.schema_name(channel), channel.message_encoding)
        }
        if not self._ours and not self.session:
            is_bag = self._file.header.profile == ROS2
            self.close()
            if self.truncated and not channels:
                raise RecordingError(f"{path}: was cut off before its first topic; nothing can be read of it")
            advice = "`sdt import ros2` makes a recording of the bag" if is_bag else "check that it is a recording"
            found = ", ".join(sorted({channel.topic for channel in channels.values()})) or "no topics at all"
            raise RecordingError(
                f"{path}: holds none of our topics ({', '.join(topic.name for topic in TOPICS[:2])} …) in our schemas; "
                f"it has {found}; {advice}"
            )

    @classmethod
    def open(cls, path: Path) -> "Recording":
        """The recording at ``path``; close it, or use it in a ``with`` statement, to let go of the file."""
        return cls(path)

    def close(self) -> None:
        """Let go of the file; may be called twice."""
        self._file.close()

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
        return self._file.size_bytes

    @property
    def truncated(self) -> bool:
        """Whether the file ends before its footer: a recording that was cut off, or is still being written."""
        return self._file.truncated

    @property
    def damage(self) -> tuple[Damage, ...]:
        """Stretches met so far that could not be read."""
        return self._file.damage

    @property
    def session(self) -> Mapping[str, str]:
        """The metadata ``sdt.session``; empty in files that others wrote."""
        return self._metadata(SESSION)

    @property
    def stats(self) -> Mapping[str, str]:
        """The metadata ``sdt.stats``; empty where the recording was cut off."""
        return self._metadata(STATS)

    @property
    def pauses(self) -> Pauses:
        """When nothing was recorded because somebody wanted it so; half-open, in host time."""
        return pauses_in(self._file)

    @property
    def recording_id(self) -> str:
        """The recording's UUID; for files without one, derived from how they begin."""
        return self._recording_id

    @cached_property
    def _recording_id(self) -> str:
        return recording_id_of(self._file)

    @property
    def config_toml(self) -> str:
        """The configuration that the recording was made with; empty where there is none."""
        found = [attached.data for attached in self._file.attachments() if attached.name == CONFIG_NAME]
        return found[-1].decode(errors="replace") if found else ""

    @cached_property
    def topics(self) -> Mapping[str, TopicSummary]:
        """What the recording holds, by topic, as its summary says it; counted where there is none."""
        extents = self._file.extents
        summaries: dict[str, TopicSummary] = {}
        for number, channel in self._ours.items():
            extent = extents.get(number, Extent())
            known = summaries.get(channel.topic)
            if known is not None and known.first_ns is not None and known.last_ns is not None:
                extent.add(known.count, known.first_ns, known.last_ns)
            schema = self._file.schema_name(channel)
            summaries[channel.topic] = TopicSummary(
                channel.topic, schema, extent.count, extent.first_ns, extent.last_ns
            )
        return dict(sorted(summaries.items()))

    @property
    def schemas(self) -> Mapping[str, str]:
        """The schema of each of our topics in the file, whether or not it has messages."""
        return {channel.topic: self._file.schema_name(channel) for channel in self._ours.values()}

    @property
    def counted(self) -> bool:
        """Whether the file itself says what it holds; else only its messages do."""
        return self._file.counts is not None

    def stamps(self) -> StampLog:
        """When all messages of our topics were taken and received: streams through the file and decodes nothing."""
        return read_stamps(self._file, {number: channel.topic for number, channel in self._ours.items()})

    def frames(self, topic: str) -> Frames:
        """The messages of ``topic``, each to be read by itself, whatever their number and the size of the file."""
        schema = self.schemas.get(topic, "")
        return Frames(self._file, topic, schema, self._numbers((topic,)))

    @property
    def foreign_counts(self) -> Mapping[str, int]:
        """Messages of topics that are passed over, by topic."""
        counts: Counter[str] = Counter()
        for number, channel in self._file.channels.items():
            if number not in self._ours:
                counts[channel.topic] += self._file.extents[number].count
        return dict(sorted(counts.items()))

    @property
    def foreign_topics(self) -> tuple[str, ...]:
        """Topics in the file that are passed over."""
        return tuple(sorted({c.topic for number, c in self._file.channels.items() if number not in self._ours}))

    def messages(
        self, topics: Collection[str] | None = None, start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[Received]:
        """Messages of ``topics`` (all of ours without) received in ``[start_ns, end_ns)``, in order of receipt.

        One that does not parse is left out, and named in ``damage``.
        """
        for entry in self._file.entries(self._numbers(topics), start_ns, end_ns):
            message = decoded(self._file, entry)
            if message is not None:
                yield Received(entry.log_ns, message)

    def entries(
        self, topics: Collection[str] | None = None, start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[tuple[Topic, RawEntry]]:
        """The same, not decoded: whoever finds one that does not parse calls ``lose``."""
        for entry in self._file.entries(self._numbers(topics), start_ns, end_ns):
            yield TOPIC_BY_NAME[self._ours[entry.channel_id].topic], entry

    def lose(self, topic: Topic, entry: RawEntry) -> None:
        """Name in ``damage`` a message of ``topic`` that does not parse."""
        self._file.lose(entry.offset, entry.start, entry.log_ns, not_valid(topic.name, topic.schema))

    def scans(self) -> ScanSeries:
        """All scans as one series, 4.3 kB a scan, in order of receipt; no scans make an empty series.

        A message that is no scan is left out, and named in ``damage``. Raises RecordingError where a scan has another
        number of rays than 541, unless it lies among others in a chunk that no checksum vouches for: that is damage.
        """
        return joined(list(self.scan_batches(self._expected_scans() or SCAN_BATCH)))

    def scan_batches(self, size: int = SCAN_BATCH) -> Iterator[ScanSeries]:
        """The same in batches of ``size``, the last one smaller; one batch and one chunk are in memory at a time."""
        # numba takes most of a second to import, and only arrays of scans need it
        from sdt_tools.recording.scans import scan_batches

        return scan_batches(self._file, self._numbers((LIDAR_SCAN,)), size)

    def _metadata(self, name: str) -> Mapping[str, str]:
        found = [record.metadata for record in self._file.metadata if record.name == name]
        return found[-1] if found else {}

    def _numbers(self, topics: Collection[str] | None) -> frozenset[int]:
        return frozenset(n for n, channel in self._ours.items() if topics is None or channel.topic in topics)

    def _expected_scans(self) -> int:
        """The number of scans if the summary says it, and the file can hold as many: room is made for them."""
        counts = self._file.counts or {}
        count = sum(counts.get(number, 0) for number in self._numbers((LIDAR_SCAN,)))
        return count if count * SCAN_MIN_BYTES <= self.size_bytes else 0


def decoded(file: McapReader, entry: RawEntry) -> Message | None:
    """The message in ``entry``, on a topic of ours; None, and named in the damage of ``file``, where it is damaged."""
    channel = file.channels[entry.channel_id]
    schema = file.schema_name(channel)
    try:
        return decode(channel.topic, schema, entry.data, entry.publish_ns)
    except RecordingError:
        file.lose(entry.offset, entry.start, entry.log_ns, not_valid(channel.topic, schema))
        return None


def not_valid(topic: str, schema: str) -> str:
    """The reason by which damaged messages are named in a file's damage."""
    return f"messages on {topic} that are not a valid {schema}"


def recording_id_of(file: McapReader) -> str:
    """The UUID of the recording in ``file``, as ``Recording.recording_id`` has it, whatever topics are in it."""
    said = [record.metadata.get("recording_id", "") for record in file.metadata if record.name == SESSION]
    return (said[-1] if said else "") or derived_id("foreign", str(file.size_bytes), str(crc32(file.beginning)))
