"""Theorem 1 and Implication 1 on errors planted by distance to the domains."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from prediction_samples import OPTIONS, frames_table, material, write_predictions

from sdt_tools.error_analysis.claims.implication import judge_implication
from sdt_tools.error_analysis.claims.theorem import judge_theorem
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, Finding

TABLE = frames_table(recordings=30, frames=100)
DISTANCE_M = TABLE["distance_level_1_m"].to_numpy().astype(float)
INSIDE = DISTANCE_M == 0.0


def drawn(rate: np.ndarray, seed: int) -> np.ndarray:
    return np.random.default_rng(100 + seed).random(len(rate)) < rate


def theorem(tmp_path: Path, rate: np.ndarray, table: pl.DataFrame = TABLE) -> ClaimVerdict:
    errors = [drawn(rate, seed) for seed in range(2)]
    paths = [
        write_predictions(tmp_path / f"{seed}.parquet", table, f"level1-{seed}", wrong)
        for seed, wrong in enumerate(errors)
    ]
    standard = [drawn(np.full(len(rate), 0.1), seed) for seed in (5, 6)]
    given = material(table, {1: errors, 0: standard})
    (verdict,) = judge_theorem(given, paths, None, OPTIONS)
    return verdict


@pytest.mark.parametrize(
    ("inside", "outside", "finding"), [(0.05, 0.4, Finding.SUPPORTED), (0.6, 0.2, Finding.CONTRADICTED)]
)
def test_the_theorem_is_judged_by_the_means(tmp_path: Path, inside: float, outside: float, finding: Finding) -> None:
    verdict = theorem(tmp_path, np.where(INSIDE, inside, outside))
    assert verdict.finding is finding
    assert verdict.frames == INSIDE.sum()
    found = verdict.numbers["zero_one"]["difference"]["value"]
    assert found == pytest.approx(inside - outside, abs=0.05)
    assert verdict.numbers["zero_one"]["beyond_standard"]["value"] == pytest.approx(inside - outside, abs=0.08)


def test_equal_means_leave_it_undecided(tmp_path: Path) -> None:
    assert theorem(tmp_path, np.full(len(TABLE), 0.3)).finding is Finding.UNDECIDED


def test_few_frames_inside_leave_it_undecided_whatever_they_say(tmp_path: Path) -> None:
    few = TABLE.with_columns(in_level_1=pl.col("in_level_1") & (pl.int_range(pl.len()) < 600))
    verdict = theorem(tmp_path, np.where(INSIDE, 0.0, 0.9), few)
    assert verdict.finding is Finding.UNDECIDED
    assert verdict.reason == f"{verdict.frames} frames of 6 recordings lie inside; 200 of 8 are needed"


def test_premises_stand_beside_the_verdict(tmp_path: Path) -> None:
    conflicting = TABLE.with_columns(
        label=pl.when(pl.int_range(pl.len()) < 300).then(pl.lit("forward")).otherwise("label")
    )
    verdict = theorem(tmp_path, np.where(INSIDE, 0.05, 0.4), conflicting)
    held = {premise.name: premise.holds for premise in verdict.premises}
    assert held == {
        "δ ≤ training loss": True,
        "non-conflicting data": False,
        "the bound covers the labels inside": False,
        "training stability": True,
        "locality with some K": None,
    }
    assert f"{int(INSIDE[:300].sum())} of {int(INSIDE.sum())} frames inside conflict" in verdict.premises[1].text


def test_the_loss_of_the_allowed_set_is_that_of_its_mass(tmp_path: Path) -> None:
    """Right inside: ``backward``, logit 3 of it and 0 of six others, three of them allowed."""
    verdict = theorem(tmp_path, np.zeros(len(TABLE)))
    mass = (np.exp(3.0) + 3.0) / (np.exp(3.0) + 6.0)
    assert f"the allowed set is {-np.log(mass):.2g} nats at most" in verdict.premises[2].text


def implication(rate: np.ndarray) -> ClaimVerdict:
    """The networks of level 1 are wrong at ``rate``, those of level 0 at a tenth."""
    standard = [drawn(np.full(len(TABLE), 0.1), seed) for seed in (0, 1)]
    (verdict,) = judge_implication(material(TABLE, {0: standard, 1: [drawn(rate, 2), drawn(rate, 3)]}), None, OPTIONS)
    return verdict


def test_errors_added_near_the_domains_support_the_implication() -> None:
    verdict = implication(0.1 + 0.6 * np.exp(-2.0 * DISTANCE_M))
    assert verdict.finding is Finding.SUPPORTED
    numbers = verdict.numbers["zero_one"]
    middle_m = np.array(verdict.numbers["distance_mean_m"])
    values = np.array([point["value"] for point in numbers["curve"]])
    assert values == pytest.approx(0.6 * np.exp(-2.0 * middle_m), abs=0.1)
    fitted = np.array(numbers["decreasing_fit"])
    assert (np.diff(fitted) <= 0.0).all()
    assert fitted == pytest.approx(values, abs=0.02)


def test_errors_added_far_from_the_domains_contradict_it() -> None:
    assert implication(0.1 + 0.3 * DISTANCE_M).finding is Finding.CONTRADICTED


def test_errors_added_everywhere_leave_it_undecided() -> None:
    assert implication(np.full(len(TABLE), 0.4)).finding is Finding.UNDECIDED


def test_no_errors_added_leave_it_undecided_and_say_so() -> None:
    verdict = implication(np.full(len(TABLE), 0.0))
    assert verdict.finding is Finding.UNDECIDED
    assert verdict.reason == "at no distance are more errors made than without domains"


def test_without_standard_networks_nothing_can_be_said() -> None:
    (verdict,) = judge_implication(material(TABLE, {1: [INSIDE]}), None, OPTIONS)
    assert verdict.finding is Finding.UNDECIDED
    assert "level 0" in verdict.reason
