"""What waits to be written, bounded, and what gives way when there is too much of it.

Each stream has a queue of its own, bounded in messages and in bytes. Messages leave in the order in which they came.
When a queue is full:

- a picture that arrives is dropped; those that wait stay, so that what is lost lies in one piece;
- a scan or pose takes the place of the picture that has waited longest, and is dropped only where none waits: all
  queues together never hold more than their limits together;
- a raw picture that arrives when its encoder has too many before it is dropped; those that wait stay;
- commands, log entries, calibrations, transforms and what the operator shows are never dropped: they are small and few.
"""

from collections import deque
from dataclasses import dataclass
from itertools import count
from typing import Final

from sdt_tools.frames import CameraImage, LidarScan, LogEntry, Message, Odometry, OperatorPose, Received

_SMALL_BYTES: Final = 256
"""Taken for a message that is no picture and no scan."""

_SENSORS: Final = (LidarScan, Odometry, OperatorPose)


@dataclass(frozen=True)
class StreamLimit:
    """What one stream may have waiting. A single message that is larger passes where nothing else waits."""

    messages: int
    size_bytes: int


@dataclass(frozen=True)
class QueueLimits:
    """Of pictures, of each other sensor's stream, of raw pictures on their way into the encoder.

    The defaults hold about three seconds of pictures, encoded and raw, five of the others.
    """

    pictures: StreamLimit = StreamLimit(90, 64 << 20)
    sensors: StreamLimit = StreamLimit(250, 16 << 20)
    raw_pictures: StreamLimit = StreamLimit(90, 96 << 20)

    def of(self, message: Message) -> StreamLimit | None:
        """The limit for ``message``; None where it is never dropped."""
        if isinstance(message, CameraImage):
            return self.pictures
        return self.sensors if isinstance(message, _SENSORS) else None


@dataclass
class _Stream:
    waiting: deque[tuple[int, Received]]
    size_bytes: int = 0

    def pop(self) -> Received:
        _, received = self.waiting.popleft()
        self.size_bytes -= size_of(received.message)
        return received


class StreamQueues:
    """The queues. Not safe for threads by themselves: their owner holds a lock."""

    def __init__(self, limits: QueueLimits | None = None) -> None:
        self._limits = limits or QueueLimits()
        self._streams: dict[type[Message], _Stream] = {}
        self._order = count()

    @property
    def messages(self) -> int:
        """How many wait."""
        return sum(len(stream.waiting) for stream in self._streams.values())

    @property
    def size_bytes(self) -> int:
        """How much waits."""
        return sum(stream.size_bytes for stream in self._streams.values())

    def put(self, received: Received) -> Received | None:
        """Take in ``received``; what had to give way, which may be ``received`` itself."""
        message = received.message
        stream = self._stream(type(message))
        victim = None
        if self._is_full(type(message), message):
            pictures = self._stream(CameraImage)
            if stream is pictures or not pictures.waiting:
                return received
            victim = pictures.pop()
        stream.waiting.append((next(self._order), received))
        stream.size_bytes += size_of(message)
        return victim

    def take(self) -> Received | None:
        """The message that has waited longest; None where none waits."""
        streams = [stream for stream in self._streams.values() if stream.waiting]
        return min(streams, key=lambda stream: stream.waiting[0][0]).pop() if streams else None

    def _stream(self, kind: type[Message]) -> _Stream:
        return self._streams.setdefault(kind, _Stream(deque()))

    def _is_full(self, kind: type[Message], message: Message) -> bool:
        limit = self._limits.of(message)
        stream = self._stream(kind)
        if limit is None:
            return False
        messages, size_bytes = len(stream.waiting), stream.size_bytes
        if kind is CameraImage:  # room that scans have taken over is gone until they are written
            messages, size_bytes = messages + self._taken_over.messages, size_bytes + self._taken_over.size_bytes
        if not messages:
            return False
        return messages >= limit.messages or size_bytes + size_of(message) > limit.size_bytes

    @property
    def _taken_over(self) -> StreamLimit:
        """What sensors have waiting beyond their own limits."""
        limit = self._limits.sensors
        sensors = [stream for kind, stream in self._streams.items() if kind in _SENSORS]
        return StreamLimit(
            sum(max(len(stream.waiting) - limit.messages, 0) for stream in sensors),
            sum(max(stream.size_bytes - limit.size_bytes, 0) for stream in sensors),
        )


def size_of(message: Message) -> int:
    """About how many bytes of memory ``message`` holds."""
    if isinstance(message, CameraImage):
        return len(message.data) + _SMALL_BYTES
    if isinstance(message, LidarScan):
        return message.ranges_m.nbytes + _SMALL_BYTES
    return _SMALL_BYTES + (len(message.text) if isinstance(message, LogEntry) else 0)
