"""Host time that never jumps, and a pace that says when it could not be kept."""

import time
from collections.abc import Callable

FAST_EPOCH_NS = 1_735_689_600_000_000_000
"""Where time starts in a scene that runs as fast as it can (2025-01-01T00:00:00Z): same seed, same bytes."""

SECOND_NS = 1_000_000_000

LATE_SHARE = 0.5
"""Of a period: what comes later than this after its time is late. Less is what any scheduler does."""


class HostClock:
    """The monotonic clock plus an offset to UTC fixed once: a corrected wall clock does not disturb a session."""

    def __init__(
        self,
        wall_ns: Callable[[], int] = time.time_ns,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._monotonic_ns = monotonic_ns
        self._offset_ns = wall_ns() - monotonic_ns()

    def now_ns(self) -> int:
        """Nanoseconds since the Unix epoch, never running backwards."""
        return self._monotonic_ns() + self._offset_ns


class Pacer:
    """Releases its caller once a period and counts the deadlines that were missed by more than ``LATE_SHARE`` of it.

    A late caller is released at once and the schedule keeps its phase: the deadlines a whole period ago are counted as
    missed and skipped, never made up for in a burst.
    """

    def __init__(
        self,
        period_ns: int,
        clock: HostClock,
        sleep_s: Callable[[float], None] = time.sleep,
    ) -> None:
        if period_ns <= 0:
            raise ValueError(f"period_ns must be positive, not {period_ns}")
        self.period_ns = period_ns
        self.missed = 0
        self._clock = clock
        self._sleep_s = sleep_s
        self._deadline_ns = clock.now_ns()

    def wait(self) -> int:
        """Wait for the next deadline and return its stamp."""
        self._deadline_ns += self.period_ns
        while (left_ns := self._deadline_ns - self._clock.now_ns()) > 0:
            self._sleep_s(left_ns / SECOND_NS)
        skipped, late_ns = divmod(-left_ns, self.period_ns)
        self.missed += skipped + (late_ns > LATE_SHARE * self.period_ns)
        self._deadline_ns += skipped * self.period_ns
        return self._deadline_ns
