"""Every choice behind a verdict; saved with every result."""

from typing import Final, Literal

from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.error_analysis.definitions import ErrorOptions

LossName = Literal["cross_entropy", "zero_one"]
LOSS_NAMES: Final[tuple[LossName, ...]] = ("cross_entropy", "zero_one")


class ClaimOptions(Config):
    """How claims are judged.

    ``loss`` decides Theorem 1 and Implication 1; the paper trains and proves with the cross-entropy. The other loss is
    reported beside it. ``min_frames_inside`` and ``min_recordings_inside``: with fewer inside the domains Theorem 1 is
    undecided; ``min_recordings`` is the same for all other claims. ``bins``: of distances, equal in frames.
    ``nested_tolerance``: share of failures that may be missing from the next level's. ``most``: what share of errors
    "the errors are …" takes. ``uniform_factor``: how far a scenario's error rate may be from that of all, as a factor.
    ``stable_share``: how much of the change between levels retraining alone may make. ``locality_frames``: frames
    between which distances are taken; ``local_correlation``: a correlation of losses that small counts as none.
    ``errors_looked_at``: how many errors Proposition 2 is checked on. ``ball_m``: radius of the balls of Proposition 1.
    ``errors`` are the options of tags, neighbours and conditions.
    """

    loss: LossName = "cross_entropy"
    min_frames_inside: int = Field(default=200, ge=1)
    min_recordings_inside: int = Field(default=8, ge=2)
    min_recordings: int = Field(default=8, ge=2)
    resamples: int = Field(default=2000, ge=100)
    bins: int = Field(default=12, ge=3, le=100)
    nested_tolerance: float = Field(default=0.05, ge=0.0, lt=1.0)
    most: float = Field(default=0.5, gt=0.0, lt=1.0)
    uniform_factor: float = Field(default=2.0, gt=1.0)
    permutations: int = Field(default=1999, ge=99)
    alpha: float = Field(default=0.05, gt=0.0, lt=1.0)
    stable_share: float = Field(default=0.5, gt=0.0)
    locality_frames: int = Field(default=3000, ge=100)
    local_correlation: float = Field(default=0.05, gt=0.0)
    errors_looked_at: int = Field(default=500, ge=1)
    ball_m: float = Field(default=0.05, gt=0.0)
    seed: int = 0
    errors: ErrorOptions = ErrorOptions()
