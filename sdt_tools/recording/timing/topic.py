"""The timing of one topic: its period, what is missing, jitter, and the delay from the sensor to the host."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Int64

from sdt_tools.recording.timing.drift import Drift, drift_of
from sdt_tools.recording.timing.pauses import Pauses, spans_pause
from sdt_tools.recording.timing.stamps import TopicStamps

LATE: Final = 1.5
"""An interval of more periods than this is a gap: it leaves room for another message."""


@dataclass(frozen=True)
class Spread:
    """Percentiles of some times, in nanoseconds."""

    min_ns: int
    p1_ns: int
    p50_ns: int
    p99_ns: int
    max_ns: int

    @property
    def width_ns(self) -> int:
        """Within this lie 98 % of them."""
        return self.p99_ns - self.p1_ns


@dataclass(frozen=True)
class TopicTiming:
    """When the messages of a topic came.

    ``period_ns`` is the median interval of sensor stamps, None for topics that have none by nature and where there are
    under three messages. A gap is an interval of over 1.5 periods; ``missing`` messages have room in all gaps together.
    ``jitter`` is how far the other intervals are from the period; ``delay`` is host time less sensor time, ``drift``
    its slope. ``backward`` stamps are earlier than that of a message received before, ``repeated`` ones equal another.
    Where a spread or a longest interval would be of nothing, it is None.
    """

    count: int
    first_ns: int
    last_ns: int
    period_ns: int | None
    gaps: int
    missing: int
    max_gap_ns: int | None
    backward: int
    repeated: int
    jitter: Spread | None
    delay: Spread
    drift: Drift | None


def topic_timing(stamps: TopicStamps, periodic: bool, pauses: Pauses = ()) -> TopicTiming:
    """The timing of ``stamps``, of which there is at least one; intervals with a pause in them do not count."""
    in_order = np.argsort(stamps.stamps_ns, kind="stable")
    stamps_ns = stamps.stamps_ns[in_order]
    delays_ns = (stamps.received_ns - stamps.stamps_ns)[in_order]
    intervals_ns = np.diff(stamps_ns)[~spans_pause(stamps.received_ns[in_order], pauses)]
    period_ns = period_of(intervals_ns) if periodic else None
    gap = intervals_ns > LATE * period_ns if period_ns is not None else np.zeros(len(intervals_ns), bool)
    missing = np.round(intervals_ns[gap] / period_ns) - 1 if period_ns is not None else np.zeros(0)
    return TopicTiming(
        count=len(stamps),
        first_ns=int(stamps.received_ns[0]),
        last_ns=int(stamps.received_ns[-1]),
        period_ns=period_ns,
        gaps=int(gap.sum()),
        missing=int(missing.sum()),
        max_gap_ns=int(intervals_ns.max()) if intervals_ns.size else None,
        backward=int(np.count_nonzero(np.diff(stamps.stamps_ns) < 0)),
        repeated=int(np.count_nonzero(intervals_ns == 0)),
        jitter=None if period_ns is None else spread_of(np.abs(intervals_ns[~gap] - period_ns)),
        delay=_known(spread_of(delays_ns)),
        drift=drift_of(stamps_ns, delays_ns),
    )


def period_of(intervals_ns: Int64[np.ndarray, "intervals"]) -> int | None:
    """The median of the intervals that are not zero; None where there are under two of them."""
    moving = intervals_ns[intervals_ns > 0]
    return round(float(np.median(moving))) if moving.size >= 2 else None


def spread_of(times_ns: Int64[np.ndarray, "times"]) -> Spread | None:
    """Exact percentiles, each one of the times themselves; None of no times."""
    if not times_ns.size:
        return None
    points = np.percentile(times_ns, [0, 1, 50, 99, 100], method="inverted_cdf")
    return Spread(*(int(point) for point in points))


def _known(spread: Spread | None) -> Spread:
    assert spread is not None
    return spread
