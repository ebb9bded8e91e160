"""The emulated base's motors: how wheels follow what was asked of them."""

import math
from typing import Final

from sdt_tools.frames import Twist

REST: Final = Twist(0.0, 0.0)
HARD_STOP_MPS2: Final = 4.0
"""An emergency stop brakes as tyres allow, below the 6 m/s² at which they slip on a floor."""
HARD_STOP_RADPS2: Final = 20.0


class Motors:
    """Speeds that change no faster than the accelerations.

    Firmware keeps one for speeding up and one for slowing down; from the factory 0.3 m/s² and 100°/s².
    """

    def __init__(self) -> None:
        self.velocity = REST
        self.goal = REST
        self.on = False
        self.max_mps = 0.75
        self.max_radps = math.radians(100)
        self.accelerate_mps2 = self.brake_mps2 = 0.3
        self.turn_up_radps2 = self.turn_down_radps2 = math.radians(100)
        self._hard = False

    def stop_hard(self) -> None:
        """Brake as hard as can be, until the base stands."""
        self.goal, self._hard = REST, True

    def step(self, goal: Twist, dt_s: float) -> Twist:
        """The velocity after ``dt_s`` of going towards ``goal``; motors that are off hold the base as its brakes do."""
        hard = self._hard or not self.on
        aim = REST if hard else self._within(goal)
        up_mps2, down_mps2 = (HARD_STOP_MPS2,) * 2 if hard else (self.accelerate_mps2, self.brake_mps2)
        up_radps2, down_radps2 = (HARD_STOP_RADPS2,) * 2 if hard else (self.turn_up_radps2, self.turn_down_radps2)
        self.velocity = Twist(
            _towards(self.velocity.linear_mps, aim.linear_mps, up_mps2 * dt_s, down_mps2 * dt_s),
            _towards(self.velocity.angular_radps, aim.angular_radps, up_radps2 * dt_s, down_radps2 * dt_s),
        )
        self._hard = self._hard and self.velocity != REST
        return self.velocity

    def _within(self, goal: Twist) -> Twist:
        return Twist(
            max(-self.max_mps, min(self.max_mps, goal.linear_mps)),
            max(-self.max_radps, min(self.max_radps, goal.angular_radps)),
        )


def _towards(now: float, goal: float, up: float, down: float) -> float:
    gains = abs(goal) > abs(now) and goal * now >= 0.0
    most = up if gains else down
    return now + max(-most, min(most, goal - now))
