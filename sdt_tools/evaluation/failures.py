"""What failed runs have in common: which are failed by several models, and how things stood when they ended."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import polars as pl

from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.frames import FORWARD_CLASSES

RUN = ("model", "scenario", "seed")
_BEFORE_S = 1.0
_FORWARD = [motion.label for motion in FORWARD_CLASSES]


@dataclass(frozen=True)
class Nesting:
    """Of the runs that ``first`` fails, how many ``second`` fails too.

    ``expected`` is how many that would be if failures were independent within each scenario.
    """

    first: str
    second: str
    failed_by_first: int
    failed_by_both: int
    expected: float

    @property
    def nested(self) -> bool:
        """Whether all of them."""
        return self.failed_by_both == self.failed_by_first


def nesting(runs: pl.DataFrame, models: Sequence[str]) -> list[Nesting]:
    """Each model, and the next in the order given, over the scenarios and seeds that both have driven."""
    failed = {
        model: runs.filter(pl.col("model") == model).select(
            "scenario", "seed", (pl.col("outcome") != Outcome.OK.value).alias("failed")
        )
        for model in models
    }
    found = []
    for first, second in pairwise(models):
        both = failed[first].join(failed[second], on=["scenario", "seed"], suffix="_second")
        by_scenario = both.group_by("scenario").agg(
            (pl.col("failed").sum() * pl.col("failed_second").mean()).alias("expected")
        )
        found.append(
            Nesting(
                first,
                second,
                int(both["failed"].sum()),
                int((both["failed"] & both["failed_second"]).sum()),
                float(by_scenario["expected"].sum()),
            )
        )
    return found


def failure_table(runs: pl.DataFrame, traces: pl.DataFrame) -> pl.DataFrame:
    """One row a failed run: outcome, how far it had come, and how things stood in its last second.

    ``motion`` is the last decision; ``forward`` whether any of the last second's was a forward class. Ranges and
    distances to the domains are the least of that second; ``share_of_time`` is the run's length over that of the
    longest run of the same scenario and seed.
    """
    length = pl.col("time_s").max()
    ends = (
        traces.with_columns(length.over(*RUN).alias("end_s"))
        .filter(pl.col("time_s") >= pl.col("end_s") - _BEFORE_S)
        .sort("time_s")
        .group_by(*RUN, maintain_order=True)
        .agg(
            pl.col("end_s").first(),
            pl.col("motion").last(),
            pl.col("motion").is_in(_FORWARD).any().alias("forward"),
            pl.col("watched_range_m", "level3_rms_m", "level4_rms_m").min(),
            pl.col("operator_range_m", "operator_bearing_rad").last(),
            pl.col("robot_x_m", "robot_y_m").last(),
        )
    )
    longest = traces.group_by("scenario", "seed").agg(length.alias("longest_s"))
    return (
        runs.filter(pl.col("outcome") != Outcome.OK.value)
        .select(*RUN, "outcome", "reason", "recording")
        .join(ends, on=RUN, how="left")
        .join(longest, on=["scenario", "seed"], how="left")
        .with_columns((pl.col("end_s") / pl.col("longest_s")).alias("share_of_time"))
        .drop("longest_s")
        .sort(*RUN)
    )


@dataclass(frozen=True)
class WhereFailed:
    """A model's failures: how many drove forward in their last second, and medians of how near things were."""

    model: str
    failures: int
    forward: int
    median_watched_range_m: float | None
    median_level4_rms_m: float | None


def where_failed(failures: pl.DataFrame, models: Sequence[str]) -> list[WhereFailed]:
    """For each model, where along its runs failures happened."""
    summaries = []
    for model in models:
        mine = failures.filter(pl.col("model") == model)
        summaries.append(
            WhereFailed(
                model,
                len(mine),
                int(mine["forward"].sum()),
                _median(mine["watched_range_m"]),
                _median(mine["level4_rms_m"]),
            )
        )
    return summaries


def _median(values: pl.Series) -> float | None:
    median = values.median()
    return float(median) if isinstance(median, int | float) else None
