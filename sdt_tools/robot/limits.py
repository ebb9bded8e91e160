"""How fast the robot may ever move, whoever drives it."""

import math

from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.frames import Twist


class SpeedLimits(Config):
    """The most that is ever commanded. The defaults are what the scene's base can do."""

    forward_mps: float = Field(default=0.7, ge=0)
    backward_mps: float = Field(default=0.5, ge=0)
    turn_radps: float = Field(default=1.6, ge=0)

    def within(self, twist: Twist) -> Twist:
        """``twist`` with its speeds cut off at the limits; what is no number becomes standstill."""
        if not (math.isfinite(twist.linear_mps) and math.isfinite(twist.angular_radps)):
            return Twist(0.0, 0.0)
        return Twist(
            max(-self.backward_mps, min(self.forward_mps, twist.linear_mps)),
            max(-self.turn_radps, min(self.turn_radps, twist.angular_radps)),
        )
