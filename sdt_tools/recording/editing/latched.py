"""What holds until it changes: calibrations and transforms, carried to where a part of a recording begins.

A part that begins after such a message would not know its camera or where its sensors stand. So the last ones before
the part are written at its beginning: their log time is the part's, because that is when its reader needs them; their
publish time stays what the sensor said. ``sdt.edit`` lists them, so that a merge that finds the message itself in
another part leaves the carried one out.
"""

import json
import zlib
from collections.abc import Set
from dataclasses import asdict, dataclass
from typing import Final

from sdt_tools.errors import RecordingError
from sdt_tools.frames import CameraCalibration, FrameTransform
from sdt_tools.recording.container.reader import McapReader, RawEntry
from sdt_tools.recording.copying import RecordCopy
from sdt_tools.recording.messages.codec import decode
from sdt_tools.recording.messages.topics import CAMERA_CALIBRATION, TRANSFORM, is_ours

EDIT: Final = "sdt.edit"
CARRIED: Final = "carried"


@dataclass(frozen=True)
class Carried:
    """A message that was received at ``log_ns``, before its part begins, and stands in the part at ``at_ns``."""

    topic: str
    log_ns: int
    publish_ns: int
    at_ns: int
    crc32: int


def carried_in(source: McapReader) -> frozenset[Carried]:
    """The messages that an edit carried to beginnings in ``source``; none where it says nothing that can be read."""
    records = [record.metadata for record in source.metadata if record.name == EDIT]
    try:
        return frozenset(Carried(**fields) for fields in json.loads(records[-1][CARRIED])) if records else frozenset()
    except (KeyError, TypeError, ValueError):
        return frozenset()


def carried_text(carried: Set[Carried]) -> str:
    """What ``carried_in`` reads."""
    return json.dumps([asdict(message) for message in sorted(carried, key=lambda c: (c.at_ns, c.log_ns, c.crc32))])


def place_of(source: McapReader, entry: RawEntry) -> tuple[str, int, int, int]:
    """Topic, log time, publish time and checksum: by these a carried message is known again where it stands."""
    return source.channels[entry.channel_id].topic, entry.log_ns, entry.publish_ns, zlib.crc32(entry.data)


class LastKnown:
    """The last calibration of each camera and the last transform of each pair of frames in what was passed over."""

    def __init__(self, source: McapReader) -> None:
        self._source = source
        self._channels = frozenset(
            number
            for number, channel in source.channels.items()
            if channel.topic in (CAMERA_CALIBRATION, TRANSFORM)
            and is_ours(channel.topic, source.schema_name(channel), channel.message_encoding)
        )
        self._log_ns = {(c.topic, c.at_ns, c.publish_ns, c.crc32): c.log_ns for c in carried_in(source)}
        self._last: dict[tuple[str, ...], RawEntry] = {}

    def pass_over(self, start_ns: int | None, end_ns: int) -> None:
        """Take note of what was received in ``[start_ns, end_ns)``."""
        for entry in self._source.entries(self._channels, start_ns, end_ns):
            subject = self._subject(entry)
            if subject is not None:
                data = entry.data  # a copy, which does not keep its chunk in memory
                self._last.pop(subject, None)
                self._last[subject] = entry._replace(chunk=data, start=0, end=len(data))

    def write(self, copy: RecordCopy, at_ns: int) -> frozenset[Carried]:
        """Write what is known into ``copy`` as received at ``at_ns``."""
        carried = set()
        for entry in self._last.values():
            topic, log_ns, publish_ns, crc32 = place = place_of(self._source, entry)
            carried.add(Carried(topic, self._log_ns.get(place, log_ns), publish_ns, at_ns, crc32))
            copy.take(self._source, entry._replace(log_ns=at_ns))
        return frozenset(carried)

    def _subject(self, entry: RawEntry) -> tuple[str, ...] | None:
        """What the message is about; None where it cannot be read."""
        channel = self._source.channels[entry.channel_id]
        try:
            message = decode(channel.topic, self._source.schema_name(channel), entry.data, entry.publish_ns)
        except RecordingError:
            return None
        if isinstance(message, FrameTransform):
            return channel.topic, message.parent, message.child
        return (channel.topic, message.frame_id) if isinstance(message, CameraCalibration) else None
