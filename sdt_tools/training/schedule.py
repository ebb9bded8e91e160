"""How the learning rate runs over a training."""

import math
from typing import Final

from pydantic import Field, model_validator

from sdt_tools.config import Config


class LearningRateConfig(Config):
    """A linear warm-up to ``peak``, a plateau, and a half cosine down to 0; the shares are of the planned steps.

    Epochs beyond the planned ones go on with ``extra_share`` of the peak.
    """

    peak: float = Field(default=2e-3, gt=0.0)
    warm_up_share: float = Field(default=0.05, ge=0.0, le=1.0)
    decay_share: float = Field(default=0.4, ge=0.0, le=1.0)
    extra_share: float = Field(default=0.1, ge=0.0, le=1.0)

    @model_validator(mode="after")
    def _fits(self) -> "LearningRateConfig":
        if self.warm_up_share + self.decay_share > 1.0:
            raise ValueError("warm_up_share and decay_share together exceed 1")
        return self


_FIRST: Final = 1e-3
"""Share of the peak that a warm-up starts from, so that no step is lost on a rate of 0."""


def learning_rate(config: LearningRateConfig, progress: float) -> float:
    """The rate when the share ``progress`` of the planned steps is done."""
    if progress >= 1.0:
        return config.peak * config.extra_share
    if progress < config.warm_up_share:
        return config.peak * max(progress / config.warm_up_share, _FIRST)
    until_end = 1.0 - progress
    if until_end < config.decay_share:
        return config.peak * 0.5 * (1.0 - math.cos(math.pi * until_end / config.decay_share))
    return config.peak
