"""The live loop: reads a source, asks a driver, moves the robot, hands everything to whoever records it."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from time import perf_counter
from typing import Final, Protocol, runtime_checkable

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import RecordingError, RunError, SdtError
from sdt_tools.frames import LogEntry, LogLevel, RawPicture, Received, Twist
from sdt_tools.protocols import Actuator, Observer, Source
from sdt_tools.recording.live.decide import BLIND_S, DecisionLoop
from sdt_tools.recording.live.encoder import PictureEncoder
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.recording.live.outcome import ENDING_BY_SIGNAL, Ending, RecordingProgress
from sdt_tools.recording.live.pace import Pace
from sdt_tools.recording.live.reading import DEAD_S, DirectReading, Reading
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, topic_of

_PROGRESS_S: Final = 0.25
_STANDSTILL: Final = Twist(0.0, 0.0)
_LAST_WORDS: Final = {
    Ending.INTERRUPTED: "stopped by the user",
    Ending.TERMINATED: "stopped by SIGTERM",
    Ending.HANGUP: "stopped: the terminal hung up",
    Ending.DISK: "stopped: the disk is nearly full",
}


@runtime_checkable
class Recorder(Protocol):
    """Records what passes: one file, or take after take."""

    @property
    def end_ns(self) -> int | None:
        """When the time of what is recorded is up; None while there is no such moment."""
        ...

    @property
    def ending(self) -> Ending | None:
        """Why the loop is to stop; None as long as it is to go on."""
        ...

    def write(self, received: Received) -> None:
        """Take one message. Raises RecordingError where the disk refuses."""
        ...

    def drop(self, topic: str, received_ns: int) -> None:
        """Count a message that could not be taken in time."""
        ...

    def missing(self, topic: str, stamp_ns: int) -> int:
        """Take note of a message that was written or dropped; how many are missing just before it."""
        ...

    def tick(self, now_ns: int) -> Iterable[LogEntry]:
        """Do what is due; each entry is to be recorded before the next is asked for."""
        ...

    def time_up(self, now_ns: int) -> Iterable[LogEntry]:
        """``end_ns`` has come; ``ending`` may change. As ``tick``."""
        ...

    def last_words(self, now_ns: int) -> Iterable[LogEntry]:
        """What is to be recorded before the end."""
        ...

    def end(self, ending: Ending, now_ns: int) -> None:
        """Nothing comes any more. Raises RecordingError where the disk has refused what came last."""
        ...

    def progress(self, now_ns: int) -> RecordingProgress | None:
        """Where it stands; None where there is nothing to show."""
        ...


class LiveLoop:
    """One source under way. ``run`` once, then ``close``: together they leave the robot standing, come what may.

    Raw pictures go through ``encoder``, which encodes at once unless another is given, and pass when they are encoded.
    The source is read by ``reading``, in this thread unless another is given.
    """

    def __init__(
        self,
        source: Source,
        actuator: Actuator,
        decisions: DecisionLoop,
        pace: Pace,
        observers: Sequence[Observer],
        recorder: Recorder,
        progress: Callable[[RecordingProgress], None] | None = None,
        encoder: PictureEncoder | None = None,
        reading: Reading | None = None,
    ) -> None:
        self._source = source
        self._reading = reading or DirectReading(source, pace.takes_long)
        self._actuator = actuator
        self._decisions = decisions
        self._pace = pace
        self._observers = observers
        self._recorder = recorder
        self._progress = progress
        self._encoder = encoder or PictureEncoder(behind=False)
        self._now_ns = source.start_ns
        self._is_silent = False
        self._reported_s = 0.0
        self._stands = False

    def run(self, interrupt: Interrupt) -> Ending:
        """Tick until the recorder has enough, the source has ended, or a signal wants it to end.

        The robot stands still before the recorder is told of the end, and unless its time was up, so that nothing more
        belongs to it, the recording says so. Raises RunError where the source fails.
        """
        self._report(at_once=True)
        try:
            ending = self._ticks(interrupt)
        except KeyboardInterrupt:
            ending = Ending.INTERRUPTED
        except Exception as error:
            self._fail(error)
            if isinstance(error, SdtError) or not isinstance(error, OSError):
                raise
            seconds = (self._now_ns - self._source.start_ns) / SECOND_NS
            raise RunError(
                f"the {self._source.info.source} failed after {seconds:.1f} s ({error}); "
                "what was recorded before is kept"
            ) from error
        try:
            self._stand_still(told=ending is not Ending.TIME)
            self.settle()
            if ending in _LAST_WORDS:
                self._log(LogLevel.INFO, _LAST_WORDS[ending])
            self._log_all(self._recorder.last_words(self._now_ns))
        finally:
            self._recorder.end(ending, self._now_ns)
        self._report(at_once=True)
        return ending

    def settle(self) -> None:
        """Wait for the pictures that are being encoded, and have them pass."""
        try:
            self._encoder.wait()
        finally:
            self._take_pictures()

    def close(self) -> None:
        """Stop the robot, if it does not stand yet, and close what was given."""
        try:
            if not self._stands:
                self._stand_still(told=False)
        finally:
            self._encoder.close()
            self._reading.close()
            for observer in self._observers:
                observer.close()

    def _fail(self, error: Exception) -> None:
        try:
            with suppress(OSError, SdtError):  # tried again by ``close``, which says so
                self._stand_still(told=True)
            if not isinstance(error, RecordingError):
                with suppress(SdtError):  # more pictures that cannot be encoded
                    self.settle()
                self._log(LogLevel.ERROR, f"the recording stopped: {type(error).__name__}: {error}")
                self._log_all(self._recorder.last_words(self._now_ns))
        finally:
            self._recorder.end(Ending.FAILED, self._now_ns)

    def _stand_still(self, told: bool) -> None:
        """Stop the robot; where it moved, have that command pass if it is to be ``told``."""
        self._actuator.command(_STANDSTILL)
        self._stands = True
        command = self._decisions.stop(self._now_ns)
        if command is not None and told:
            self._keep(Received(self._now_ns, command))

    def _ticks(self, interrupt: Interrupt) -> Ending:
        recorder = self._recorder
        while not interrupt.requested:
            now_ns = self._pace.next_ns()
            end_ns = recorder.end_ns
            ends = end_ns is not None and now_ns >= end_ns
            is_read = self._read(now_ns if end_ns is None or not ends else end_ns - 1)
            if is_read and end_ns is not None and ends:
                self._now_ns = end_ns
                self.settle()
                self._log_all(recorder.time_up(end_ns))
                if recorder.ending is not None:
                    return recorder.ending
                is_read = self._read(now_ns)
            if is_read and self._source.finished:
                return Ending.SOURCE
            self._drive(self._now_ns)
            self._log_all(recorder.tick(self._now_ns))
            if recorder.ending is not None:
                return recorder.ending
            self._report()
        assert interrupt.signal is not None
        return ENDING_BY_SIGNAL[interrupt.signal]

    def _read(self, until_ns: int) -> bool:
        """Read the source up to ``until_ns``, or as far as that does not take long; whether all is read.

        Where it is not, the next call goes on from there, and it is as early as what was read last. Raises what the
        source has raised, RunError where it has been silent for too long.
        """
        part = self._reading.read(until_ns)
        for sensed in part.sensed:
            self._now_ns = max(self._now_ns, sensed.received_ns)
            if isinstance(sensed, RawPicture):
                self._encoder.put(sensed)
            else:
                self._take(sensed)
            self._take_pictures()
        if part.failure is not None:
            raise part.failure
        self._mind_silence()
        if part.read_to_ns is None:
            return False
        self._now_ns = part.read_to_ns
        return part.read_to_ns >= until_ns

    def _mind_silence(self) -> None:
        """Have the robot stand while the source does not come back. Raises RunError where it will not any more."""
        silent_s, name = self._reading.silent_s, self._source.info.source
        if not self._is_silent and silent_s > 0:
            self._stand_still(told=True)
            self._log(LogLevel.WARNING, f"the {name} does not answer: the robot stands until it does")
        elif self._is_silent and silent_s == 0:
            self._log(LogLevel.INFO, f"the {name} answers again")
        self._is_silent = silent_s > 0
        if silent_s > DEAD_S:
            raise RunError(f"the {name} has not answered for {silent_s:.0f} s; what was recorded before is kept")

    def _take_pictures(self) -> None:
        """Those that are encoded by now, and those that were dropped, in their order."""
        while (picture := self._encoder.take()) is not None:
            if isinstance(picture, Received):
                self._take(picture)
            else:
                self._recorder.drop(CAMERA_IMAGE, picture.received_ns)
                self._note_missing(CAMERA_IMAGE, picture.stamp_ns)

    def _take(self, received: Received) -> None:
        self._keep(received)
        self._decisions.see(received.message, self._now_ns)
        self._note_missing(topic_of(received.message).name, received.message.stamp_ns)

    def _note_missing(self, topic: str, stamp_ns: int) -> None:
        missing = self._recorder.missing(topic, stamp_ns)
        if missing:
            self._log(LogLevel.WARNING, f"{topic}: {missing} messages missing before {stamp_ns} ns")

    def _drive(self, now_ns: int) -> None:
        if self._decisions.blind(now_ns):
            self._stand_still(told=True)
            self._log(LogLevel.WARNING, f"no scan for {BLIND_S:g} s or more: the robot stands until one comes")
        command = self._decisions.decide(now_ns)
        if command is not None:
            self._stands = False
            self._actuator.command(command.twist)
            self._keep(Received(now_ns, command))
            self._log_all(self._decisions.news())

    def _log(self, level: LogLevel, text: str) -> None:
        self._keep(Received(self._now_ns, LogEntry(self._now_ns, level, text)))

    def _log_all(self, entries: Iterable[LogEntry]) -> None:
        for entry in entries:
            self._keep(Received(entry.stamp_ns, entry))

    def _keep(self, received: Received) -> None:
        self._recorder.write(received)
        for observer in self._observers:
            observer.observe(received)

    def _report(self, at_once: bool = False) -> None:
        now_s = perf_counter()
        if self._progress is None or (now_s - self._reported_s < _PROGRESS_S and not at_once):
            return
        self._reported_s = now_s
        progress = self._recorder.progress(self._now_ns)
        if progress is not None:
            try:
                self._progress(progress)
            except OSError:
                self._progress = None  # a terminal that is gone is no reason to stop
