"""The recording loop: reads a source, asks a driver, moves the robot, writes everything down."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from time import perf_counter, sleep
from typing import Final

from sdt_tools.clock import SECOND_NS, HostClock, Pacer
from sdt_tools.config import MotionConfig, RateConfig
from sdt_tools.errors import RunError, SdtError
from sdt_tools.frames import LogEntry, LogLevel, Received, Twist
from sdt_tools.protocols import Actuator, Driver, Expert, Observer, Source
from sdt_tools.recording.live.decide import Deciders, DecisionLoop, Perturb
from sdt_tools.recording.live.gaps import GapCounter
from sdt_tools.recording.live.interrupt import Interrupt, deferred_interrupt
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN, topic_of
from sdt_tools.recording.writer import RecordingWriter

_PROGRESS_S: Final = 0.25
_STANDSTILL: Final = Twist(0.0, 0.0)


class Ending(StrEnum):
    """Why a recording ended."""

    TIME = "time"
    SOURCE = "source"
    INTERRUPTED = "interrupted"
    FAILED = "failed"


@dataclass(frozen=True)
class RecordingProgress:
    """Where a recording stands: seconds recorded of those asked for, wall time, messages by topic, bytes written."""

    recorded_s: float
    total_s: float | None
    wall_s: float
    counts: Mapping[str, int]
    size_bytes: int
    dropped: int
    missed_deadlines: int


@dataclass(frozen=True)
class RecordingSummary:
    """What was recorded. ``frames`` are messages by topic, ``dropped`` those that the sensors' stamps show missing.

    ``missed_deadlines`` are ticks and decisions that came too late in real time; ``forced`` of the ``decisions`` were
    not the driver's own.
    """

    recording_id: str
    ending: Ending
    seconds: float
    wall_s: float
    frames: Mapping[str, int]
    dropped: Mapping[str, int]
    missed_deadlines: int
    decisions: int
    forced: int
    size_bytes: int

    @property
    def interrupted(self) -> bool:
        """Whether the user stopped it."""
        return self.ending is Ending.INTERRUPTED

    @property
    def real_time_factor(self) -> float:
        """Seconds recorded in a second."""
        return self.seconds / self.wall_s if self.wall_s > 0 else 0.0


def record(
    source: Source,
    actuator: Actuator,
    driver: Driver,
    expert: Expert | None,
    writer: RecordingWriter,
    observers: Sequence[Observer],
    rates: RateConfig,
    motions: MotionConfig,
    seconds: float | None,
    realtime: bool = False,
    clock: HostClock | None = None,
    perturb: Perturb | None = None,
    progress: Callable[[RecordingProgress], None] | None = None,
    sleep_s: Callable[[float], None] = sleep,
) -> RecordingSummary:
    """Record ``source`` for ``seconds`` (without, until it ends) while ``driver`` moves ``actuator``.

    The source is read in ticks of one scan period; with ``realtime`` ticks keep the pace of ``clock``, the host's
    unless another is given. Ctrl-C ends the recording as if its time were up, and the summary says so. On every way out
    the robot is told to stand still, and source and observers are closed; the writer is the caller's to close.

    Raises RunError where the source fails, after a word in ``/session/log``; RecordingError where the disk refuses.
    """
    clock = clock or HostClock()
    decisions = DecisionLoop(Deciders(driver, expert, perturb), motions, rates.follow_hz, source.start_ns)
    pace = _RealPace(clock, rates, sleep_s) if realtime else _FastPace(source.start_ns, rates)
    session = _Session(source, actuator, writer, observers, decisions, pace, rates, progress)
    try:
        with deferred_interrupt() as interrupt:
            return session.run(seconds, interrupt)
    finally:
        session.end()


class _FastPace:
    """Ticks as fast as they are asked for, one scan period apart."""

    missed = 0

    def __init__(self, start_ns: int, rates: RateConfig) -> None:
        self._start_ns = start_ns
        self._period_ns = SECOND_NS / rates.scan_hz
        self._tick = -1

    def next_ns(self) -> int:
        """The stamp up to which the source is read next."""
        self._tick += 1
        return self._start_ns + round(self._tick * self._period_ns)


class _RealPace:
    """Ticks when their time has come. What a late tick missed is read with it."""

    def __init__(self, clock: HostClock, rates: RateConfig, sleep_s: Callable[[float], None]) -> None:
        self._clock = clock
        self._pacer = Pacer(round(SECOND_NS / rates.scan_hz), clock, sleep_s)

    @property
    def missed(self) -> int:
        """Ticks that came too late."""
        return self._pacer.missed

    def next_ns(self) -> int:
        """Wait for the next tick; the host's time then."""
        self._pacer.wait()
        return self._clock.now_ns()


