"""Every choice behind a comparison; saved with every result."""

from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.error_analysis.definitions import ConditionOptions


class CompareOptions(Config):
    """How models are compared.

    ``lift``: conditions are sought inside which answers change (from right to wrong, or back) more than ``lift`` times
    as often as over all frames, and at most half of the time must be asked of any. ``conditions``: how they are
    searched and confirmed.
    """

    resamples: int = Field(default=2000, ge=100)
    lift: float = Field(default=2.0, gt=1.0)
    seed: int = 0
    conditions: ConditionOptions = ConditionOptions()
