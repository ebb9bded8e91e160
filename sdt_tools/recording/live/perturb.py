"""Motions forced on a driver now and then, so that a recording also holds what to do off the good path."""

from typing import Final

import numpy as np
from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.frames import MotionClass

PERTURBATION: Final = "perturbation"
"""The driver's name in commands that were forced."""


class PerturbConfig(Config):
    """How often a motion is forced, and for how long."""

    start_probability: float = Field(default=0.05, ge=0, le=1)
    """Of a forced motion to begin at a decision that is free."""
    shortest_s: float = Field(default=0.4, gt=0)
    longest_s: float = Field(default=1.2, gt=0)


class Perturbation:
    """Forces random motions; the same seed forces the same ones.

    Called once a decision with the driver's choice, it answers with what is to be driven. Staying is three times as
    likely as any other motion: a robot that is late is the most usual deviation.
    """

    def __init__(self, seed: int, config: PerturbConfig, decision_hz: float) -> None:
        self._rng = np.random.default_rng([seed, 0x9E27])
        self._config = config
        self._decision_hz = decision_hz
        self._left = 0
        self._forced = MotionClass.STAY

    def __call__(self, chosen: MotionClass) -> MotionClass:
        """The motion to drive instead of ``chosen``, or ``chosen`` itself."""
        if self._left == 0:
            if self._rng.random() >= self._config.start_probability:
                return chosen
            self._begin()
        self._left -= 1
        return self._forced

    def _begin(self) -> None:
        config = self._config
        weights = np.array([3.0 if motion is MotionClass.STAY else 1.0 for motion in MotionClass])
        self._forced = MotionClass(int(self._rng.choice(len(weights), p=weights / weights.sum())))
        lasting_s = self._rng.uniform(config.shortest_s, config.longest_s)
        self._left = max(1, round(lasting_s * self._decision_hz))


def perturbation_of(config: PerturbConfig | None, seed: int, decision_hz: float) -> Perturbation | None:
    """What forces motions, where that is wanted."""
    return None if config is None else Perturbation(seed, config, decision_hz)
