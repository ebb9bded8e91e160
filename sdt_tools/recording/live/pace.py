"""When the loop's ticks come."""

from collections.abc import Callable
from time import sleep
from typing import Final, Protocol, runtime_checkable

from sdt_tools.clock import SECOND_NS, HostClock, Pacer

PATIENCE_S: Final = 0.05
"""A source that takes longer to read, as a scene on a slow machine, is left for a moment: the driver is to decide."""

_LOOKS_UP_S: Final = 0.05
"""Signals and keys are heard so often where nothing arrives."""
_SHORTEST_S: Final = 0.002

Arrival = Callable[[float], bool]
"""Waits for something to have arrived, at most so many seconds; whether it has."""


@runtime_checkable
class Pace(Protocol):
    """Releases the loop once a tick."""

    @property
    def missed(self) -> int:
        """Ticks that came too late: by more than half a period."""
        ...

    def next_ns(self) -> int:
        """Wait for the next tick; the stamp up to which the source is to be read."""
        ...

    def takes_long(self) -> bool:
        """Whether reading for this tick has taken so long that something else must be done meanwhile."""
        ...


class FastPace:
    """Ticks as fast as they are asked for, one scan period apart."""

    missed = 0

    def __init__(self, start_ns: int, scan_hz: float) -> None:
        self._start_ns = start_ns
        self._period_ns = SECOND_NS / scan_hz
        self._tick = -1

    def next_ns(self) -> int:
        """The stamp up to which the source is read next."""
        self._tick += 1
        return self._start_ns + round(self._tick * self._period_ns)

    def takes_long(self) -> bool:
        """Never: nobody waits."""
        return False


class RealPace:
    """Ticks when their time has come. What a late tick missed is read with it."""

    def __init__(self, clock: HostClock, scan_hz: float, sleep_s: Callable[[float], None]) -> None:
        self._clock = clock
        self._pacer = Pacer(round(SECOND_NS / scan_hz), clock, sleep_s)
        self._released_ns = clock.now_ns()

    @property
    def missed(self) -> int:
        """Ticks that came too late: by more than half a period."""
        return self._pacer.missed

    def next_ns(self) -> int:
        """Wait for the next tick; the host's time then."""
        self._pacer.wait()
        self._released_ns = self._clock.now_ns()
        return self._released_ns

    def takes_long(self) -> bool:
        """Whether the tick came ``PATIENCE_S`` ago."""
        return self._clock.now_ns() - self._released_ns > PATIENCE_S * SECOND_NS


class ArrivalPace:
    """Ticks whenever something has arrived, so that it is decided on at once; and where nothing comes, now and then."""

    def __init__(self, clock: HostClock, scan_hz: float, arrival: Arrival) -> None:
        self.missed = 0
        self._clock = clock
        self._arrival = arrival
        self._period_ns = round(SECOND_NS / scan_hz)
        self._released_ns: int | None = None

    def next_ns(self) -> int:
        """Wait for an arrival; the host's time then."""
        if self._released_ns is not None:
            self.missed += (self._clock.now_ns() - self._released_ns) // self._period_ns
        self._arrival(max(2.5 * self._period_ns / SECOND_NS, _LOOKS_UP_S))
        if self._released_ns is not None and self._clock.now_ns() - self._released_ns < _SHORTEST_S * SECOND_NS:
            sleep(_SHORTEST_S)  # what has arrived is not taken: a source that hangs is no reason to spin
        self._released_ns = self._clock.now_ns()
        return self._released_ns

    def takes_long(self) -> bool:
        """Whether the tick came ``PATIENCE_S`` ago."""
        return self._released_ns is not None and self._clock.now_ns() - self._released_ns > PATIENCE_S * SECOND_NS


def paced(
    start_ns: int,
    scan_hz: float,
    clock: HostClock | None,
    sleep_s: Callable[[float], None] = sleep,
    arrival: Arrival | None = None,
) -> FastPace | RealPace | ArrivalPace:
    """A tick a scan, at its ``arrival`` or else at the pace of ``clock``; without one, as fast as it can."""
    if clock is not None and arrival is not None:
        return ArrivalPace(clock, scan_hz, arrival)
    return FastPace(start_ns, scan_hz) if clock is None else RealPace(clock, scan_hz, sleep_s)
