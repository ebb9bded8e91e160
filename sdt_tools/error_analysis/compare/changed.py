"""On what condition a model got better or worse than another."""

from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Bool

from sdt_tools.error_analysis.compare.options import CompareOptions
from sdt_tools.error_analysis.conditions.search import ConditionSearch, find_conditions
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.labelled import frames_of
from sdt_tools.error_analysis.side_by_side import SideBySide

_MOST: Final = 0.5


def conditions_of_change(
    frames: SideBySide, changed: Bool[np.ndarray, "frames"], what: str, options: CompareOptions
) -> ConditionSearch:
    """Conditions inside which frames are ``changed`` (named ``what``) more than ``lift`` times as often as over all.

    The change takes the place of the loss: Definition 3 with η = ``lift`` times its share, at most a half. Found on
    half of the recordings and confirmed on the others, as conditions of errors are. Raises UsageError for an unknown
    feature.
    """
    share = float(changed.mean())
    eta = min(_MOST, options.lift * share) if share > 0.0 else _MOST
    loss = changed.astype(np.float32)
    table = frames.table.with_columns(
        model=pl.lit(what), predicted=pl.lit(""), loss_01=pl.Series(loss), loss_ce=pl.Series(loss)
    )
    errors = ErrorOptions(conditions=options.conditions, seed=options.seed)
    # A change is 0 or 1, so what counts as changed does not move with η.
    labelled = frames_of(table, errors.model_copy(update={"eta": eta}), what)
    return find_conditions(labelled, errors.model_copy(update={"eta": eta}))
