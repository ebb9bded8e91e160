"""What an evaluation of vision networks leaves: a row a run, a row a decision, and their tallies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from sdt_tools.evaluation.vision.run import VisionRun
from sdt_tools.evaluation.vision.spread import Evenness, count_interval, evenness_of
from sdt_tools.evaluation.vision.whole_run import WholeOutcome
from sdt_tools.frames import Gesture
from sdt_tools.statistics import wilson

RUNS_FILE = "runs.parquet"
DECISIONS_FILE = "decisions.parquet"


@dataclass(frozen=True)
class VisionTally:
    """One network in one scenario, or in all.

    ``mode_errors`` of all runs; ``per_run`` their mean, with its 95 % ``interval``; ``runs_with_errors`` of the
    ``runs``. Of the ``commands``, ``missed`` and ``moot`` ones; ``reaction_s`` is the median of those heard. ``ok``
    runs did all that was commanded and nothing else, ``ok_wilson`` is their share's interval.
    """

    mode_errors: int
    missed: int
    runs: int
    per_run: float
    interval: tuple[float, float]
    runs_with_errors: int
    commands: int
    moot: int
    reaction_s: float | None
    misread: int
    decisions: int
    unreadable: int
    ok: int
    ok_wilson: tuple[float, float]
    outcomes: dict[str, int]


def write_runs(folder: Path, runs: Sequence[VisionRun], recordings: Sequence[str | None]) -> None:
    """Write the runs, and their decisions, as two Parquet tables."""
    rows = [
        {
            "scenario": run.scenario,
            "seed": run.seed,
            "outcome": run.verdict.outcome.value,
            "reason": run.verdict.reason,
            "simulated_s": run.simulated_s,
            "mode_errors": len(run.tally.errors),
            "against_command": sum(error.against for error in run.tally.errors),
            "commands": run.tally.commands,
            "moot": run.tally.moot,
            "missed": len(run.tally.missed),
            "reactions_s": list(run.tally.reactions_s),
            "decisions": run.tally.decisions,
            "exposed": run.tally.exposed,
            "misread": run.tally.misread,
            "unreadable": run.tally.unreadable,
            "recording": recording,
        }
        for run, recording in zip(runs, recordings, strict=True)
    ]
    types: Mapping[str, pl.DataType | type[pl.DataType]] = {"reactions_s": pl.List(pl.Float64), "recording": pl.String}
    pl.DataFrame(rows, schema_overrides=types).write_parquet(folder / RUNS_FILE)
    decisions = [{"scenario": run.scenario, "seed": run.seed, **vars(row)} for run in runs for row in run.decisions]
    pl.DataFrame(decisions).write_parquet(folder / DECISIONS_FILE)


def tallies(runs: pl.DataFrame) -> dict[str, dict[str, VisionTally]]:
    """Counted by model and scenario, in the order of the rows."""
    result: dict[str, dict[str, VisionTally]] = {}
    for (model, scenario), group in runs.group_by("model", "scenario", maintain_order=True):
        result.setdefault(str(model), {})[str(scenario)] = _counted(group, group["mode_errors"].to_list())
    return result


def totals(runs: pl.DataFrame) -> dict[str, VisionTally]:
    """Counted by model; the interval is over seeds, each with its runs in all scenarios."""
    result = {}
    for (model,), group in runs.group_by("model", maintain_order=True):
        by_seed = group.group_by("seed", maintain_order=True).agg(pl.col("mode_errors").sum())
        result[str(model)] = _counted(group, by_seed["mode_errors"].to_list())
    return result


def spreads(runs: pl.DataFrame) -> dict[str, Evenness]:
    """By model, whether its errors spread evenly over the scenarios that were driven."""
    result = {}
    for (model,), group in runs.group_by("model", maintain_order=True):
        scenarios = group["scenario"].unique(maintain_order=True).to_list()
        wide = {
            column: group.pivot(on="scenario", index="seed", values=column).select(scenarios).to_numpy()
            for column in ("mode_errors", "exposed")
        }
        result[str(model)] = evenness_of(wide["mode_errors"].astype(np.int64), wide["exposed"].astype(np.float64))
    return result


def errors_while(decisions: pl.DataFrame, models: Sequence[str]) -> dict[str, dict[str, int]]:
    """By model, mode errors by what the operator was doing, the most frequent first.

    That is a behaviour, a gesture that he showed (misread as the other one), or ``nothing else``.
    """
    gesture = pl.when(pl.col("shown") != Gesture.IDLE.label).then(pl.col("shown"))
    doing = pl.coalesce(gesture, pl.when(pl.col("behaviour") != "").then(pl.col("behaviour")), pl.lit("nothing else"))
    wrong = decisions.filter(pl.col("error")).with_columns(doing.alias("doing"))
    counted = wrong.group_by("model", "doing").len().sort("len", "doing", descending=[True, False])
    return {
        model: dict(counted.filter(pl.col("model") == model).select("doing", "len").iter_rows()) for model in models
    }


def _counted(runs: pl.DataFrame, counts: Sequence[int]) -> VisionTally:
    """``counts`` are the errors of what the interval resamples."""
    outcomes = {outcome.value: int((runs["outcome"] == outcome.value).sum()) for outcome in WholeOutcome}
    reaction_s = runs["reactions_s"].explode().median()
    ok, errors = outcomes[WholeOutcome.OK.value], int(runs["mode_errors"].sum())
    low, high = count_interval(counts)
    share = len(counts) / len(runs)
    return VisionTally(
        mode_errors=errors,
        missed=int(runs["missed"].sum()),
        runs=len(runs),
        per_run=errors / len(runs),
        interval=(low * share, high * share),
        runs_with_errors=int((runs["mode_errors"] > 0).sum()),
        commands=int(runs["commands"].sum()),
        moot=int(runs["moot"].sum()),
        reaction_s=float(reaction_s) if isinstance(reaction_s, int | float) else None,
        misread=int(runs["misread"].sum()),
        decisions=int(runs["decisions"].sum()),
        unreadable=int(runs["unreadable"].sum()),
        ok=ok,
        ok_wilson=wilson(ok, len(runs)),
        outcomes=outcomes,
    )
