"""The times of all messages, gathered while they are recorded or counted again from a file.

Both ways use one class, so that both give the same numbers. Every time is kept, 16 bytes a message (12 MB an hour of
everything that the robot sends), so that percentiles are exact.
"""

from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Int64

from sdt_tools.recording.container.chunk import walk_messages
from sdt_tools.recording.container.reader import McapReader

_LATEST_NS: Final = 1 << 62
"""In the year 2116: what a foreign or damaged file puts later is taken for this, so that differences fit 64 bits."""


@dataclass(frozen=True, eq=False)
class TopicStamps:
    """When the messages of one topic were received (host time), and when they were taken (sensor time).

    In the order of receipt; of those received at once, in that of their sensor stamps.
    """

    received_ns: Int64[np.ndarray, "messages"]
    stamps_ns: Int64[np.ndarray, "messages"]

    def __len__(self) -> int:
        return len(self.stamps_ns)


class StampLog:
    """Collects times as messages pass, in any order."""

    def __init__(self) -> None:
        self._times: dict[str, tuple[array[int], array[int]]] = {}

    def see(self, topic: str, received_ns: int, stamp_ns: int) -> None:
        """Take note of a message; times are not negative, and those later than the year 2116 are taken for it."""
        times = self._times.get(topic)
        if times is None:
            times = self._times[topic] = array("q"), array("q")
        times[0].append(received_ns if received_ns < _LATEST_NS else _LATEST_NS)
        times[1].append(stamp_ns if stamp_ns < _LATEST_NS else _LATEST_NS)

    def topics(self) -> Iterator[tuple[str, TopicStamps]]:
        """What was seen, topic by topic in the order of their names."""
        for topic, (received, stamps) in sorted(self._times.items()):
            received_ns, stamps_ns = np.array(received, np.int64), np.array(stamps, np.int64)
            order = np.lexsort((stamps_ns, received_ns))
            yield topic, TopicStamps(received_ns[order], stamps_ns[order])


def read_stamps(file: McapReader, topics: Mapping[int, str]) -> StampLog:
    """Count ``file`` again: the times of all messages of the channels in ``topics``, which gives the topic of each.

    Streams, a chunk at a time, and decodes nothing.
    """
    log = StampLog()
    for segment in file.segments(topics.keys()):
        for raw in walk_messages(file.unpacked(segment) or b""):
            topic = topics.get(raw.channel_id)
            if topic is not None:
                log.see(topic, raw.log_ns, raw.publish_ns)
    return log
