"""A device's microseconds as host time.

A telegram says when it left, by the device's clock, and the host knows when it arrived. The difference is the offset of
the clocks plus a delay that is never negative and now and then nearly zero. So the line that is nowhere above the
differences, and over their middle as high as that allows, follows offset and drift, and what is late does not touch it:
the edge of the lower convex hull there (Zhang, Liu and Xia, *Clock synchronization algorithms for network
measurements*, INFOCOM 2002). What delay every telegram has cannot be seen; stamps are late by it.
"""

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

WINDOW_US: Final = 60_000_000
"""Older differences are forgotten: a quartz that warms up changes its pace by a part in a million a minute."""
_BUCKET_US: Final = 500_000
"""Of each such span, the least difference is kept."""
FASTEST: Final = 200e-6
"""Quartz clocks part by at most 100 ppm each."""
SETTLED_AFTER: Final = 25
"""The least of so many delays is taken for zero: half a second at 50 Hz. Of delays of 5 ms in the middle,
exponentially distributed, it passes 2 ms once in 20 000 times."""
_DRIFT_AFTER_US: Final = 10_000_000
_TURN_US: Final = 1 << 32
_EARLY_NS: Final = 50_000_000
_LATE_NS: Final = 1_000_000_000
_LATE_AT_ONCE_NS: Final = 200_000_000
_LATE_FOR_US: Final = 2_000_000


@dataclass(frozen=True)
class _Line:
    """``offset_ns`` at ``at_us``, and by how much it grows each microsecond, in nanoseconds."""

    at_us: float
    offset_ns: float
    slope: float

    def at(self, device_us: int) -> float:
        return self.offset_ns + self.slope * (device_us - self.at_us)


_STANDING: Final = _Line(0.0, 0.0, 0.0)


class DeviceClock:
    """Maps a 32-bit counter of microseconds to host time. ``see`` a telegram before its stamps are asked for."""

    def __init__(self) -> None:
        self.restarts = 0
        """How often the device's time jumped, as after a power cycle, and everything was learnt anew."""
        self._points: deque[tuple[int, int]] = deque()
        self._line = _STANDING
        self._base_ns = self._newest_us = self._seen = 0
        self._new_link = False
        self._late_since_us: int | None = None

    @property
    def settled(self) -> bool:
        """Whether enough telegrams were seen for stamps to be trusted."""
        return self._seen >= SETTLED_AFTER

    @property
    def drift_ppm(self) -> float | None:
        """By how much the device's clock is slower than the host's, negative where it is faster.

        None before ten seconds are seen.
        """
        known = self._seen and self._newest_us - self._points[0][0] >= _DRIFT_AFTER_US
        return self._line.slope * 1e3 if known else None

    def reconnected(self) -> None:
        """The next telegram comes over a new link: its delay is short, or the device was off meanwhile."""
        self._new_link = True

    def see(self, sent_us: int, received_ns: int) -> int:
        """Learn from a telegram that left at ``sent_us`` (raw); the same without wraps."""
        device_us = self._unwrapped(sent_us, received_ns)
        if self._seen and self._jumped(device_us, received_ns):
            self.restarts += 1
            self._forget()
            device_us = sent_us
        self._new_link = False
        if not self._seen:
            self._base_ns = received_ns - device_us * 1000
        offset_ns = received_ns - device_us * 1000 - self._base_ns
        self._seen += 1
        self._newest_us = device_us
        if self._keep(device_us, offset_ns) or offset_ns < self._line.at(device_us):
            self._fit()
        return device_us

    def host_ns(self, raw_us: int) -> int:
        """The host's time at ``raw_us``, which lies within half an hour of the telegram seen last."""
        device_us = raw_us + round((self._newest_us - raw_us) / _TURN_US) * _TURN_US
        return self._base_ns + device_us * 1000 + round(self._line.at(device_us))

    def _forget(self) -> None:
        self._points.clear()
        self._line = _STANDING
        self._seen = 0
        self._late_since_us = None

    def _unwrapped(self, raw_us: int, received_ns: int) -> int:
        if not self._seen:
            return raw_us
        expected_us = (received_ns - self._base_ns) / 1000
        return raw_us + round((expected_us - raw_us) / _TURN_US) * _TURN_US

    def _jumped(self, device_us: int, received_ns: int) -> bool:
        """Whether no delay explains what the device says of its time."""
        delay_ns = received_ns - self._base_ns - device_us * 1000 - self._line.at(device_us)
        if delay_ns < -_EARLY_NS or (self._new_link and delay_ns > _LATE_AT_ONCE_NS):
            return True
        if delay_ns < _LATE_NS:
            self._late_since_us = None
        elif self._late_since_us is None:
            self._late_since_us = device_us
        return self._late_since_us is not None and device_us - self._late_since_us > _LATE_FOR_US

    def _keep(self, device_us: int, offset_ns: int) -> bool:
        """Keep the difference if it is the least of its bucket; whether a bucket was begun."""
        points = self._points
        begins = not points or points[-1][0] // _BUCKET_US != device_us // _BUCKET_US
        if begins:
            points.append((device_us, offset_ns))
            while points[0][0] < device_us - WINDOW_US:
                points.popleft()
        elif offset_ns < points[-1][1]:
            points[-1] = (device_us, offset_ns)
        return begins

    def _fit(self) -> None:
        middle_us = sum(device_us for device_us, _ in self._points) / len(self._points)
        slope = min(max(_slope_below(list(self._points), middle_us), -FASTEST * 1e3), FASTEST * 1e3)
        offset_ns = min(offset - slope * (device_us - middle_us) for device_us, offset in self._points)
        self._line = _Line(middle_us, offset_ns, slope)


def _slope_below(points: list[tuple[int, int]], middle_us: float) -> float:
    """The slope of the lower hull's edge at ``middle_us`` (Andrew's monotone chain); 0 for a single point."""
    hull: list[tuple[int, int]] = []
    for x, y in points:
        while len(hull) > 1:
            (x0, y0), (x1, y1) = hull[-2:]
            if (x1 - x0) * (y - y0) > (y1 - y0) * (x - x0):
                break
            hull.pop()
        hull.append((x, y))
    for (x0, y0), (x1, y1) in pairwise(hull):
        if x1 >= middle_us:
            return (y1 - y0) / (x1 - x0)
    return 0.0
