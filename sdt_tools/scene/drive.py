"""The base: how wheels follow a commanded twist."""

import math

import numpy as np

from sdt_tools.frames import Twist
from sdt_tools.scene.config import DriveConfig

_BLOCK = 512
"""Steps for which slip is drawn at once."""


class Drive:
    """A differential drive with limits of acceleration, a constant error of speed and slip that comes and goes."""

    def __init__(self, config: DriveConfig, rng: np.random.Generator) -> None:
        self.velocity = Twist(0.0, 0.0)
        self._config = config
        self._rng = rng
        linear, angular = (1.0 + config.calibration_sd * rng.standard_normal(2)).tolist()
        self._linear_scale, self._angular_scale = linear, angular
        self._slip = [0.0, 0.0]
        self._draws: list[list[float]] = []

    def next_velocity(self, velocity: Twist, commanded: Twist, dt_s: float) -> Twist:
        """The velocity after ``dt_s`` of a base that moves with ``velocity`` and is told ``commanded``."""
        config = self._config
        self._slide(dt_s)
        goal_mps = _clip(commanded.linear_mps, config.max_linear_mps) * (self._linear_scale + self._slip[0])
        goal_radps = _clip(commanded.angular_radps, config.max_turn_radps) * (self._angular_scale + self._slip[1])
        now_mps = velocity.linear_mps
        gains_speed = abs(goal_mps) > abs(now_mps) and goal_mps * now_mps >= 0.0
        limit_mps2 = config.accelerate_mps2 if gains_speed else config.brake_mps2
        self.velocity = Twist(
            now_mps + _clip(goal_mps - now_mps, limit_mps2 * dt_s),
            velocity.angular_radps + _clip(goal_radps - velocity.angular_radps, config.turn_radps2 * dt_s),
        )
        return self.velocity

    def _slide(self, dt_s: float) -> None:
        """Let the slip wander: an Ornstein-Uhlenbeck process with standard deviation slip_sd."""
        if not self._draws:
            self._draws = self._rng.standard_normal((_BLOCK, 2)).tolist()
        keep = math.exp(-dt_s / self._config.slip_s)
        push = self._config.slip_sd * math.sqrt(1.0 - keep * keep)
        draw = self._draws.pop()
        self._slip = [keep * self._slip[0] + push * draw[0], keep * self._slip[1] + push * draw[1]]


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
