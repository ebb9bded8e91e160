"""What passes, kept for a screen: the newest of everything, rates and ages; written by one thread, read by another."""

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import CameraImage, LidarScan, LogEntry, Message, MotionCommand, OperatorState, Received
from sdt_tools.recording.live.outcome import RecordingProgress
from sdt_tools.recording.messages.topics import topic_of

RATE_NS: Final = 2 * SECOND_NS
"""Rates are those of the last two seconds."""
_ENTRIES: Final = 50
_ARRIVALS: Final = 256


@dataclass(frozen=True)
class Stream:
    """How a topic comes in: messages a second, and for how long there has been none."""

    rate_hz: float
    age_s: float


@dataclass(frozen=True, eq=False)
class View:
    """The newest of everything, None or empty where nothing has come."""

    scan: LidarScan | None = None
    image: CameraImage | None = None
    command: MotionCommand | None = None
    operator: OperatorState | None = None
    progress: RecordingProgress | None = None
    streams: Mapping[str, Stream] | None = None
    entries: tuple[LogEntry, ...] = ()


class Watch:
    """Sees what passes. Implements Observer; ``view`` may be called from another thread, which it never holds up."""

    def __init__(self, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._now_ns = now_ns
        self._lock = threading.Lock()
        self._newest: dict[type[Message], Message] = {}
        self._arrivals: dict[str, deque[int]] = {}
        self._entries: deque[LogEntry] = deque(maxlen=_ENTRIES)
        self._progress: RecordingProgress | None = None

    def observe(self, received: Received) -> None:
        """Keep one message."""
        message, now_ns = received.message, self._now_ns()
        with self._lock:
            self._newest[type(message)] = message
            if isinstance(message, LogEntry):
                self._entries.append(message)
                return
            topic = topic_of(message).name
            self._arrivals.setdefault(topic, deque(maxlen=_ARRIVALS)).append(now_ns)

    def tell(self, progress: RecordingProgress) -> None:
        """Keep where the recording stands."""
        self._progress = progress

    def close(self) -> None:
        """The source has ended; what was seen last stays."""

    def view(self) -> View:
        """What there is by now."""
        now_ns = self._now_ns()
        with self._lock:
            newest = dict(self._newest)
            entries = tuple(self._entries)
            streams = {topic: _stream(arrivals, now_ns) for topic, arrivals in self._arrivals.items()}
        scan, image = newest.get(LidarScan), newest.get(CameraImage)
        command, operator = newest.get(MotionCommand), newest.get(OperatorState)
        return View(
            scan=scan if isinstance(scan, LidarScan) else None,
            image=image if isinstance(image, CameraImage) else None,
            command=command if isinstance(command, MotionCommand) else None,
            operator=operator if isinstance(operator, OperatorState) else None,
            progress=self._progress,
            streams=streams,
            entries=entries,
        )


def _stream(arrivals: deque[int], now_ns: int) -> Stream:
    recent = [at_ns for at_ns in arrivals if now_ns - at_ns <= RATE_NS]
    lasted_s = (recent[-1] - recent[0]) / SECOND_NS if recent else 0.0
    return Stream((len(recent) - 1) / lasted_s if lasted_s > 0 else 0.0, (now_ns - arrivals[-1]) / SECOND_NS)
