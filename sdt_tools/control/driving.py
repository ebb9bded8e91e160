"""A controller at the wheel of a source and an actuator: the scene, or a robot; with a recording or without one."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from time import perf_counter

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.config import MotionConfig, RateConfig
from sdt_tools.control.latency import Latency, Stopwatch, latency_of
from sdt_tools.frames import LogEntry, Received
from sdt_tools.protocols import Actuator, Chooser, Expert, Observer, Source
from sdt_tools.recording.live.control import Control, Wish
from sdt_tools.recording.live.decide import Deciders, DecisionLoop
from sdt_tools.recording.live.encoder import PictureEncoder
from sdt_tools.recording.live.interrupt import Interrupt, deferred_interrupt
from sdt_tools.recording.live.loop import LiveLoop
from sdt_tools.recording.live.outcome import Ending, RecordingProgress, RecordingSummary
from sdt_tools.recording.live.pace import paced
from sdt_tools.recording.live.reading import reading_of
from sdt_tools.recording.live.record import record
from sdt_tools.recording.writer import RecordingWriter


@dataclass(frozen=True)
class Wheel:
    """Who drives what, how often, and how fast each motion is. ``expert`` is asked beside, where there is one.

    Of a ``simulated`` source the stamps are no times of arrival: a scan arrives when the loop is given it.
    """

    source: Source
    actuator: Actuator
    chooser: Chooser
    rates: RateConfig
    motions: MotionConfig
    expert: Expert | None = None
    simulated: bool = False


@dataclass(frozen=True)
class DriveSummary:
    """How a drive went. ``latency`` is from a scan's arrival to the command that was decided on it.

    ``recording`` is what was recorded of it, if it was.
    """

    ending: Ending
    seconds: float
    wall_s: float
    decisions: int
    missed_deadlines: int
    latency: Latency
    recording: RecordingSummary | None = None


def drive(
    wheel: Wheel,
    observers: Sequence[Observer] = (),
    seconds: float | None = None,
    clock: HostClock | None = None,
    writer: RecordingWriter | None = None,
    progress: Callable[[RecordingProgress], None] | None = None,
    control: Control | None = None,
    interrupt: Interrupt | None = None,
) -> DriveSummary:
    """Drive for ``seconds``, or until the source ends; in real time by ``clock``, without one as fast as it can.

    Signals end it in order unless ``interrupt`` hears them already. On every way out the robot is told to stand still
    and source and observers are closed; the writer and the chooser are the caller's to close. Raises RunError where the
    source fails, RecordingError where the disk refuses.
    """
    stopwatch = Stopwatch(wheel.actuator, None if wheel.simulated else clock)
    watching = [stopwatch, *observers]
    with nullcontext(interrupt) if interrupt is not None else deferred_interrupt() as heard:
        if writer is None:
            return _drive_unrecorded(wheel, stopwatch, watching, seconds, clock, progress, control, heard)
        summary = record(
            wheel.source,
            stopwatch,
            wheel.chooser,
            wheel.expert,
            writer,
            watching,
            wheel.rates,
            wheel.motions,
            seconds,
            clock is not None,
            clock,
            progress=progress,
            interrupt=heard,
            control=control,
        )
    return DriveSummary(
        summary.ending,
        summary.seconds,
        summary.wall_s,
        summary.decisions,
        summary.missed_deadlines,
        latency_of(stopwatch.delays_s),
        summary,
    )


def _drive_unrecorded(
    wheel: Wheel,
    stopwatch: Stopwatch,
    observers: Sequence[Observer],
    seconds: float | None,
    clock: HostClock | None,
    progress: Callable[[RecordingProgress], None] | None,
    control: Control | None,
    interrupt: Interrupt,
) -> DriveSummary:
    source, rates = wheel.source, wheel.rates
    decisions = DecisionLoop(Deciders(wheel.chooser, wheel.expert), wheel.motions, rates, source.start_ns)
    pace = paced(source.start_ns, rates.scan_hz, clock)
    recorder = _Unrecorded(source.start_ns, seconds, control, lambda: pace.missed + decisions.missed)
    encoder = PictureEncoder(behind=clock is not None)
    reading = reading_of(source, pace.takes_long, clock is not None)
    loop = LiveLoop(source, stopwatch, decisions, pace, observers, recorder, progress, encoder, reading)
    started_s = perf_counter()
    try:
        ending = loop.run(interrupt)
    finally:
        loop.close()
    return DriveSummary(
        ending,
        recorder.lasted_s,
        perf_counter() - started_s,
        decisions.decisions,
        pace.missed + decisions.missed,
        latency_of(stopwatch.delays_s),
    )


class _Unrecorded:
    """Keeps the time and hears who wants it to end. Implements Recorder."""

    def __init__(
        self, start_ns: int, seconds: float | None, control: Control | None, missed: Callable[[], int]
    ) -> None:
        self.end_ns = None if seconds is None else start_ns + round(seconds * SECOND_NS)
        self.ending: Ending | None = None
        self.lasted_s = 0.0
        self._start_ns = start_ns
        self._total_s = seconds
        self._control = control
        self._missed = missed
        self._began_s = perf_counter()

    def write(self, received: Received) -> None:
        """Let it pass."""

    def drop(self, topic: str, received_ns: int) -> None:
        """Nothing is kept that could be missed."""

    def missing(self, topic: str, stamp_ns: int) -> int:
        """Nobody counts."""
        del topic, stamp_ns
        return 0

    def tick(self, now_ns: int) -> list[LogEntry]:
        """Hear whether it is to end."""
        del now_ns
        wishes = [act.wish for act in self._control.heard()] if self._control is not None else []
        if Wish.STOP in wishes or Wish.QUIT in wishes:
            self.ending = Ending.STOPPED
        return []

    def time_up(self, now_ns: int) -> list[LogEntry]:
        """Enough."""
        del now_ns
        self.ending = Ending.TIME
        return []

    def last_words(self, now_ns: int) -> list[LogEntry]:
        """None."""
        del now_ns
        return []

    def end(self, ending: Ending, now_ns: int) -> None:
        """Note how long it took."""
        self.ending = ending
        self.lasted_s = (now_ns - self._start_ns) / SECOND_NS

    def progress(self, now_ns: int) -> RecordingProgress:
        """How long it has driven."""
        lasted_s = (now_ns - self._start_ns) / SECOND_NS
        return RecordingProgress(
            recorded_s=lasted_s,
            total_s=self._total_s,
            wall_s=perf_counter() - self._began_s,
            counts={},
            size_bytes=0,
            dropped=0,
            missed_deadlines=self._missed(),
        )
