from pathlib import Path

import numpy as np
import polars as pl
import pytest
from prediction_samples import OPTIONS, frames_table, side_by_side

from sdt_tools.error_analysis.claims.adversarial import NOT_GIVEN, judge_adversarial, permutation_p
from sdt_tools.error_analysis.claims.figures import draw_claims
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, Finding
from sdt_tools.error_analysis.side_by_side import KEYS

TABLE = frames_table(recordings=36, frames=60)
RNG = np.random.default_rng(2)
EVEN = RNG.random(len(TABLE)) < 0.2


def judged(wrong: np.ndarray, tags: np.ndarray | None = None) -> dict[str, ClaimVerdict]:
    given = {} if tags is None else {"vision": TABLE.select(KEYS).with_columns(tag=pl.Series(tags))}
    verdicts = judge_adversarial(side_by_side(TABLE, {"vision": wrong}), ["vision"], given, OPTIONS)
    return {verdict.claim: verdict for verdict in verdicts}


def test_without_such_a_network_both_are_undecided_and_say_why() -> None:
    verdicts = judge_adversarial(side_by_side(TABLE, {"a": EVEN}), [], {}, OPTIONS)
    assert [(verdict.finding, verdict.reason) for verdict in verdicts] == [(Finding.UNDECIDED, NOT_GIVEN)] * 2


def test_errors_drawn_alike_in_all_scenarios_are_even() -> None:
    verdict = judged(EVEN)["uniform"]
    assert verdict.finding is Finding.SUPPORTED
    rates = [EVEN[(TABLE["scenario"] == name).to_numpy()].mean() / EVEN.mean() for name in verdict.numbers["ratios"]]
    assert [one["value"] for one in verdict.numbers["ratios"].values()] == pytest.approx(rates)


def test_errors_of_one_scenario_are_not_even() -> None:
    verdict = judged(EVEN & (TABLE["scenario"] == "plain").to_numpy())["uniform"]
    assert verdict.finding is Finding.CONTRADICTED
    assert verdict.numbers["p_value"] <= 0.01
    assert verdict.estimate.value == pytest.approx(3.0, abs=0.01) or verdict.estimate.value == 0.0


def test_few_errors_show_nothing() -> None:
    verdict = judged(EVEN & (np.arange(len(TABLE)) % 40 == 0))["uniform"]
    assert verdict.finding is Finding.UNDECIDED


def test_bad_recordings_do_not_pass_for_scenarios() -> None:
    """Every tenth recording is all wrong, whatever its scenario: frames alone would tell scenarios apart."""
    rng = np.random.default_rng(3)
    scenario = np.arange(30) % 3
    small = 0
    for trial in range(100):
        bad = rng.random(30) < 0.1
        sums = np.array([np.where(bad, 50.0, 2.0), np.full(30, 50.0)])
        small += permutation_p(sums, scenario, 199, trial) <= 0.05
    assert small <= 12


@pytest.mark.parametrize(("share", "finding"), [(0.9, Finding.SUPPORTED), (0.2, Finding.CONTRADICTED)])
def test_transient_errors_are_counted_by_their_tags(share: float, finding: Finding) -> None:
    lone = RNG.random(len(TABLE)) < share
    tags = np.where(~EVEN, "correct", np.where(lone, "transient", "unexplained"))
    verdict = judged(EVEN, tags)["transient"]
    assert verdict.finding is finding
    assert verdict.estimate.value == pytest.approx(lone[EVEN].mean())
    assert verdict.numbers["shares"]["unexplained"]["value"] == pytest.approx(1.0 - lone[EVEN].mean())


def test_untagged_errors_cannot_be_called_transient() -> None:
    verdict = judged(EVEN)["transient"]
    assert verdict.finding is Finding.UNDECIDED
    assert "--tags" in verdict.reason


def test_both_are_drawn_in_one_picture(tmp_path: Path) -> None:
    tags = np.where(EVEN, "transient", "correct")
    assert draw_claims(list(judged(EVEN, tags).values()), None, tmp_path) == ("uniform.png",)
    assert (tmp_path / "uniform.png").stat().st_size > 10_000
