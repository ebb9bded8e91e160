"""How the loop reads its source: at once, or in a thread of its own, so that a source that hangs holds up nothing."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Final, Protocol, runtime_checkable

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import RawPicture, Received
from sdt_tools.protocols import Source

SILENT_S: Final = 0.2
"""A source that has not come back from ``read`` for so long is silent: nobody knows what is before the robot."""
TOILING_S: Final = 1.0
"""It may take so long where it computes, as a scene does: on a machine that has no time for it nothing moves there."""
DEAD_S: Final = 5.0
"""One that has been silent for so long is not waited for any more."""
_SLICE_S: Final = 0.02
"""Waiting is counted in slices: where this process gets no processor at all, the source is not to blame."""
_IDLE_NS: Final = 2_000_000
"""Processor time that a source which hangs does not take in ``SILENT_S``."""
_CLOSE_S: Final = 1.0


@dataclass(frozen=True)
class Part:
    """What was read: up to ``read_to_ns``, or None where that would have taken too long, or where it has failed."""

    sensed: tuple[Received | RawPicture, ...] = ()
    read_to_ns: int | None = None
    failure: BaseException | None = None


@runtime_checkable
class Reading(Protocol):
    """Reads a source for the loop."""

    @property
    def silent_s(self) -> float:
        """For how long the source has been silent."""
        ...

    def read(self, until_ns: int) -> Part:
        """What was received up to ``until_ns``, or as much of it as does not take long: the next call goes on."""
        ...

    def close(self) -> None:
        """Close the source."""
        ...


class DirectReading:
    """Reads in the loop's own thread, for sources that run as fast as they can."""

    silent_s = 0.0

    def __init__(self, source: Source, takes_long: Callable[[], bool] = lambda: False) -> None:
        self._source = source
        self._takes_long = takes_long
        self._under_way: tuple[int, Iterator[Received | RawPicture]] | None = None
        """What is being read, and up to when."""

    def read(self, until_ns: int) -> Part:
        """As ``Reading``; a failure comes with what was read before it."""
        sensed: list[Received | RawPicture] = []
        try:
            while True:
                if self._under_way is None:
                    self._under_way = until_ns, iter(self._source.read(until_ns))
                goal_ns, reading = self._under_way
                for one in reading:
                    sensed.append(one)
                    if self._takes_long():
                        return Part(tuple(sensed))
                self._under_way = None
                if goal_ns >= until_ns:
                    return Part(tuple(sensed), goal_ns)
        except BaseException as failure:  # raised by the loop, after what came before it
            return Part(tuple(sensed), failure=failure)

    def close(self) -> None:
        """Close the source."""
        self._source.close()


class WatchedReading:
    """Reads in a thread of its own, and waits for it no longer than ``silent_after_s``, or ``TOILING_S`` at work.

    A thread in which the source hangs for ever is left behind; it does not keep the process from ending.
    """

    def __init__(self, source: Source, takes_long: Callable[[], bool], silent_after_s: float = SILENT_S) -> None:
        self._direct = DirectReading(source, takes_long)
        self._silent_after_s = silent_after_s
        self._wanted: SimpleQueue[int | None] = SimpleQueue()
        self._parts: SimpleQueue[Part] = SimpleQueue()
        self._is_asked = False
        self._silent_since_ns: int | None = None
        self._thread = threading.Thread(target=self._run, name="source", daemon=True)
        self._thread.start()

    @property
    def silent_s(self) -> float:
        """Seconds since the source was found silent, which it had been for a while then; 0 where it answers."""
        since_ns = self._silent_since_ns
        return 0.0 if since_ns is None else self._silent_after_s + (time.monotonic_ns() - since_ns) / SECOND_NS

    def read(self, until_ns: int) -> Part:
        """As ``Reading``. A source that is silent is not waited for again before it has answered."""
        if not self._is_asked:
            self._wanted.put(until_ns)
            self._is_asked = True
        part = self._wait()
        if part is None:
            self._silent_since_ns = self._silent_since_ns or time.monotonic_ns()
            return Part()
        self._is_asked, self._silent_since_ns = False, None
        return part

    def _wait(self) -> Part | None:
        """What comes; None where the source is silent."""
        if self._silent_since_ns is not None:
            return self._part_within(0.0)
        slices, patience, worked_ns = 0, round(self._silent_after_s / _SLICE_S), self._worked_ns()
        while (part := self._part_within(_SLICE_S)) is None:
            slices += 1
            if slices % patience:
                continue
            before_ns, worked_ns = worked_ns, self._worked_ns()
            if worked_ns - before_ns < _IDLE_NS or slices * _SLICE_S >= TOILING_S:
                return None
        return part

    def _part_within(self, seconds: float) -> Part | None:
        try:
            return self._parts.get(timeout=seconds)
        except Empty:
            return None

    def _worked_ns(self) -> int:
        """Processor time that the source has taken so far."""
        assert self._thread.ident is not None
        return time.clock_gettime_ns(time.pthread_getcpuclockid(self._thread.ident))

    def close(self) -> None:
        """Close the source, from another thread where it hangs."""
        self._wanted.put(None)
        self._thread.join(_CLOSE_S if self._silent_since_ns is None else 0.0)
        if not self._thread.is_alive():
            self._direct.close()
            return
        closer = threading.Thread(target=self._direct.close, name="source-close", daemon=True)
        closer.start()
        closer.join(_CLOSE_S)

    def _run(self) -> None:
        while (until_ns := self._wanted.get()) is not None:
            self._parts.put(self._direct.read(until_ns))


def reading_of(source: Source, takes_long: Callable[[], bool], realtime: bool) -> Reading:
    """Reads ``source`` in a thread of its own where the recording keeps the pace of ``realtime``."""
    return WatchedReading(source, takes_long) if realtime else DirectReading(source, takes_long)
