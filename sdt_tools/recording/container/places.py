"""Where the messages of a topic lie in a file, and when each was taken, without reading the messages.

The chunks' message indexes say when each message was received and where it begins; when it was taken stands at the head
of the message itself. Of a chunk that is not compressed (pictures) only those heads are touched, so that it does not
matter how large the messages are. A chunk without an index that fits is walked.
"""

from collections.abc import Callable, Set
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Int64, UInt8
from mcap.opcode import Opcode

from sdt_tools.recording.container.chunk import Segment, stored, walk_messages

_INDEX_HEAD_BYTES: Final = 9 + 6  # record head, channel, length of the entries
_HEAD_BYTES: Final = 9 + 2 + 4 + 8 + 8  # record head, channel, sequence, log time, publish time
_LATEST_NS: Final = 1 << 62
Unpack = Callable[[Segment], bytes | memoryview | None]


@dataclass(frozen=True, eq=False)
class Places:
    """Messages in the order of the time at which they were taken; of those taken at once only the first received.

    Message ``i`` begins at byte ``starts[i]`` of what segment ``segments[owners[i]]`` holds.
    """

    stamps_ns: Int64[np.ndarray, "messages"]
    received_ns: Int64[np.ndarray, "messages"]
    owners: Int64[np.ndarray, "messages"]
    starts: Int64[np.ndarray, "messages"]
    segments: tuple[Segment, ...]

    def __len__(self) -> int:
        return len(self.stamps_ns)


def find_places(view: memoryview, segments: list[Segment], channel_ids: Set[int], unpack: Unpack) -> Places:
    """The messages of some channels in ``segments`` of the file ``view``; ``unpack`` gives what a segment holds.

    Messages in segments that cannot be unpacked are left out.
    """
    found = [_in_segment(view, segment, channel_ids, unpack) for segment in segments]
    owners = np.repeat(np.arange(len(found)), [len(part) for part in found])
    rows = np.column_stack([np.concatenate([np.empty((0, 3), np.int64), *found]), owners])
    rows = rows[np.lexsort((rows[:, 2], rows[:, 3], rows[:, 1], rows[:, 0]))]
    first = np.ones(len(rows), bool)
    first[1:] = rows[1:, 0] != rows[:-1, 0]
    stamps_ns, received_ns, starts, owners = np.ascontiguousarray(rows[first].T)
    return Places(stamps_ns, received_ns, owners, starts, tuple(segments))


def message_data(view: memoryview, segment: Segment, start: int, unpack: Unpack) -> bytes | None:
    """What the message that begins at ``start`` of ``segment`` holds; None where the segment cannot be unpacked."""
    data: bytes | memoryview | None = stored(view, segment)
    if data is None:
        data = unpack(segment)
    if data is None:
        return None
    length = int.from_bytes(data[start + 1 : start + 9], "little")
    return bytes(data[start + _HEAD_BYTES : start + 9 + length])


def _in_segment(
    view: memoryview, segment: Segment, channel_ids: Set[int], unpack: Unpack
) -> Int64[np.ndarray, "messages 3"]:
    """Stamp, time of receipt and place of each message."""
    indexed = _indexed_starts(view, segment, channel_ids)
    in_place = stored(view, segment)
    rows = None if indexed is None or in_place is None else _heads(in_place, indexed, channel_ids)
    if rows is not None:
        return rows
    data = unpack(segment)
    if data is None:
        return np.empty((0, 3), np.int64)
    rows = None if indexed is None else _heads(data, indexed, channel_ids)
    if rows is not None:
        return rows
    walked = [
        (min(raw.publish_ns, _LATEST_NS), min(raw.log_ns, _LATEST_NS), raw.start - _HEAD_BYTES)
        for raw in walk_messages(data)
        if raw.channel_id in channel_ids
    ]
    return np.array(walked, np.int64).reshape(-1, 3)


def _indexed_starts(view: memoryview, segment: Segment, channel_ids: Set[int]) -> Int64[np.ndarray, "messages"] | None:
    """Where the messages begin by the segment's message indexes; None without indexes that can be read."""
    if segment.index_offsets is None or segment.cut:
        return None
    parts = [np.empty(0, np.int64)]
    for channel_id in channel_ids & segment.index_offsets.keys():
        at = segment.index_offsets[channel_id]
        if at + _INDEX_HEAD_BYTES > len(view) or view[at] != Opcode.MESSAGE_INDEX:
            return None
        entries_at = at + _INDEX_HEAD_BYTES
        length = int.from_bytes(view[entries_at - 4 : entries_at], "little")
        if length % 16 or entries_at + length > len(view):
            return None
        parts.append(np.frombuffer(view, "<i8", length // 8, entries_at)[1::2])
    return np.concatenate(parts)


def _heads(
    data: bytes | memoryview, starts: Int64[np.ndarray, "messages"], channel_ids: Set[int]
) -> Int64[np.ndarray, "messages 3"] | None:
    """Stamp, time of receipt and place of the messages at ``starts``; None where one of them is not there."""
    if not len(starts):
        return np.empty((0, 3), np.int64)
    if starts.min() < 0 or starts.max() + _HEAD_BYTES > len(data):
        return None
    every: UInt8[np.ndarray, "bytes"] = np.frombuffer(data, np.uint8)
    heads = every[starts[:, None] + np.arange(_HEAD_BYTES)]
    channels = heads[:, 9:11].copy().view("<u2")[:, 0]
    if (heads[:, 0] != Opcode.MESSAGE).any() or not np.isin(channels, list(channel_ids)).all():
        return None
    times = heads[:, 15:31].copy().view("<u8")
    times = np.minimum(times, _LATEST_NS).astype(np.int64)
    return np.column_stack([times[:, 1], times[:, 0], starts])
