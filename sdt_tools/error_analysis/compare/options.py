"""Every choice behind a comparison; saved with every result."""

from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.error_analysis.definitions import ConditionOptions


class CompareOptions(Config):
    """How models are compared.

    ``lift``: conditions are sought inside which frames change (from right to wrong, or back) more than ``lift`` times
    as often as over all frames; where that is more than half of the frames, half is enough. ``conditions``: how they
    are searched and confirmed.
    """

    resamples: int = Field(default=2000, ge=100)
    lift: float = Field(default=2.0, gt=1.0)
    seed: int = 0
    conditions: ConditionOptions = ConditionOptions()
