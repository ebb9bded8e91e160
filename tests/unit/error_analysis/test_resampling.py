import numpy as np
import pytest

from sdt_tools.error_analysis.resampling import (
    correlation,
    difference_of_ratios,
    draw_units,
    estimate,
    moments,
    ratio,
    sum_by_unit,
)


def mean_of(values: np.ndarray, unit: np.ndarray, seed: int = 0, resamples: int = 4000):
    units = int(unit.max()) + 1
    sums = sum_by_unit(np.array([values, np.ones(len(values))]), unit, units)
    return estimate(sums, ratio, draw_units(units, resamples, seed))


def test_a_resample_draws_as_many_units_as_there_are() -> None:
    assert set(draw_units(7, 50, 1).sum(axis=0)) == {7}


def test_the_interval_of_a_mean_is_that_of_the_normal_law() -> None:
    values = np.random.default_rng(3).normal(2.0, 1.0, 400)
    found = mean_of(values, np.arange(400))
    half = 1.96 * values.std() / np.sqrt(400)
    assert found.value == pytest.approx(values.mean())
    assert (found.low, found.high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.15 * half)


def test_frames_that_repeat_their_recording_narrow_nothing() -> None:
    values = np.random.default_rng(4).normal(size=30)
    once = mean_of(values, np.arange(30))
    often = mean_of(np.repeat(values, 50), np.repeat(np.arange(30), 50))
    assert (once.low, once.high) == pytest.approx((often.low, often.high))


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    """Recordings with means of their own: 95 % of the intervals hold the mean of all, give or take."""
    rng = np.random.default_rng(5)
    held = 0
    for trial in range(200):
        own = rng.normal(0.0, 1.0, 40)
        values = (own[:, None] + rng.normal(0.0, 1.0, (40, 20))).ravel()
        found = mean_of(values, np.repeat(np.arange(40), 20), trial, 400)
        held += found.low <= 0.0 <= found.high
    assert 0.89 <= held / 200 <= 0.99


def test_a_difference_of_means() -> None:
    sums = np.array([[3.0, 1.0], [4.0, 4.0], [1.0, 1.0], [2.0, 2.0]])
    assert estimate(sums, difference_of_ratios, draw_units(2, 100, 0)).value == pytest.approx(4 / 8 - 2 / 4)


def test_the_correlation_is_numpys() -> None:
    rng = np.random.default_rng(6)
    x = rng.normal(1e6, 1.0, 300)
    y = x + rng.normal(0.0, 2.0, 300)
    unit = np.repeat(np.arange(30), 10)
    found = estimate(sum_by_unit(moments(x, y), unit, 30), correlation, draw_units(30, 500, 0))
    assert found.value == pytest.approx(np.corrcoef(x, y)[0, 1])
    assert found.low < found.value < found.high


def test_one_recording_has_no_interval() -> None:
    found = mean_of(np.array([0.0, 1.0]), np.array([0, 0]))
    assert found.value == 0.5
    assert np.isnan([found.low, found.high]).all()
    assert found.document() == {"value": 0.5, "low": None, "high": None}


def test_what_most_resamples_cannot_know_has_no_interval() -> None:
    """Only one of three recordings has frames of the group: a third of the resamples lack it."""
    sums = np.array([[2.0, 0.0, 0.0], [4.0, 0.0, 0.0]])
    found = estimate(sums, ratio, draw_units(3, 500, 0))
    assert found.value == 0.5
    assert np.isnan(found.low)
