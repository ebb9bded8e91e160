"""The recorder's own drops: counted a stream, and told in one log entry a burst."""

from collections import Counter
from dataclasses import dataclass
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import LogEntry, LogLevel

_QUIET_NS: Final = SECOND_NS
"""A burst is over when nothing has been dropped for so long."""
_LONGEST_NS: Final = 10 * SECOND_NS
"""A burst that goes on is told of so often."""


@dataclass
class _Burst:
    first_ns: int
    last_ns: int
    count: int = 0


class DropLog:
    """Counts drops by topic in ``counts`` and says when a burst is to be told."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._bursts: dict[str, _Burst] = {}

    def drop(self, topic: str, received_ns: int) -> None:
        """A message of ``topic`` that was received at ``received_ns`` is given up."""
        self.counts[topic] += 1
        burst = self._bursts.setdefault(topic, _Burst(received_ns, received_ns))
        burst.count += 1
        burst.first_ns = min(burst.first_ns, received_ns)
        burst.last_ns = max(burst.last_ns, received_ns)

    def due(self, now_ns: int, at_end: bool = False) -> list[LogEntry]:
        """Entries for bursts that are over at ``now_ns`` or have lasted long; ``at_end`` for all."""
        told = [
            topic
            for topic, burst in self._bursts.items()
            if at_end or now_ns - burst.last_ns >= _QUIET_NS or now_ns - burst.first_ns >= _LONGEST_NS
        ]
        return [_entry(now_ns, topic, self._bursts.pop(topic)) for topic in told]


def _entry(now_ns: int, topic: str, burst: _Burst) -> LogEntry:
    text = (
        f"{topic}: {burst.count} messages dropped, received from {burst.first_ns} to {burst.last_ns} ns: "
        "they came faster than they could be encoded or written"
    )
    return LogEntry(now_ns, LogLevel.WARNING, text, "drops")
