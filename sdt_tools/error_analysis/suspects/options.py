"""How suspects are looked for."""

from typing import Literal

from pydantic import Field

from sdt_tools.config import Config


class SuspectOptions(Config):
    """Every choice behind a suspect; saved with every result.

    ``folds``: parts that the recordings are split into, each answered by a network trained on the others for
    ``epochs``. ``method``: how cleanlab decides (its ``filter_by``; Northcutt et al. 2021, "Confident Learning").
    ``spacing_s``: where frames are taken from recordings, the least time between two of one. ``seed``: of folds and
    training.
    """

    folds: int = Field(default=5, ge=2, le=20)
    epochs: int = Field(default=30, ge=1)
    method: Literal["prune_by_noise_rate", "prune_by_class", "both", "confident_learning"] = "prune_by_noise_rate"
    spacing_s: float = Field(default=0.1, ge=0.0)
    seed: int = Field(default=0, ge=0)
