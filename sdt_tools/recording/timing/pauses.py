"""Pauses that somebody asked for: nothing is missing in them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from jaxtyping import Bool, Int64

from sdt_tools.errors import RecordingError
from sdt_tools.frames import LogEntry, LogLevel
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.messages.codec import decode
from sdt_tools.recording.messages.topics import SESSION_LOG, is_ours
from sdt_tools.recording.session import STATS

PAUSES: Final = "pauses_ns"
"""The entry of ``sdt.stats``: ``start-end`` of each pause, half-open, in host time, parted by blanks."""

Pauses = Sequence[tuple[int, int]]

_NAME: Final = "pause"
_PAUSED: Final = "paused: nothing is recorded until it is resumed"


def paused_entry(now_ns: int) -> LogEntry:
    """What ``/session/log`` says where a pause begins, the moment when it does being ``now_ns``."""
    return LogEntry(now_ns, LogLevel.INFO, _PAUSED, _NAME)


def resumed_entry(now_ns: int, lasted_s: float) -> LogEntry:
    """What it says where a pause ends."""
    return LogEntry(now_ns, LogLevel.INFO, f"resumed after a pause of {lasted_s:.3f} s", _NAME)


def pauses_in(file: McapReader) -> Pauses:
    """The pauses that ``file`` tells of: in ``sdt.stats``, or where it was cut off before them in its log."""
    stats = [record.metadata for record in file.metadata if record.name == STATS]
    return pauses_of(stats[-1]) if stats else tuple(_logged(file))


def pauses_text(pauses: Pauses) -> str:
    """What ``pauses_of`` reads."""
    return " ".join(f"{start_ns}-{end_ns}" for start_ns, end_ns in pauses)


def pauses_of(stats: Mapping[str, str]) -> Pauses:
    """The pauses that ``sdt.stats`` tells of; none where that is not readable."""
    pauses = []
    for text in stats.get(PAUSES, "").split():
        start, _, end = text.partition("-")
        if start.isdecimal() and end.isdecimal():
            pauses.append((int(start), int(end)))
    return tuple(pauses)


def spans_pause(received_ns: Int64[np.ndarray, "messages"], pauses: Pauses) -> Bool[np.ndarray, "intervals"]:
    """Whether a pause lies, wholly or in part, between each message and the next one."""
    earlier = np.minimum(received_ns[:-1], received_ns[1:])
    later = np.maximum(received_ns[:-1], received_ns[1:])
    spans = np.zeros(len(earlier), bool)
    for start_ns, end_ns in pauses:
        spans |= (earlier < end_ns) & (later > start_ns)
    return spans


def _logged(file: McapReader) -> Iterator[tuple[int, int]]:
    """Pauses by their entries in ``/session/log``; one without an end is the end of what was recorded, and no gap."""
    began_ns: int | None = None
    for entry in _pause_entries(file):
        if entry.text == _PAUSED:
            began_ns = entry.stamp_ns if began_ns is None else began_ns
        elif began_ns is not None:
            yield began_ns, entry.stamp_ns
            began_ns = None


def _pause_entries(file: McapReader) -> Iterator[LogEntry]:
    logs = {
        number: file.schema_name(channel)
        for number, channel in file.channels.items()
        if channel.topic == SESSION_LOG and is_ours(SESSION_LOG, file.schema_name(channel), channel.message_encoding)
    }
    for entry in file.entries(logs.keys()) if logs else ():
        try:
            message = decode(SESSION_LOG, logs[entry.channel_id], entry.data, entry.publish_ns)
        except RecordingError:
            continue
        if isinstance(message, LogEntry) and message.name == _NAME:
            yield message
