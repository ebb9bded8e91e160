"""Messages on their way out of a recording and into one: in their protobuf, with both of their times.

They are carried in protobuf, not in the words of ``frames``, so that what is not ours to interpret (the height of a
pose, the distortion of a lens) arrives as it left, to the bit.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

from google.protobuf.message import DecodeError

from sdt_tools.clock import SECOND_NS
from sdt_tools.recording.container.file import McapFile
from sdt_tools.recording.container.reader import Damage, McapReader
from sdt_tools.recording.exchange.about import About
from sdt_tools.recording.messages.schemas import message_class, schema_data
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, TOPIC_BY_NAME, Topic, is_ours
from sdt_tools.recording.reader import Recording, not_valid
from sdt_tools.recording.session import CONFIG_MEDIA_TYPE, CONFIG_NAME, SESSION, STATS


class Carried(NamedTuple):
    """One message: its topic in a recording, when it was received and taken, and its protobuf."""

    topic: Topic
    received_ns: int
    stamp_ns: int
    message: Any


class Outgoing:
    """A recording to be carried elsewhere; use it in a ``with`` statement.

    Raises RecordingError for a path that is no recording.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with Recording.open(path) as recording:
            self.about = About(recording.session, recording.stats, recording.config_toml)
            self.topics = {name: topic.count for name, topic in recording.topics.items() if topic.count}
            """Messages by topic, as the summary has them."""
        self._file = McapReader(path)

    def __enter__(self) -> "Outgoing":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def truncated(self) -> bool:
        """Whether the recording was cut off."""
        return self._file.truncated

    @property
    def damage(self) -> tuple[Damage, ...]:
        """Stretches met so far that could not be read."""
        return self._file.damage

    @property
    def left_out(self) -> dict[str, int]:
        """Messages of topics that are not ours and stay behind."""
        counts: dict[str, int] = {}
        for number, channel in self._file.channels.items():
            if number not in self._ours():
                counts[channel.topic] = counts.get(channel.topic, 0) + self._file.extents[number].count
        return counts

    def messages(self) -> Iterator[Carried]:
        """All messages of our topics in order of receipt; one that does not parse stays behind, named in ``damage``."""
        ours = self._ours()
        for entry in self._file.entries(frozenset(ours)):
            topic = ours[entry.channel_id]
            try:
                message = message_class(topic.schema).FromString(entry.data)
            except DecodeError:
                self._file.lose(entry.offset, entry.start, entry.log_ns, not_valid(topic.name, topic.schema))
                continue
            yield Carried(topic, entry.log_ns, entry.publish_ns, message)

    def _ours(self) -> Mapping[int, Topic]:
        return {
            number: TOPIC_BY_NAME[channel.topic]
            for number, channel in self._file.channels.items()
            if is_ours(channel.topic, self._file.schema_name(channel), channel.message_encoding)
        }


class Incoming:
    """A recording that carried messages are put into; ``file`` is finished by whoever opened it."""

    def __init__(self, file: McapFile, about: About) -> None:
        self._file = file
        self._about = about
        self._channels: dict[str, int] = {}
        file.add_metadata(SESSION, about.session)

    def take(self, carried: Carried) -> None:
        """One message; its own timestamp is made that of ``carried``."""
        topic, received_ns, stamp_ns, message = carried
        if not self._channels and self._about.config_toml:
            config = self._about.config_toml.encode()
            self._file.add_attachment(CONFIG_NAME, CONFIG_MEDIA_TYPE, config, received_ns)
        number = self._channels.get(topic.name)
        if number is None:
            number = self._file.add_channel(topic.name, topic.schema, schema_data(topic.schema))
            self._channels[topic.name] = number
        message.timestamp.seconds, message.timestamp.nanos = divmod(stamp_ns, SECOND_NS)
        data = message.SerializeToString(deterministic=True)
        compress = topic.name != CAMERA_IMAGE  # JPEG does not compress
        self._file.add_message(number, received_ns, stamp_ns, data, compress)

    def close(self, stats: Mapping[str, str]) -> dict[str, int]:
        """Write ``sdt.stats``: the original's with ``stats`` added and counts put right. The counts by topic."""
        self._file.finish_chunks()
        counts = self._file.counts
        kept = {name: value for name, value in self._about.stats.items() if not name.startswith("count.")}
        counted = {f"count.{topic}": str(count) for topic, count in counts.items()}
        self._file.add_metadata(STATS, {**counted, **kept, **stats})
        return counts
