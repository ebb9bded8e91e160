"""The messages of one topic as a row of frames, any of which is read when it is asked for."""

from collections import OrderedDict
from typing import Final

import numpy as np
from jaxtyping import Int64

from sdt_tools.errors import RecordingError
from sdt_tools.frames import Received
from sdt_tools.recording.container.chunk import Segment
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.messages.codec import decode

OPEN_CHUNKS: Final = 4
"""So many unpacked chunks, of about a megabyte each, are kept: the neighbours of a frame are asked for next."""


class Frames:
    """The frames of ``topic`` in a file, in the order in which they were taken; two of one stamp count as one.

    Opening takes their times only. The file must stay open as long as frames are read.
    """

    def __init__(self, file: McapReader, topic: str, schema: str, channel_ids: frozenset[int]) -> None:
        self.topic = topic
        self._file = file
        self._schema = schema
        self._places = file.places(channel_ids)
        self._unpacked: OrderedDict[int, bytes | memoryview | None] = OrderedDict()

    def __len__(self) -> int:
        return len(self._places)

    @property
    def stamps_ns(self) -> Int64[np.ndarray, "frames"]:
        """When each was taken; strictly ascending."""
        return self._places.stamps_ns

    def at(self, row: int) -> Received:
        """Frame number ``row``. Raises RecordingError where it is damaged."""
        stamp_ns = int(self._places.stamps_ns[row])
        data = self._file.data_at(self._places, row, self._unpack)
        if data is None:
            raise RecordingError(f"{self._file.path}: {self.topic} at {stamp_ns} ns is damaged; go on to another frame")
        return Received(int(self._places.received_ns[row]), decode(self.topic, self._schema, data, stamp_ns))

    def nearest(self, stamp_ns: int) -> int:
        """The number of the frame that was taken nearest to ``stamp_ns``, the earlier of two; there must be one."""
        after = int(np.searchsorted(self.stamps_ns, stamp_ns))
        before = max(after - 1, 0)
        after = min(after, len(self) - 1)
        earlier_ns, later_ns = int(self.stamps_ns[before]), int(self.stamps_ns[after])
        return before if abs(stamp_ns - earlier_ns) <= abs(later_ns - stamp_ns) else after

    def _unpack(self, segment: Segment) -> bytes | memoryview | None:
        if segment.offset not in self._unpacked:
            self._unpacked[segment.offset] = self._file.unpacked(segment)
            while len(self._unpacked) > OPEN_CHUNKS:
                self._unpacked.popitem(last=False)
        self._unpacked.move_to_end(segment.offset)
        return self._unpacked[segment.offset]
