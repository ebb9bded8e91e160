import numpy as np
import polars as pl
import pytest
from prediction_samples import OPTIONS, frames_table, material

from sdt_tools.error_analysis.claims.profile import judge_conditional, judge_forward
from sdt_tools.error_analysis.claims.verdict import Finding
from sdt_tools.error_analysis.side_by_side import KEYS

TABLE = frames_table(recordings=24, frames=80)
FORWARD = TABLE["motion"].is_in(["forward", "left_forward", "right_forward"]).to_numpy()
NEAR = (TABLE["front_range_m"] < 0.7).to_numpy()
RNG = np.random.default_rng(1)
HALF = RNG.random(len(TABLE)) < 0.5
SELDOM = RNG.random(len(TABLE)) < 0.05


@pytest.mark.parametrize(
    ("errors", "finding"), [(FORWARD & HALF, Finding.SUPPORTED), (~FORWARD & HALF, Finding.CONTRADICTED)]
)
def test_errors_are_held_against_the_share_of_forward_frames(errors: np.ndarray, finding: Finding) -> None:
    (verdict,) = judge_forward(material(TABLE, {1: [errors]}), OPTIONS)
    assert verdict.finding is finding
    assert verdict.numbers["base"]["value"] == pytest.approx(FORWARD.mean())
    assert verdict.numbers["only_forward"] == (finding is Finding.SUPPORTED)


def test_errors_anywhere_decide_nothing_about_forward_motion() -> None:
    (verdict,) = judge_forward(material(TABLE, {1: [HALF], 0: [SELDOM]}), OPTIONS)
    assert verdict.finding is Finding.UNDECIDED
    rate = verdict.numbers["rates_by_motion"]["forward"]["value"]
    assert rate == pytest.approx(HALF[(TABLE["motion"] == "forward").to_numpy()].mean())


def test_errors_of_a_condition_are_conditional() -> None:
    errors = (NEAR & (RNG.random(len(TABLE)) < 0.8)) | (SELDOM & (RNG.random(len(TABLE)) < 0.3))
    (verdict,) = judge_conditional(material(TABLE, {1: [errors]}), {}, OPTIONS)
    assert verdict.finding is Finding.SUPPORTED
    assert verdict.numbers["conditions"][0].startswith("front_range_m < 0.")
    assert verdict.estimate.value == pytest.approx((errors & NEAR).sum() / errors.sum(), abs=0.03)


def test_errors_at_random_are_not() -> None:
    (verdict,) = judge_conditional(material(TABLE, {1: [SELDOM]}), {}, OPTIONS)
    assert verdict.finding is Finding.CONTRADICTED
    assert verdict.estimate.value == 0.0


def test_tags_go_before_conditions() -> None:
    tag = np.where(SELDOM & FORWARD, "conditional", np.where(SELDOM, "transient", "correct"))
    tags = {"level1-0": TABLE.select(KEYS).with_columns(tag=pl.Series(tag))}
    (verdict,) = judge_conditional(material(TABLE, {1: [SELDOM]}), tags, OPTIONS)
    assert verdict.estimate.value == pytest.approx(FORWARD[SELDOM].mean())


def test_few_recordings_confirm_no_condition() -> None:
    table = TABLE[:240]
    (verdict,) = judge_conditional(material(table, {1: [NEAR[:240]]}), {}, OPTIONS)
    assert verdict.finding is Finding.UNDECIDED
    assert "recordings: 3" in verdict.reason
