"""Take after take while the robot drives on: what whoever holds the controls wants is done between two ticks."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import RateConfig
from sdt_tools.errors import OutputExistsError
from sdt_tools.frames import LogEntry, LogLevel, Received
from sdt_tools.recording.live.clerk import Clerk
from sdt_tools.recording.live.control import Act, Control, Wish
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.recording.live.keep_last import KeepLast, Snapshot
from sdt_tools.recording.live.latched import Latched
from sdt_tools.recording.live.outcome import Ending, RecordingProgress
from sdt_tools.recording.live.session_folder import SessionFolder, SessionRecord
from sdt_tools.recording.live.sink import DirectSink, QueuedSink
from sdt_tools.recording.live.take import Take, Tally
from sdt_tools.recording.writer import RecordingWriter

_LISTEN_S: Final = 0.05

OpenWriter = Callable[[Path, Mapping[str, str], int, bool], RecordingWriter]
"""Opens a file for a take: its path, notes for its metadata, its start, and whether it is written in real time."""


@dataclass(frozen=True)
class SessionSummary:
    """What a session's folder holds now, and why it ended; ``cut_off`` takes were never closed."""

    folder: Path
    ending: Ending
    record: SessionRecord
    cut_off: tuple[Path, ...]


@dataclass(frozen=True)
class _Running:
    path: Path
    take: Take
    writer: RecordingWriter