class _Session:
    """One recording under way."""

    def __init__(
        self,
        source: Source,
        actuator: Actuator,
        writer: RecordingWriter,
        observers: Sequence[Observer],
        decisions: DecisionLoop,
        pace: _FastPace | _RealPace,
        rates: RateConfig,
        progress: Callable[[RecordingProgress], None] | None,
    ) -> None:
        self._source = source
        self._actuator = actuator
        self._writer = writer
        self._observers = observers
        self._decisions = decisions
        self._pace = pace
        self._progress = progress
        self._gaps = {
            LIDAR_SCAN: GapCounter(SECOND_NS / rates.scan_hz),
            CAMERA_IMAGE: GapCounter(SECOND_NS / rates.image_hz),
        }
        self._now_ns = source.start_ns
        self._began_s = perf_counter()
        self._reported_s = 0.0

    def run(self, seconds: float | None, interrupt: Interrupt) -> RecordingSummary:
        """Tick until the time is up, the source has ended, or the user wants to stop."""
        self._report(seconds, at_once=True)
        try:
            ending = self._ticks(seconds, interrupt)
        except KeyboardInterrupt:
            ending = Ending.INTERRUPTED
        except SdtError:
            self._note(Ending.FAILED)
            raise
        except Exception as error:
            self._note(Ending.FAILED)
            self._log(LogLevel.ERROR, f"the recording stopped: {type(error).__name__}: {error}")
            if isinstance(error, OSError):
                raise RunError(
                    f"{self._writer.path}: the {self._source.info.source} failed after {self._recorded_s:.1f} s "
                    f"({error}); what was recorded before is kept"
                ) from error
            raise
        if ending is Ending.INTERRUPTED:
            self._log(LogLevel.INFO, "stopped by the user")
        self._note(ending)
        self._report(seconds, at_once=True)
        return self._summary(ending)

    def end(self) -> None:
        """Stop the robot and close what was given."""
        try:
            self._actuator.command(_STANDSTILL)
        finally:
            self._source.close()
            for observer in self._observers:
                observer.close()

    def _ticks(self, seconds: float | None, interrupt: Interrupt) -> Ending:
        start_ns = self._source.start_ns
        end_ns = None if seconds is None else start_ns + round(seconds * SECOND_NS)
        while not interrupt.requested:
            now_ns = self._pace.next_ns()
            if end_ns is not None and now_ns >= end_ns:
                self._read(end_ns - 1)
                self._now_ns = end_ns
                return Ending.TIME
            self._read(now_ns)
            if self._source.finished:
                return Ending.SOURCE
            self._drive(now_ns)
            self._writer.keep_safe()
            self._report(seconds)
        return Ending.INTERRUPTED

    def _read(self, until_ns: int) -> None:
        self._now_ns = until_ns
        for received in self._source.read(until_ns):
            self._take(received)

    def _take(self, received: Received) -> None:
        self._keep(received)
        self._decisions.see(received.message)
        topic = topic_of(received.message).name
        gap = self._gaps.get(topic)
        missing = gap.see(received.message.stamp_ns) if gap is not None else 0
        if missing:
            text = f"{topic}: {missing} messages missing before {received.message.stamp_ns} ns"
            self._log(LogLevel.WARNING, text)

    def _drive(self, now_ns: int) -> None:
        command = self._decisions.decide(now_ns)
        if command is not None:
            self._actuator.command(command.twist)
            self._keep(Received(now_ns, command))

    def _log(self, level: LogLevel, text: str) -> None:
        self._keep(Received(self._now_ns, LogEntry(self._now_ns, level, text)))

    def _keep(self, received: Received) -> None:
        self._writer.write(received)
        for observer in self._observers:
            observer.observe(received)

    @property
    def _recorded_s(self) -> float:
        return (self._now_ns - self._source.start_ns) / SECOND_NS

    @property
    def _missed(self) -> int:
        return self._pace.missed + self._decisions.missed

    def _note(self, ending: Ending) -> None:
        self._writer.note(
            {
                "ending": ending,
                "seconds": f"{self._recorded_s:.3f}",
                "decisions": str(self._decisions.decisions),
                "forced_decisions": str(self._decisions.forced),
                "missed_deadlines": str(self._missed),
                **{f"dropped.{topic}": str(gap.missing) for topic, gap in self._gaps.items()},
            }
        )

    def _report(self, total_s: float | None, at_once: bool = False) -> None:
        wall_s = perf_counter() - self._began_s
        if self._progress is None or (wall_s - self._reported_s < _PROGRESS_S and not at_once):
            return
        self._reported_s = wall_s
        dropped = sum(gap.missing for gap in self._gaps.values())
        counts = dict(self._writer.counts)
        self._progress(
            RecordingProgress(self._recorded_s, total_s, wall_s, counts, self._writer.size, dropped, self._missed)
        )

    def _summary(self, ending: Ending) -> RecordingSummary:
        return RecordingSummary(
            recording_id=self._writer.recording_id,
            ending=ending,
            seconds=self._recorded_s,
            wall_s=perf_counter() - self._began_s,
            frames=dict(sorted(self._writer.counts.items())),
            dropped={topic: gap.missing for topic, gap in self._gaps.items()},
            missed_deadlines=self._missed,
            decisions=self._decisions.decisions,
            forced=self._decisions.forced,
            size_bytes=self._writer.size,
        )
