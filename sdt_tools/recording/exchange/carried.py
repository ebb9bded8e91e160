"""Messages on their way out of a recording and into one: in their protobuf, with both of their times.

They are carried in protobuf, not in the words of ``frames``, so that what is not ours to interpret (the height of a
pose, the distortion of a lens) arrives as it left, to the bit.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from google.protobuf.message import DecodeError

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import RecordingError
from sdt_tools.recording.container.file import McapFile
from sdt_tools.recording.exchange.about import About
from sdt_tools.recording.messages.schemas import message_class, schema_data
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, Topic
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.session import CONFIG_MEDIA_TYPE, CONFIG_NAME, SESSION, STATS
from sdt_tools.recording.timing.pauses import pauses_of
from sdt_tools.recording.timing.stamps import StampLog
from sdt_tools.recording.timing.summary import ENTRY, timing_entries, timing_of


class Carried(NamedTuple):
    """One message: its topic in a recording, when it was received and taken, and its protobuf."""

    topic: Topic
    received_ns: int
    stamp_ns: int
    message: Any


def outgoing(recording: Recording) -> Iterator[Carried]:
    """All messages of ``recording`` in order of receipt; one that does not parse stays behind, named in ``damage``.

    Raises RecordingError where there are none.
    """
    empty = True
    for topic, entry in recording.entries():
        try:
            message = message_class(topic.schema).FromString(entry.data)
        except DecodeError:
            recording.lose(topic, entry)
            continue
        empty = False
        yield Carried(topic, entry.log_ns, entry.publish_ns, message)
    if empty:
        raise RecordingError(f"{recording.path}: holds no messages; there is nothing to export")


class Incoming:
    """A recording that carried messages are put into; ``file`` is finished by whoever opened it."""

    def __init__(self, file: McapFile, about: About) -> None:
        self._file = file
        self._about = about
        self._channels: dict[str, int] = {}
        self._stamps = StampLog()
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
        self._stamps.see(topic.name, received_ns, stamp_ns)

    def close(self, stats: Mapping[str, str]) -> dict[str, int]:
        """Write ``sdt.stats``: the original's and ``stats``, with counts and timing put right. The counts by topic."""
        self._file.finish_chunks()
        counts = self._file.counts
        kept = {name: value for name, value in self._about.stats.items() if not name.startswith(("count.", ENTRY))}
        counted = {f"count.{topic}": str(count) for topic, count in counts.items()}
        timing = timing_entries(timing_of(self._stamps, pauses_of(kept)))
        self._file.add_metadata(STATS, {**counted, **timing, **kept, **stats})
        return counts
