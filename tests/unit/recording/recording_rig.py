"""A source that plays messages, wheels, a driver and a watcher: all that a live recording needs, by hand."""

import signal
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from recording_samples import CONFIG, INFO, PERIOD_NS, T0, image, scan

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.config import MotionConfig, RateConfig
from sdt_tools.frames import LogEntry, MotionClass, Received, Twist
from sdt_tools.protocols import Observation, SourceInfo
from sdt_tools.recording.container.file import CHUNK_BYTES
from sdt_tools.recording.live.outcome import RecordingSummary
from sdt_tools.recording.live.record import record
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter


@dataclass
class TapeSource:
    """Plays messages; something may happen when one of them is read."""

    messages: list[Received]
    happens: dict[int, BaseException | int] = field(default_factory=dict)
    """At the message of this number: an exception is raised, or a signal arrives."""
    info: SourceInfo = INFO
    start_ns: int = T0
    closed: int = 0
    _next: int = 0

    @property
    def finished(self) -> bool:
        return self._next >= len(self.messages)

    def read(self, until_ns: int) -> Iterator[Received]:
        while not self.finished and self.messages[self._next].received_ns <= until_ns:
            event = self.happens.get(self._next)
            if isinstance(event, BaseException):
                raise event
            if event is not None:
                signal.raise_signal(event)  # one that is sent may come late, and two as one
            self._next += 1
            yield self.messages[self._next - 1]

    def close(self) -> None:
        self.closed += 1


@dataclass
class Wheels:
    twists: list[Twist] = field(default_factory=list)

    def command(self, twist: Twist) -> None:
        self.twists.append(twist)


@dataclass
class Forward:
    name: str = "constant:forward"
    seen: list[Observation] = field(default_factory=list)

    def decide(self, observation: Observation) -> MotionClass:
        self.seen.append(observation)
        return MotionClass.FORWARD


class Advisor:
    def advise(self) -> MotionClass:
        return MotionClass.BACKWARD


@dataclass
class Watcher:
    seen: list[Received] = field(default_factory=list)
    closed: int = 0

    def observe(self, received: Received) -> None:
        self.seen.append(received)

    def close(self) -> None:
        self.closed += 1


@dataclass
class Rig:
    """All that a recording needs, with a path to read it from."""

    path: Path
    source: TapeSource
    wheels: Wheels = field(default_factory=Wheels)
    driver: Forward = field(default_factory=Forward)
    watcher: Watcher = field(default_factory=Watcher)
    chunk_bytes: int = CHUNK_BYTES

    def run(self, seconds: float | None = None, **options: object) -> RecordingSummary:
        realtime = bool(options.get("realtime"))
        with RecordingWriter(self.path, INFO, CONFIG, realtime=realtime, chunk_bytes=self.chunk_bytes) as writer:
            return record(
                self.source,
                self.wheels,
                self.driver,
                Advisor(),
                writer,
                [self.watcher],
                RateConfig(),
                MotionConfig(),
                seconds,
                **options,
            )

    def read(self) -> list[Received]:
        with Recording.open(self.path) as recording:
            assert not recording.truncated
            return list(recording.messages())

    def log(self) -> list[str]:
        return [m.message.text for m in self.read() if isinstance(m.message, LogEntry)]

    def stats(self) -> dict[str, str]:
        with Recording.open(self.path) as recording:
            return dict(recording.stats)


def rig(tmp_path: Path, scans: int = 100, **source: object) -> Rig:
    messages = sorted((m for n in range(scans) for m in (scan(n), image(n, 100))), key=lambda m: m.received_ns)
    messages = [m for m in messages if m.received_ns < T0 + scans * PERIOD_NS]
    return Rig(tmp_path / "r.mcap", TapeSource(messages, **source))


class HandClock(HostClock):
    """Host time that moves only when somebody sleeps."""

    def __init__(self) -> None:
        self.time_ns = T0
        super().__init__(wall_ns=lambda: T0, monotonic_ns=lambda: self.time_ns)

    def sleep(self, seconds: float) -> None:
        self.time_ns += max(1, round(seconds * SECOND_NS))
