"""What holds until it changes: calibrations, transforms, and what others latch, carried to where a part begins.

A part that begins after such a message would not know its camera or where its sensors stand. So the last ones before
the part are written at its beginning: their log time is the part's, because that is when its reader needs them; their
publish time stays what the sensor said. ``sdt.edit`` lists them, so that a merge that finds the message itself in
another part leaves the carried one out.

Topics of others are latched where they say so (ROS: transient local, latching), where they are ``/tf_static``, and
where their one message was received within the file's first second, as a map or a robot's description is. Of
transforms every one counts that differs from the others, for one message seldom tells all; else the last one.
"""

import json
import re
import zlib
from collections.abc import Iterator, Set
from dataclasses import asdict, dataclass
from typing import Final

from mcap.records import Channel

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import RecordingError
from sdt_tools.frames import CameraCalibration, FrameTransform
from sdt_tools.recording.container.extents import Extent
from sdt_tools.recording.container.reader import McapReader, RawEntry
from sdt_tools.recording.copying import RecordCopy
from sdt_tools.recording.messages.codec import decode
from sdt_tools.recording.messages.topics import CAMERA_CALIBRATION, TRANSFORM, is_ours

EDIT: Final = "sdt.edit"
CARRIED: Final = "carried"
LATCHED: Final = "latched_topics"

_STATIC: Final = "/tf_static"
_TRANSIENT_LOCAL: Final = re.compile(r"\bdurability:\s*(1|transient_local)\b")


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
    """The last calibration of each camera and transform of each pair of frames, and what else holds, of what passed."""

    def __init__(self, source: McapReader) -> None:
        self._source = source
        self._channels = frozenset(latched_channels(source))
        self._log_ns = {(c.topic, c.at_ns, c.publish_ns, c.crc32): c.log_ns for c in carried_in(source)}
        self._last: dict[tuple[object, ...], RawEntry] = {}

    def pass_over(self, start_ns: int | None, end_ns: int) -> None:
        """Take note of what was received in ``[start_ns, end_ns)``."""
        for entry in self._source.entries(self._channels, start_ns, end_ns) if self._channels else ():
            subject = _subject(self._source, entry)
            if subject is not None:
                data = entry.data  # a copy, which does not keep its chunk in memory
                self._last.pop(subject, None)
                self._last[subject] = entry._replace(chunk=data, start=0, end=len(data))

    def write(self, copy: RecordCopy, at_ns: int, kept: Set[int]) -> frozenset[Carried]:
        """Write what is known of the channels ``kept`` into ``copy`` as received at ``at_ns``."""
        carried = set()
        for entry in self._last.values():
            if entry.channel_id in kept:
                topic, log_ns, publish_ns, crc32 = place = place_of(self._source, entry)
                carried.add(Carried(topic, self._log_ns.get(place, log_ns), publish_ns, at_ns, crc32))
                copy.take(self._source, entry._replace(log_ns=at_ns))
        return frozenset(carried)


def latched_channels(source: McapReader) -> Iterator[int]:
    """The numbers of the channels of ``source`` whose messages hold until the next one.

    A part goes by what was found in its original: what is said once in a part may have been said often.
    """
    begins_ns = min((e.first_ns for e in source.extents.values() if e.first_ns is not None), default=0)
    found_before = _topics_found_before(source)
    for number, channel in source.channels.items():
        if _is_ours(source, channel):
            if channel.topic in (CAMERA_CALIBRATION, TRANSFORM):
                yield number
        elif _says_that_it_is_latched(channel):
            yield number
        elif found_before is not None:
            if channel.topic in found_before:
                yield number
        elif _is_said_once(source.extents[number], begins_ns):
            yield number


def latched_topics(source: McapReader) -> frozenset[str]:
    """The topics of others among them."""
    latched = (source.channels[number] for number in latched_channels(source))
    return frozenset(channel.topic for channel in latched if not _is_ours(source, channel))


def _topics_found_before(source: McapReader) -> frozenset[str] | None:
    """Those that the edit noted which made ``source``; None where no edit did."""
    edits = [record.metadata for record in source.metadata if record.name == EDIT]
    try:
        return frozenset(json.loads(edits[-1][LATCHED])) if edits else None
    except (KeyError, TypeError, ValueError):
        return None


def _is_ours(source: McapReader, channel: Channel) -> bool:
    return is_ours(channel.topic, source.schema_name(channel), channel.message_encoding)


def _says_that_it_is_latched(channel: Channel) -> bool:
    return (
        channel.topic.endswith(_STATIC)
        or _TRANSIENT_LOCAL.search(channel.metadata.get("offered_qos_profiles", "")) is not None
        or channel.metadata.get("latching", "") in ("1", "true")
    )


def _is_said_once(extent: Extent, begins_ns: int) -> bool:
    return extent.count == 1 and extent.first_ns is not None and extent.first_ns - begins_ns < SECOND_NS


def _subject(source: McapReader, entry: RawEntry) -> tuple[object, ...] | None:
    """What the message is about; None where it is ours and cannot be read."""
    channel = source.channels[entry.channel_id]
    if not _is_ours(source, channel):
        is_static = channel.topic.endswith(_STATIC)
        return (entry.channel_id, entry.data) if is_static else (entry.channel_id,)
    try:
        message = decode(channel.topic, source.schema_name(channel), entry.data, entry.publish_ns)
    except RecordingError:
        return None
    if isinstance(message, FrameTransform):
        return channel.topic, message.parent, message.child
    return (channel.topic, message.frame_id) if isinstance(message, CameraCalibration) else None
