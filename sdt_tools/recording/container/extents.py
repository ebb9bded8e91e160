"""From when to when a channel has messages, by the indexes of a file's chunks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from mcap.opcode import Opcode

from sdt_tools.recording.container.chunk import Segment

_INDEX_HEAD_BYTES: Final = 9 + 6  # record head, channel, length of the entries


@dataclass
class Extent:
    """Messages of one channel: number, first and last time of receipt."""

    count: int = 0
    first_ns: int | None = None
    last_ns: int | None = None

    def add(self, count: int, first_ns: int, last_ns: int) -> None:
        """Take in more messages."""
        self.count += count
        self.first_ns = first_ns if self.first_ns is None else min(self.first_ns, first_ns)
        self.last_ns = last_ns if self.last_ns is None else max(self.last_ns, last_ns)


def indexed_extents(
    view: memoryview, segments: Sequence[Segment], counts: Mapping[int, int]
) -> dict[int, Extent] | None:
    """Extents of the channels by ``counts`` and the message indexes of their outermost chunks.

    None where one lacks, or does not lead to the messages that are counted.
    """
    if any(segment.index_offsets is None for segment in segments):
        return None
    forwards = sorted(segments, key=lambda segment: segment.start_ns)
    backwards = sorted(segments, key=lambda segment: -segment.end_ns)
    extents: dict[int, Extent] = {}
    for channel_id, count in counts.items():
        extents[channel_id] = extent = Extent(count)
        for segment in forwards:
            if extent.first_ns is not None and segment.start_ns >= extent.first_ns:
                break
            _take_index(extent, view, segment, channel_id)
        for segment in backwards:
            if extent.last_ns is not None and segment.end_ns <= extent.last_ns:
                break
            _take_index(extent, view, segment, channel_id)
        if count and extent.first_ns is None:
            return None
    return extents


def _take_index(extent: Extent, view: memoryview, segment: Segment, channel_id: int) -> None:
    at = (segment.index_offsets or {}).get(channel_id)
    if at is None or at + _INDEX_HEAD_BYTES > len(view) or view[at] != Opcode.MESSAGE_INDEX:
        return
    entries_at = at + _INDEX_HEAD_BYTES
    length = min(int.from_bytes(view[entries_at - 4 : entries_at], "little"), len(view) - entries_at)
    times = np.frombuffer(view, "<u8", length // 16 * 2, entries_at)[::2]
    if times.size:
        extent.add(0, int(times.min()), int(times.max()))