class TakeRecorder:
    """A ``Recorder`` of takes in a session's folder; ``close`` it when the last source has ended.

    Each take lasts ``seconds``, or until somebody wants otherwise. Without ``control`` the session is one take, or with
    ``keep_last`` none at all: then only what the ring holds is written. Closing, listing and discarding files, and
    writing the ring, is done in a thread of its own, unless ``realtime`` is off.
    """

    def __init__(
        self,
        folder: SessionFolder,
        rates: RateConfig,
        seconds: float | None,
        realtime: bool,
        control: Control | None = None,
        keep_last: KeepLast | None = None,
    ) -> None:
        self.ending: Ending | None = None
        self._folder = folder
        self._rates = rates
        self._seconds = seconds
        self._realtime = realtime
        self._control = control
        self._keep_last = keep_last
        self._clerk = Clerk(at_once=not realtime)
        self._running: _Running | None = None
        self._starts = keep_last is None
        self._marks = 0
        self._began_ns = 0
        self._done = ""
        """What was done last of what was wanted: whoever pressed a key looks for it."""

    def begin(
        self, start_ns: int, open_writer: OpenWriter, tally: Callable[[], Tally], settle: Callable[[], None]
    ) -> None:
        """A source starts at ``start_ns``; its takes are opened by ``open_writer``.

        ``settle`` has all that was received so far recorded, pictures that are being encoded too.
        """
        self._settle = settle
        self._open_writer = open_writer
        self._tally = tally
        self._latched = Latched()
        self._began_ns = start_ns
        if self._starts:
            self._start(start_ns)
        self._starts = False

    def close(self) -> None:
        """Wait until all files are closed. Raises what went wrong with one."""
        self._clerk.close()

    def wait_for_start(
        self,
        interrupt: Interrupt,
        now_ns: Callable[[], int],
        progress: Callable[[RecordingProgress], None] | None = None,
    ) -> bool:
        """While no source runs: whether another one is to start, for the next take. False where all is to end."""
        while self._control is not None and not interrupt.requested:
            self._clerk.check()
            if progress is not None:
                progress(self._idle("the source has ended"))
            act = self._control.wait(_LISTEN_S)
            if act is None:
                continue
            if act.wish in (Wish.START, Wish.NEXT):
                self._starts = True
                return True
            if act.wish is Wish.DISCARD:
                self._discard_last(now_ns())
            if act.wish is Wish.QUIT:
                return False
        return False

    @property
    def end_ns(self) -> int | None:
        """When the running take's time is up; without one and without controls, the session's."""
        if self._running is not None:
            return self._running.take.end_ns
        if self._control is not None or self._seconds is None:
            return None
        return self._began_ns + round(self._seconds * SECOND_NS)

    def write(self, received: Received) -> None:
        """Into the take that runs, and the ring."""
        self._latched.see(received)
        if self._keep_last is not None:
            self._keep_last.see(received)
        if self._running is not None:
            self._running.take.write(received)

    def drop(self, topic: str, received_ns: int) -> None:
        """From the take that runs."""
        if self._running is not None:
            self._running.take.drop(topic, received_ns)

    def missing(self, topic: str, stamp_ns: int) -> int:
        """From the take that runs."""
        return 0 if self._running is None else self._running.take.missing(topic, stamp_ns)

    def tick(self, now_ns: int) -> Iterator[LogEntry]:
        """Do what is wanted, save the ring where something has happened, watch writer and disk."""
        self._clerk.check()
        if self._running is not None:
            yield from self._running.take.watch(now_ns)
            if self._running.take.disk_is_full:
                self.ending = Ending.DISK
        for act in self._control.heard() if self._control is not None else ():
            yield from self._do(act, now_ns)
        if self._keep_last is not None and not self._clerk.busy:
            self._save(self._keep_last.due(now_ns), now_ns)

    def time_up(self, now_ns: int) -> Iterator[LogEntry]:
        """The take ends; without controls all does."""
        if self._control is None:
            self.ending = Ending.TIME
            return
        yield from self.last_words(now_ns)
        self._end(Ending.TIME, now_ns)

    def last_words(self, now_ns: int) -> Iterator[LogEntry]:
        """Drops that are not told yet."""
        if self._running is not None:
            yield from self._running.take.last_words(now_ns)

    def end(self, ending: Ending, now_ns: int) -> None:
        """The source is through: the running take ends, and the ring is saved where it is due."""
        self._end(ending, now_ns)
        if self._keep_last is not None:
            self._save(self._keep_last.due(now_ns, at_end=True), now_ns)

    def progress(self, now_ns: int) -> RecordingProgress:
        """Where the running take stands."""
        if self._running is None:
            kept = f", the last {self._keep_last.seconds:g} s are kept" if self._keep_last is not None else ""
            return self._idle(f"no take is running{kept}")
        paused = " paused" if self._running.take.paused else ""
        return self._running.take.progress(now_ns, f"{self._running.path.stem}{paused}{self._told}")

    def _idle(self, state: str) -> RecordingProgress:
        return RecordingProgress(0.0, None, 0.0, {}, 0, 0, 0, state=f"{state}{self._told}", running=False)

    @property
    def _told(self) -> str:
        return f" ({self._done})" if self._done else ""

    def _do(self, act: Act, now_ns: int) -> Iterator[LogEntry]:
        """One wish. An entry is recorded before this goes on, which is why a pause is told before it begins."""
        self._settle()  # what was received before the wish belongs to what was before it
        running = self._running
        wish = act.wish
        if wish in (Wish.STOP, Wish.NEXT, Wish.QUIT, Wish.DISCARD):
            yield from self.last_words(now_ns)
        if wish is Wish.DISCARD:
            self._end(Ending.STOPPED, now_ns)
            self._discard_last(now_ns)
        elif wish in (Wish.STOP, Wish.NEXT):
            self._end(Ending.STOPPED, now_ns)
        elif wish is Wish.QUIT:
            self.ending = self.ending or Ending.STOPPED
        elif wish is Wish.MARK:
            self._marks += 1
            self._done = act.text or f"mark {self._marks}"
            yield LogEntry(now_ns, LogLevel.INFO, self._done, "mark")
        elif wish is Wish.NOTE:
            yield LogEntry(now_ns, LogLevel.INFO, act.text, "note")
        elif wish is Wish.SAVE and self._keep_last is not None:
            self._keep_last.trigger(act.text or "a key", now_ns)
        elif running is not None:
            yield from running.take.hear(wish, now_ns)
        if wish in (Wish.START, Wish.NEXT) and self._running is None:
            self._start(now_ns)

    def _start(self, now_ns: int) -> None:
        path = self._folder.next_path("take")
        notes = {"session": self._folder.record.id, "take": path.stem}
        writer = self._open_writer(path, notes, now_ns, self._realtime)
        sink = QueuedSink(writer) if self._realtime else DirectSink(writer)
        take = Take(sink, now_ns, self._seconds, self._rates, self._tally)
        self._running = _Running(path, take, writer)
        self._clerk.do(partial(self._folder.started, path, now_ns))
        for received in self._latched.messages(now_ns):
            take.write(received)

    def _end(self, ending: Ending, now_ns: int) -> None:
        if self._running is not None:
            running, self._running = self._running, None
            running.take.stop(now_ns)
            self._clerk.do(partial(self._finish, running, ending))

    def _finish(self, running: _Running, ending: Ending) -> None:
        summary = running.take.finish(ending, running.writer)
        try:
            running.writer.close()
        finally:
            self._folder.ended(running.path, summary)
            self._done = f"{running.path.stem} kept"
        running.take.check(ending)

    def _discard_last(self, now_ns: int) -> None:
        def discard() -> None:
            path = self._folder.last_kept()
            if path is not None:
                self._folder.discard(path, "discarded while recording", now_ns)
            self._done = "nothing to discard" if path is None else f"{path.stem} discarded"

        self._clerk.do(discard)

    def _save(self, snapshot: Snapshot | None, now_ns: int) -> None:
        if snapshot is not None:
            self._clerk.do(partial(self._write_ring, self._open_writer, snapshot, now_ns))

    def _write_ring(self, open_writer: OpenWriter, snapshot: Snapshot, now_ns: int) -> None:
        path = self._folder.next_path("event")
        assert self._keep_last is not None
        first_ns = snapshot.messages[0].received_ns
        notes = {
            "session": self._folder.record.id,
            "trigger": "; ".join(snapshot.triggers),
            "triggered_ns": str(snapshot.triggered_ns),
            "keep_last_s": f"{self._keep_last.seconds:g}",
        }
        part = path.with_name(f".{path.name}.part")
        seconds = (now_ns - first_ns) / SECOND_NS
        with open_writer(part, notes, first_ns, False) as writer:
            for received in snapshot.messages:
                writer.write(received)
            writer.note({"ending": "saved", "seconds": f"{seconds:.3f}"})
        if path.exists():
            raise OutputExistsError(path, None)
        part.rename(path)
        self._folder.started(path, first_ns, notes["trigger"])
        self._folder.saved(path, seconds, len(snapshot.messages))
        self._done = f"{path.stem} saved"
