"""Failures nested across levels: what a network of one level fails, those of stricter levels fail too.

Asked of frames (a failure is a wrong answer) and, with evaluation runs, of scenarios (a run that did not end well).

The rule, fixed before data were looked at. The number that decides is the share of a level's failures that the stricter
level fails too, over all pairs of networks of the two; units of resampling are recordings, or worlds (scenario and
seed). Nested allows for a share ``nested_tolerance`` of failures that are missing there. Supported where the interval
lies above 1 - tolerance and the share exceeds what chance gives by its interval; contradicted where the interval lies
below 1 - tolerance, or the share is below chance. Chance: failures of the two levels are independent within each
scenario. Undecided with fewer than ``min_recordings`` units, and without failures.
"""

from itertools import combinations
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Float64, Int64

from sdt_tools.error_analysis.claims.material import Material
from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, Finding, at_least, undecided
from sdt_tools.error_analysis.resampling import draw_units, estimate, ratio, sum_by_unit
from sdt_tools.errors import UsageError
from sdt_tools.evaluation.outcome import Outcome

FRAMES: Final = "nested_frames"
SCENARIOS: Final = "nested_scenarios"
STATEMENTS: Final = {
    FRAMES: "Frames that a certified network gets wrong, networks of stricter levels get wrong too.",
    SCENARIOS: "Scenario runs that a certified network fails, networks of stricter levels fail too.",
}
PICTURE: Final = "nested.png"

Shares = dict[int, Float64[np.ndarray, "networks items"]]
"""For each level, what each of its networks fails (1) and does not (0)."""


def judge_nested_frames(material: Material, options: ClaimOptions) -> list[ClaimVerdict]:
    """A verdict for each two certified levels."""
    levels = material.certified_levels
    if len(levels) < 2:
        return [undecided(FRAMES, "", STATEMENTS[FRAMES], "needs networks of two certified levels")]
    scenario = material.frames.table["scenario"].fill_null("").to_numpy()
    failed = {level: material.frames.wrong[material.places(level)].astype(np.float64) for level in levels}
    return [
        _judge(FRAMES, pair, failed, material.frames.recording, scenario, material.draws, options)
        for pair in combinations(levels, 2)
    ]


def judge_nested_scenarios(material: Material, runs: pl.DataFrame | None, options: ClaimOptions) -> list[ClaimVerdict]:
    """A verdict for each two certified levels of networks that ``runs`` holds runs of; see ``runs_of``."""
    statement = STATEMENTS[SCENARIOS]
    if runs is None:
        return [undecided(SCENARIOS, "", statement, "needs closed-loop runs; add --evaluation")]
    by_level = {
        level: [material.networks[place].name for place in material.places(level)]
        for level in material.certified_levels
    }
    driven = set(runs["model"])
    by_level = {level: [name for name in names if name in driven] for level, names in by_level.items()}
    names = [name for names in by_level.values() for name in names]
    levels = [level for level, drivers in by_level.items() if drivers]
    if len(levels) < 2:
        return [undecided(SCENARIOS, "", statement, "the runs are not of networks of two certified levels")]
    failed = runs.filter(pl.col("model").is_in(names)).pivot("model", index=["scenario", "seed"], values="failed")
    failed = failed.drop_nulls().sort("scenario", "seed")
    unit = np.arange(len(failed))
    values = {level: failed.select(by_level[level]).to_numpy().T.astype(np.float64) for level in levels}
    draws = draw_units(max(len(failed), 1), options.resamples, options.seed)
    scenario = failed["scenario"].to_numpy()
    return [_judge(SCENARIOS, pair, values, unit, scenario, draws, options) for pair in combinations(levels, 2)]


