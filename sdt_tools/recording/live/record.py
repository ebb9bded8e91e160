"""One recording of one source."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from time import sleep

from sdt_tools.clock import HostClock
from sdt_tools.config import MotionConfig, RateConfig
from sdt_tools.errors import RunError
from sdt_tools.frames import LogEntry, LogLevel, Received
from sdt_tools.protocols import Actuator, Chooser, Driver, Expert, Observer, Source
from sdt_tools.recording.live.control import Act, Control, Wish
from sdt_tools.recording.live.decide import Deciders, DecisionLoop, Perturb
from sdt_tools.recording.live.disk import DiskWatch
from sdt_tools.recording.live.encoder import Encode, PictureEncoder, encode_jpeg
from sdt_tools.recording.live.interrupt import Interrupt, deferred_interrupt
from sdt_tools.recording.live.loop import LiveLoop
from sdt_tools.recording.live.outcome import Ending, RecordingProgress, RecordingSummary
from sdt_tools.recording.live.pace import paced
from sdt_tools.recording.live.pressure import QueueLimits
from sdt_tools.recording.live.reading import reading_of
from sdt_tools.recording.live.sink import DirectSink, QueuedSink
from sdt_tools.recording.live.take import Take, Tally
from sdt_tools.recording.writer import RecordingWriter


def record(
    source: Source,
    actuator: Actuator,
    driver: Driver | Chooser,
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
    interrupt: Interrupt | None = None,
    limits: QueueLimits | None = None,
    disk: DiskWatch | None = None,
    encode: Encode = encode_jpeg,
    control: Control | None = None,
) -> RecordingSummary:
    """Record ``source`` for ``seconds`` (without, until it ends) while ``driver`` moves ``actuator``.

    The source is read in ticks of one scan period; with ``realtime`` ticks keep the pace of ``clock``, the host's
    unless another is given, a thread of its own writes and another one encodes raw pictures by ``encode``: what they
    cannot keep up with is dropped as ``pressure`` says, and the recording ends before the ``disk`` is full. Ctrl-C,
    SIGTERM and SIGHUP end the recording as if its time were up, and the summary says so; ``interrupt`` is what hears
    them, where the caller listens already. Whoever holds ``control`` may pause, mark and end it. On every way out the
    robot is told to stand still, and source and observers are closed; the writer is the caller's to close.

    Raises RunError where the source fails, after a word in ``/session/log``; RecordingError where the disk refuses.
    """
    decisions = DecisionLoop(Deciders(driver, expert, perturb), motions, rates, source.start_ns)
    pace = paced(source.start_ns, rates.scan_hz, (clock or HostClock()) if realtime else None, sleep_s)
    sink = QueuedSink(writer, limits, disk) if realtime else DirectSink(writer)

    def tally() -> Tally:
        return Tally(decisions.decisions, decisions.forced, pace.missed + decisions.missed)

    encoder = PictureEncoder(realtime, limits, encode)
    recorder = _OneTake(Take(sink, source.start_ns, seconds, rates, tally), writer, control)
    reading = reading_of(source, pace.takes_long, realtime)
    loop = LiveLoop(source, actuator, decisions, pace, observers, recorder, progress, encoder, reading)
    recorder.settle = loop.settle
    try:
        if interrupt is not None:
            loop.run(interrupt)
        else:
            with deferred_interrupt() as own:
                loop.run(own)
    except RunError as error:
        raise RunError(f"{writer.path}: {error}") from error.__cause__
    finally:
        loop.close()
    assert recorder.summary is not None
    return replace(recorder.summary, size_bytes=writer.size)


class _OneTake:
    """Records until the take's time is up, or whoever holds the controls ends it."""

    def __init__(self, take: Take, writer: RecordingWriter, control: Control | None) -> None:
        self.ending: Ending | None = None
        self.summary: RecordingSummary | None = None
        self.settle: Callable[[], None] = lambda: None
        """Has all that was received so far recorded."""
        self._take = take
        self._writer = writer
        self._control = control
        self._marks = 0

    @property
    def end_ns(self) -> int | None:
        """When the take's time is up."""
        return self._take.end_ns

    def write(self, received: Received) -> None:
        """Into the take."""
        self._take.write(received)

    def drop(self, topic: str, received_ns: int) -> None:
        """From the take."""
        self._take.drop(topic, received_ns)

    def missing(self, topic: str, stamp_ns: int) -> int:
        """From the take."""
        return self._take.missing(topic, stamp_ns)

    def tick(self, now_ns: int) -> Iterator[LogEntry]:
        """Do what is wanted, watch the writer and the disk."""
        yield from self._take.watch(now_ns)
        for act in self._control.heard() if self._control is not None else ():
            yield from self._do(act, now_ns)
        if self._take.disk_is_full:
            self.ending = Ending.DISK

    def _do(self, act: Act, now_ns: int) -> Iterator[LogEntry]:
        self.settle()
        if act.wish in (Wish.STOP, Wish.QUIT):
            self.ending = Ending.STOPPED
        elif act.wish is Wish.MARK:
            self._marks += 1
            yield LogEntry(now_ns, LogLevel.INFO, act.text or f"mark {self._marks}", "mark")
        elif act.wish is Wish.NOTE:
            yield LogEntry(now_ns, LogLevel.INFO, act.text, "note")
        else:
            yield from self._take.hear(act.wish, now_ns)

    def time_up(self, now_ns: int) -> list[LogEntry]:
        """Enough."""
        del now_ns
        self.ending = Ending.TIME
        return []

    def last_words(self, now_ns: int) -> list[LogEntry]:
        """Drops that are not told yet."""
        return self._take.last_words(now_ns)

    def end(self, ending: Ending, now_ns: int) -> None:
        """Note what came of it. Raises what the writer met while the last messages were written."""
        self._take.stop(now_ns)
        self.summary = self._take.finish(ending, self._writer)
        self._take.check(ending)

    def progress(self, now_ns: int) -> RecordingProgress:
        """Where the take stands."""
        return self._take.progress(now_ns)
