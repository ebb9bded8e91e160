"""One file being recorded: what goes into it, what is missing from it, and what is said of it in the end."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import RateConfig
from sdt_tools.frames import LogEntry, LogLevel, Received
from sdt_tools.recording.live.control import Wish
from sdt_tools.recording.live.disk import DiskSpace
from sdt_tools.recording.live.gaps import GapCounter
from sdt_tools.recording.live.outcome import Ending, RecordingProgress, RecordingSummary
from sdt_tools.recording.live.sink import Sink
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.timing.pauses import PAUSES, paused_entry, pauses_text, resumed_entry
from sdt_tools.recording.writer import RecordingWriter


@dataclass(frozen=True)
class Tally:
    """What the loop has counted since it began."""

    decisions: int
    forced: int
    missed: int


@dataclass(frozen=True)
class _Ended:
    seconds: float
    wall_s: float
    tally: Tally


class Take:
    """A recording from ``start_ns`` on, of ``seconds`` without its pauses, or until somebody ends it.

    ``tally`` says what the loop has counted by now.
    """

    def __init__(
        self, sink: Sink, start_ns: int, seconds: float | None, rates: RateConfig, tally: Callable[[], Tally]
    ) -> None:
        self.sink = sink
        self.start_ns = start_ns
        self._length_ns = None if seconds is None else round(seconds * SECOND_NS)
        self._tally = tally
        self._before = tally()
        self._began_s = perf_counter()
        self._warned = False
        self._ended: _Ended | None = None
        self._paused_at_ns: int | None = None
        self._pauses_ns: list[tuple[int, int]] = []
        self._gaps = {
            LIDAR_SCAN: GapCounter(SECOND_NS / rates.scan_hz),
            CAMERA_IMAGE: GapCounter(SECOND_NS / rates.image_hz),
        }

    @property
    def paused(self) -> bool:
        """Whether what passes is left out for now."""
        return self._paused_at_ns is not None

    @property
    def end_ns(self) -> int | None:
        """When its time is up; None where it has no end, or is paused."""
        if self._length_ns is None or self.paused:
            return None
        return self.start_ns + self._length_ns + self._paused_ns

    @property
    def disk_is_full(self) -> bool:
        """Whether the recording has to end for want of room."""
        return self.sink.space is not None and self.sink.space.full

    @property
    def _paused_ns(self) -> int:
        return sum(end_ns - start_ns for start_ns, end_ns in self._pauses_ns)

    def recorded_s(self, now_ns: int) -> float:
        """Seconds recorded at ``now_ns``, pauses left out."""
        until_ns = now_ns if self._paused_at_ns is None else self._paused_at_ns
        return (until_ns - self.start_ns - self._paused_ns) / SECOND_NS

    def write(self, received: Received) -> None:
        """Record a message, unless paused."""
        if not self.paused:
            self.sink.write(received)

    def drop(self, topic: str, received_ns: int) -> None:
        """Count a message that was given up before it could be recorded, unless paused."""
        if not self.paused:
            self.sink.drop(topic, received_ns)

    def missing(self, topic: str, stamp_ns: int) -> int:
        """Take note of a message that has passed or was dropped; how many never came just before it."""
        gap = self._gaps.get(topic)
        if gap is None:
            return 0
        if self.paused:
            gap.pass_over(stamp_ns)
            return 0
        return gap.see(stamp_ns)

    def pause(self, now_ns: int) -> None:
        """Leave out what comes from ``now_ns`` on."""
        if self._paused_at_ns is None:
            self._paused_at_ns = now_ns

    def resume(self, now_ns: int) -> float:
        """Go on at ``now_ns``; for how many seconds nothing was recorded."""
        if self._paused_at_ns is None:
            return 0.0
        pause_ns = (self._paused_at_ns, now_ns)
        self._paused_at_ns = None
        self._pauses_ns.append(pause_ns)
        return (pause_ns[1] - pause_ns[0]) / SECOND_NS

    def hear(self, wish: Wish, now_ns: int) -> Iterator[LogEntry]:
        """Pause or resume, where that is the wish. The entry about a pause is to be recorded before it begins."""
        if wish is Wish.TOGGLE:
            wish = Wish.RESUME if self.paused else Wish.PAUSE
        if wish is Wish.PAUSE and not self.paused:
            yield paused_entry(now_ns)
            self.pause(now_ns)
        elif wish is Wish.RESUME and self.paused:
            yield resumed_entry(now_ns, self.resume(now_ns))

    def watch(self, now_ns: int) -> Iterator[LogEntry]:
        """Keep what was written safe; entries about drops and the disk. Raises what the file's writer raised."""
        self.sink.keep_safe()
        yield from self.sink.bursts(now_ns)
        space = self.sink.space
        if space is not None and space.low != self._warned:
            self._warned = space.low
            if space.low:
                yield LogEntry(now_ns, LogLevel.WARNING, _low(space), "disk")

    def last_words(self, now_ns: int) -> list[LogEntry]:
        """Entries about drops that are not told yet, to be recorded before the end."""
        return self.sink.bursts(now_ns, at_end=True)

    def stop(self, now_ns: int) -> None:
        """Nothing comes after ``now_ns``: what was counted up to here is this take's."""
        self.resume(now_ns)
        self._ended = _Ended(self.recorded_s(now_ns), perf_counter() - self._began_s, self._tally())

    def finish(self, ending: Ending, writer: RecordingWriter) -> RecordingSummary:
        """After ``stop``, in whatever thread: wait until all is with ``writer``, note in it what was recorded.

        Where the writer has failed by then, the ending is FAILED and ``check`` says why.
        """
        summary = self._summary(ending)
        writer.note(stats_of(summary))
        return summary

    def check(self, ending: Ending) -> None:
        """Raise what the writer has met while the last messages were written, unless ``ending`` tells of it."""
        if self.sink.failure is not None and ending is not Ending.FAILED:
            raise self.sink.failure

    def _summary(self, ending: Ending) -> RecordingSummary:
        assert self._ended is not None
        self.sink.finish()
        ended, before = self._ended, self._before
        missing = {topic: gap.missing for topic, gap in self._gaps.items()}
        return RecordingSummary(
            recording_id=self.sink.recording_id,
            ending=Ending.FAILED if self.sink.failure is not None else ending,
            seconds=ended.seconds,
            wall_s=ended.wall_s,
            frames=dict(sorted(self.sink.counts.items())),
            dropped=dict.fromkeys(missing, 0) | dict(sorted(self.sink.dropped.items())),
            missing=missing,
            missed_deadlines=ended.tally.missed - before.missed,
            decisions=ended.tally.decisions - before.decisions,
            forced=ended.tally.forced - before.forced,
            size_bytes=self.sink.size,
            pauses_ns=tuple(self._pauses_ns),
        )

    def progress(self, now_ns: int, state: str = "") -> RecordingProgress:
        """Where it stands."""
        space = self.sink.space
        return RecordingProgress(
            recorded_s=self.recorded_s(now_ns),
            total_s=None if self._length_ns is None else self._length_ns / SECOND_NS,
            wall_s=perf_counter() - self._began_s,
            counts=self.sink.counts,
            size_bytes=self.sink.size,
            dropped=sum(self.sink.dropped.values()),
            missed_deadlines=self._tally().missed - self._before.missed,
            missing=sum(gap.missing for gap in self._gaps.values()),
            disk_left_s=None if space is None else space.left_s,
            state=state,
            paused=self.paused,
        )


def stats_of(summary: RecordingSummary) -> dict[str, str]:
    """What ``sdt.stats`` says of a recording: drops are the recorder's, missing what never came from a sensor."""
    stats = {
        "ending": summary.ending.value,
        "seconds": f"{summary.seconds:.3f}",
        "decisions": str(summary.decisions),
        "forced_decisions": str(summary.forced),
        "missed_deadlines": str(summary.missed_deadlines),
        **{f"dropped.{topic}": str(count) for topic, count in summary.dropped.items()},
        **{f"missing.{topic}": str(count) for topic, count in summary.missing.items()},
    }
    if summary.pauses_ns:
        stats[PAUSES] = pauses_text(summary.pauses_ns)
    return stats


def _low(space: DiskSpace) -> str:
    left = "" if space.left_s is None else f", {space.left_s / 60:.1f} minutes at the present rate"
    return f"the disk has {space.free_bytes / 1e6:.0f} MB left{left}; the recording will be ended before it is full"