def runs_of(table: pl.DataFrame, where: str) -> pl.DataFrame:
    """Evaluation runs as (model, scenario, seed, failed); a model is called as its checkpoint's folder.

    Raises UsageError for a table that is not of runs, or holds one twice.
    """
    lacking = {"policy", "scenario", "seed", "outcome"} - set(table.columns)
    if lacking:
        raise UsageError(
            f"{where}: no evaluation runs: it lacks {', '.join(sorted(lacking))}; make it with `sdt evaluate`"
        )
    runs = table.select(
        pl.col("policy").str.strip_prefix("policy:").alias("model"),
        "scenario",
        "seed",
        (pl.col("outcome") != Outcome.OK.value).cast(pl.Float64).alias("failed"),
    )
    if runs.select("model", "scenario", "seed").is_duplicated().any():
        raise UsageError(f"{where}: holds the run of one model, scenario and seed twice; give each evaluation once")
    return runs


def _judge(
    claim: str,
    pair: tuple[int, int],
    failed: Shares,
    unit: Int64[np.ndarray, "items"],
    scenario: np.ndarray,
    draws: Int64[np.ndarray, "units draws"],
    options: ClaimOptions,
) -> ClaimVerdict:
    first, second = (failed[level].mean(axis=0) for level in pair)
    units, about = len(draws), f"level {pair[0]} in level {pair[1]}"
    sums = sum_by_unit(np.array([first * second, first]), unit, units)
    share = estimate(sums, ratio, draws)
    failures = int(failed[pair[0]].sum())
    items, kind = int(np.sum(first > 0)), "frames" if claim == FRAMES else "worlds"
    if units < options.min_recordings or failures == 0:
        reason = f"{failures} failures in {units} {'recordings' if claim == FRAMES else 'worlds'}"
        return undecided(claim, about, STATEMENTS[claim], reason, frames=items, recordings=units)
    strata = [scenario == name for name in np.unique(scenario)]
    parts = np.array([[first * second * here, first * here, second * here, here * 1.0] for here in strata])
    beyond = estimate(sum_by_unit(parts, unit, units), _beyond_chance, draws)
    chance = share.value - beyond.value
    needed = 1.0 - options.nested_tolerance
    finding = at_least(share, needed)
    more, less = at_least(beyond, 0.0), beyond.high < 0.0
    if finding is Finding.SUPPORTED and more is not Finding.SUPPORTED:
        finding = Finding.UNDECIDED
    if less:
        finding = Finding.CONTRADICTED
    words = "more" if more is Finding.SUPPORTED else "less" if less else "no more"
    again = _recurs(failed[pair[0]])
    same = "" if again is None else f", in the same level trained again {again:.0%}"
    return ClaimVerdict(
        claim=claim,
        about=about,
        statement=STATEMENTS[claim],
        finding=finding,
        reason=f"{share.value:.0%} recur, {words} than by chance ({chance:.0%}){same}; nested takes {needed:.0%}",
        measure="share of failures that recur at the stricter level",
        estimate=share,
        frames=items,
        recordings=units,
        picture=PICTURE,
        numbers={
            "failures": failures,
            "units": kind,
            "networks": [len(failed[level]) for level in pair],
            "chance": chance,
            "beyond_chance": beyond.document(),
            "failure_rates": [float(first.mean()), float(second.mean())],
            "recurs_when_trained_again": again,
        },
    )


def _beyond_chance(totals: np.ndarray) -> np.ndarray:
    """Share of failures that recur, less what it would be if failures were independent within each scenario."""
    both, first, second, items = np.moveaxis(totals, 1, 0)
    expected = np.where(items > 0, first * second / np.maximum(items, 1e-12), 0.0)
    result: np.ndarray = (both.sum(axis=0) - expected.sum(axis=0)) / first.sum(axis=0)
    return result


def _recurs(failed: Float64[np.ndarray, "networks items"]) -> float | None:
    """The share of failures that recur in another network of the same level: what nesting can be expected to reach."""
    networks = len(failed)
    if networks < 2:
        return None
    count = failed.sum(axis=0)
    return float((count * (count - 1)).sum() / ((networks - 1) * count.sum()))
