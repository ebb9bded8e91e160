import numpy as np
import polars as pl
import pytest
from prediction_samples import OPTIONS, frames_table, material

from sdt_tools.error_analysis.claims.nested import judge_nested_frames, judge_nested_scenarios, runs_of
from sdt_tools.error_analysis.claims.verdict import Finding
from sdt_tools.errors import UsageError

TABLE = frames_table(recordings=24, frames=50)
RNG = np.random.default_rng(0)
SOME = RNG.random(len(TABLE)) < 0.3


def test_failures_within_the_stricter_levels_failures_are_nested() -> None:
    more = SOME | (RNG.random(len(TABLE)) < 0.2)
    (verdict,) = judge_nested_frames(material(TABLE, {1: [SOME], 2: [more]}), OPTIONS)
    assert verdict.finding is Finding.SUPPORTED
    assert verdict.estimate.value == 1.0
    assert verdict.numbers["chance"] == pytest.approx(more.mean(), abs=0.03)


def test_independent_failures_are_what_chance_gives() -> None:
    other = RNG.random(len(TABLE)) < 0.4
    (verdict,) = judge_nested_frames(material(TABLE, {1: [SOME], 2: [other]}), OPTIONS)
    assert verdict.finding is Finding.CONTRADICTED
    beyond = verdict.numbers["beyond_chance"]
    assert beyond["low"] < 0.0 < beyond["high"]


def test_all_failing_is_nested_by_chance_alone_and_decides_nothing() -> None:
    everything = np.ones(len(TABLE), bool)
    (verdict,) = judge_nested_frames(material(TABLE, {1: [SOME], 2: [everything]}), OPTIONS)
    assert verdict.estimate.value == 1.0
    assert verdict.numbers["beyond_chance"]["value"] == pytest.approx(0.0)


def test_chance_knows_scenarios() -> None:
    """Both levels fail all of one scenario and nothing else: that failures recur says nothing."""
    here = (TABLE["scenario"] == "plain").to_numpy()
    (verdict,) = judge_nested_frames(material(TABLE, {1: [here], 2: [here]}), OPTIONS)
    assert verdict.numbers["chance"] == pytest.approx(1.0)


def test_pairs_of_networks_are_all_counted() -> None:
    """By brute force, and in the same level over pairs of different networks."""
    first = [RNG.random(len(TABLE)) < 0.3 for _ in range(3)]
    second = [RNG.random(len(TABLE)) < 0.5 for _ in range(2)]
    (verdict,) = judge_nested_frames(material(TABLE, {1: first, 3: second}), OPTIONS)
    both = sum(int((a & b).sum()) for a in first for b in second)
    assert verdict.estimate.value == pytest.approx(both / sum(2 * int(a.sum()) for a in first))
    again = sum(int((a & b).sum()) for a in first for b in first if a is not b)
    expected = again / sum(2 * int(a.sum()) for a in first)
    assert verdict.numbers["recurs_when_trained_again"] == pytest.approx(expected)


def runs(failing: dict[str, set[tuple[str, int]]]) -> pl.DataFrame:
    rows = [
        {
            "policy": f"policy:{name}",
            "scenario": scenario,
            "seed": seed,
            "outcome": "stuck" if (scenario, seed) in failed else "ok",
        }
        for name, failed in failing.items()
        for scenario in ("plain", "through_gate")
        for seed in range(20)
    ]
    return runs_of(pl.DataFrame(rows), "runs")


def test_runs_are_matched_by_world() -> None:
    few = {("through_gate", seed) for seed in range(5)}
    more = few | {("through_gate", 9), ("plain", 3)}
    given = material(TABLE, {1: [SOME], 2: [SOME]})
    (verdict,) = judge_nested_scenarios(given, runs({"level1-0": few, "level2-0": more}), OPTIONS)
    assert verdict.finding is Finding.SUPPORTED
    assert (verdict.frames, verdict.recordings) == (5, 40)
    assert verdict.numbers["chance"] == pytest.approx(6 / 20)


def test_runs_of_other_networks_say_nothing() -> None:
    given = material(TABLE, {1: [SOME], 2: [SOME]})
    (verdict,) = judge_nested_scenarios(given, runs({"level1-0": set(), "another": set()}), OPTIONS)
    assert verdict.finding is Finding.UNDECIDED
    assert verdict.reason == "the runs are not of networks of two certified levels"


def test_a_table_that_is_not_of_runs_is_refused() -> None:
    with pytest.raises(UsageError, match="it lacks outcome, policy, seed"):
        runs_of(pl.DataFrame({"scenario": ["plain"]}), "x.parquet")
