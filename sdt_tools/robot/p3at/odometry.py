"""From the base's wrapping counters to a pose that goes on whatever happens to them."""

import math
from typing import Final

from sdt_tools.frames import Pose2D
from sdt_tools.robot.p3at.config import P3atConfig
from sdt_tools.robot.p3at.status import Status

_WRAP: Final = 1 << 15
_JUMP_M: Final = 1.0
"""No base moves so far between two packets: its counters were set anew."""

_MM_A_STEP: Final = {"p3at": 0.465, "p2at": 1.32, "p2at8": 1.32, "p2at8+": 0.465}
"""Controllers before the SH counted in steps of their own (ARIA's parameter files); all others count millimetres."""


class Odometer:
    """Follows the base from where it is first seen, which is the origin.

    The base's counters begin anew when it is switched on or a session opened; ``reconnected`` says that they may have.
    """

    def __init__(self, config: P3atConfig, model: str) -> None:
        scale = config.position_scale or _MM_A_STEP.get(model, 1.0)
        self.pose = Pose2D(0.0, 0.0, 0.0)
        self._metres = scale / 1000.0
        self._radians = 2 * math.pi / config.turn_steps
        self._turn_steps = config.turn_steps
        self._last: Status | None = None
        self._turned_rad = 0.0
        """How the odometry frame is turned against the base's own."""

    def reconnected(self) -> None:
        """The next status is where the last one was, whatever its counters say."""
        self._last = None

    def follow(self, status: Status) -> bool:
        """Move on to ``status``; False where its counters have jumped, and the pose stays."""
        last, self._last = self._last, status
        heading_rad = status.heading * self._radians
        if last is None:
            self._turned_rad = self.pose.yaw_rad - heading_rad
            return True
        x_m, y_m = (_wrapped(step, _WRAP) * self._metres for step in (status.x - last.x, status.y - last.y))
        if math.hypot(x_m, y_m) > _JUMP_M:
            self._turned_rad = self.pose.yaw_rad - heading_rad
            return False
        turn_rad = _wrapped(status.heading - last.heading, self._turn_steps) * self._radians
        cos, sin = math.cos(self._turned_rad), math.sin(self._turned_rad)
        yaw_rad = math.remainder(self.pose.yaw_rad + turn_rad, 2 * math.pi)
        self.pose = Pose2D(self.pose.x_m + cos * x_m - sin * y_m, self.pose.y_m + sin * x_m + cos * y_m, yaw_rad)
        return True


def _wrapped(difference: int, period: int) -> int:
    """The difference of two counters that wrap after ``period``, at most half of it either way."""
    return (difference + period // 2) % period - period // 2
