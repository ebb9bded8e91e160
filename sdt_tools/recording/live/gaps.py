"""Messages that should have come and did not."""

from typing import Final

_LATE: Final = 1.5
"""A message this many periods after the one before leaves room for another one between them."""


class GapCounter:
    """Counts what is missing in a stream of one message every ``period_ns``, by the sensor's stamps."""

    def __init__(self, period_ns: float) -> None:
        self.missing = 0
        self._period_ns = period_ns
        self._last_ns: int | None = None

    def see(self, stamp_ns: int) -> int:
        """Take note of a message; the number of messages missing just before it."""
        last_ns, self._last_ns = self._last_ns, stamp_ns
        if last_ns is None or stamp_ns - last_ns <= _LATE * self._period_ns:
            return 0
        missing = round((stamp_ns - last_ns) / self._period_ns) - 1
        self.missing += missing
        return missing

    def pass_over(self, stamp_ns: int) -> None:
        """Take note of a message that is not recorded: what is missing before it is nobody's loss."""
        self._last_ns = stamp_ns
