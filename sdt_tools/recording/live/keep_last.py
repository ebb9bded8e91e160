"""The last seconds in memory, to be written out when something happens."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import LogEntry, LogLevel, Mode, MotionCommand, OperatorState, Received
from sdt_tools.recording.live.latched import Latched
from sdt_tools.recording.live.pressure import size_of

RING_BYTES: Final = 512 << 20
"""About two and a half minutes of scans and pictures."""
_APART_NS: Final = 5 * SECOND_NS
"""Triggers that come closer to each other share a file."""


@dataclass(frozen=True)
class Snapshot:
    """What the ring held, in order of arrival, calibrations and transforms first; and what triggered it."""

    messages: tuple[Received, ...]
    triggers: tuple[str, ...]
    triggered_ns: int


class Ring:
    """Messages of the last ``seconds``, and not more than ``size_bytes`` of them."""

    def __init__(self, seconds: float, size_bytes: int = RING_BYTES) -> None:
        self.size_bytes = 0
        self._length_ns = round(seconds * SECOND_NS)
        self._most_bytes = size_bytes
        self._messages: deque[Received] = deque()
        self._latched = Latched()

    def add(self, received: Received) -> None:
        """Take in a message; what is too old or too much goes, but for calibrations and transforms that hold on."""
        self._messages.append(received)
        self.size_bytes += size_of(received.message)
        oldest_ns = received.received_ns - self._length_ns
        while self._messages[0].received_ns <= oldest_ns or (
            self.size_bytes > self._most_bytes and len(self._messages) > 1
        ):
            gone = self._messages.popleft()
            self.size_bytes -= size_of(gone.message)
            self._latched.see(gone)

    def messages(self) -> tuple[Received, ...]:
        """What it holds."""
        if not self._messages:
            return ()
        return (*self._latched.messages(self._messages[0].received_ns), *self._messages)


class KeepLast:
    """A ring, and the events that have it written out: a wish, a change of mode, a log entry of level error.

    An event is acted on at once. Events within five seconds of the last writing, or while that is still under way,
    share the next file. The ring goes on: files may overlap, none misses what led to its event.
    """

    def __init__(self, seconds: float, size_bytes: int = RING_BYTES) -> None:
        self.seconds = seconds
        self._ring = Ring(seconds, size_bytes)
        self._triggers: list[tuple[int, str]] = []
        self._modes: dict[str, Mode] = {}
        self._saved_ns: int | None = None

    def see(self, received: Received) -> None:
        """Keep a message and notice what happens in it."""
        self._ring.add(received)
        for trigger in self._happens(received):
            self.trigger(trigger, received.received_ns)

    def trigger(self, reason: str, now_ns: int) -> None:
        """``reason`` to write the ring out."""
        self._triggers.append((now_ns, reason))

    def due(self, now_ns: int, at_end: bool = False) -> Snapshot | None:
        """What is to be written now; ``at_end`` whatever is not written yet."""
        soon = self._saved_ns is not None and now_ns - self._saved_ns < _APART_NS
        if not self._triggers or (soon and not at_end):
            return None
        messages = self._ring.messages()
        if not messages:
            return None
        triggers, self._triggers = self._triggers, []
        self._saved_ns = now_ns
        return Snapshot(messages, tuple(dict.fromkeys(reason for _, reason in triggers)), triggers[0][0])

    def _happens(self, received: Received) -> Iterator[str]:
        message = received.message
        if isinstance(message, LogEntry) and message.level >= LogLevel.ERROR:
            yield f"error: {message.text}"
        elif isinstance(message, MotionCommand) and self._changes("mode", message.mode):
            yield f"mode: {message.mode.label}"
        elif isinstance(message, OperatorState) and self._changes("asked", message.commanded_mode):
            yield f"operator asks for mode: {message.commanded_mode.label}"

    def _changes(self, what: str, mode: Mode) -> bool:
        before = self._modes.get(what, mode)
        self._modes[what] = mode
        return before is not mode
