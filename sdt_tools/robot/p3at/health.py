"""What there is to say of the base's health: each trouble when it begins and when it ends."""

from collections.abc import Iterator
from typing import Final

from sdt_tools.frames import LogLevel
from sdt_tools.robot.p3at.status import Status

_RECOVERED_V: Final = 0.3
"""A battery that was low is well again so far above the limit: under load its voltage sways."""

Remark = tuple[LogLevel, str]


class Health:
    """Compares each status with the one before."""

    def __init__(self, low_battery_v: float) -> None:
        self._low_battery_v = low_battery_v
        self._battery_low = False
        self._last: Status | None = None

    def remarks(self, status: Status) -> Iterator[Remark]:
        """What has changed with ``status``."""
        last, self._last = self._last, status
        yield from _turned(_stalled(last), _stalled(status), "stalled: {}", "stalled no more")
        front = (_segments(last.front_bumpers) if last else "", _segments(status.front_bumpers))
        yield from _turned(*front, "front bumper touched, segment {}", "front bumper free")
        rear = (_segments(last.rear_bumpers) if last else "", _segments(status.rear_bumpers))
        yield from _turned(*rear, "rear bumper touched, segment {}", "rear bumper free")
        yield from self._battery(status.battery_v)

    def _battery(self, battery_v: float) -> Iterator[Remark]:
        if not self._battery_low and battery_v < self._low_battery_v:
            self._battery_low = True
            yield LogLevel.WARNING, f"battery low: {battery_v:.1f} V; charge it"
        elif self._battery_low and battery_v > self._low_battery_v + _RECOVERED_V:
            self._battery_low = False
            yield LogLevel.INFO, f"battery well: {battery_v:.1f} V"


def _turned(before: str, now: str, begun: str, ended: str) -> Iterator[Remark]:
    if now and now != before:
        yield LogLevel.WARNING, begun.format(now)
    elif before and not now:
        yield LogLevel.INFO, ended


def _stalled(status: Status | None) -> str:
    if status is None:
        return ""
    wheels = [name for name, is_so in (("left", status.left_stalled), ("right", status.right_stalled)) if is_so]
    return " and ".join(wheels) + (" wheels" if len(wheels) > 1 else " wheel") if wheels else ""


def _segments(bits: int) -> str:
    return ", ".join(str(place + 1) for place in range(bits.bit_length()) if bits >> place & 1)
