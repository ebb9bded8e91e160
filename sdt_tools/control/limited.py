"""Speed limits for a base that has none of its own."""

from sdt_tools.frames import Twist
from sdt_tools.protocols import Actuator
from sdt_tools.robot.limits import SpeedLimits


class LimitedActuator:
    """Passes twists on to ``below``, cut off at ``limits``. Implements Actuator."""

    def __init__(self, below: Actuator, limits: SpeedLimits) -> None:
        self._below = below
        self._limits = limits

    def command(self, twist: Twist) -> None:
        """Drive with ``twist``, within the limits."""
        self._below.command(self._limits.within(twist))
