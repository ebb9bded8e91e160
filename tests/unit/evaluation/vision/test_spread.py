"""Intervals of counts, and the test of an even spread: against other libraries, and by simulation."""

import numpy as np
import pytest
from scipy.stats import kstest

from sdt_tools.evaluation.vision.spread import count_interval, evenness_of
from sdt_tools.statistics import poisson_interval


def clustered(rng: np.random.Generator, rates: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Counts of runs that differ: most have none, some have many; a seed brings something into all of its runs."""
    of_seed = rng.gamma(1.0, 1.0, (shape[0], 1))
    of_run = rng.gamma(0.5, 2.0, shape)
    return rng.poisson(rates * of_seed * of_run)


def test_the_interval_is_the_exact_one_where_nothing_was_counted() -> None:
    low, high = count_interval([0] * 20)

    assert low == 0.0
    assert high == pytest.approx(poisson_interval(0)[1] / 20)


def test_one_run_of_many_errors_makes_the_interval_wider_than_spread_errors_do() -> None:
    spread, heap = count_interval([1] * 20), count_interval([20] + [0] * 19)

    assert spread == pytest.approx(tuple(end / 20 for end in poisson_interval(20)))
    assert heap[0] < spread[0]
    assert heap[1] > 1.5 * spread[1]


def test_without_runs_nothing_is_known() -> None:
    assert count_interval([]) == (0.0, float("inf"))


def test_intervals_hold_the_mean_of_clustered_counts_nearly_as_often_as_they_say() -> None:
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(60):
        low, high = count_interval(clustered(rng, np.array([1.0]), (20, 1))[:, 0].tolist())
        held += low <= 1.0 <= high
    assert held >= 48  # with so few, skewed runs, bootstrap intervals hold less than they say; Poisson's hold 6 in 10


def test_p_values_are_even_where_errors_are_though_they_cluster_and_runs_differ_in_length() -> None:
    rng = np.random.default_rng(2)
    exposure = np.tile(np.array([200.0, 200, 200, 300, 210, 250, 225]), (20, 1))
    p_values = []
    for _ in range(60):
        one = evenness_of(clustered(rng, exposure / 225 * 0.5, (20, 7)).astype(np.int64), exposure)
        assert one.p_value is not None
        p_values.append(one.p_value)
    assert kstest(p_values, "uniform").pvalue > 0.01


def test_errors_of_one_scenario_alone_are_not_even() -> None:
    counts = np.zeros((20, 7), np.int64)
    counts[::2, 3] = 1
    one = evenness_of(counts, np.full((20, 7), 200.0))

    assert one.p_value is not None
    assert one.p_value < 0.001
    assert one.decided
    assert one.expected == pytest.approx([10 / 7] * 7)


def test_what_longer_runs_explain_is_even() -> None:
    exposure = np.tile([100.0, 400.0], (20, 1))
    counts = np.tile([1, 4], (20, 1)).astype(np.int64)
    one = evenness_of(counts, exposure)

    assert one.expected == pytest.approx([20, 80])
    assert one.p_value == 1.0


def test_a_single_run_of_many_errors_says_nothing_of_its_scenario() -> None:
    counts = np.zeros((20, 7), np.int64)
    counts[4, 2] = 12
    one = evenness_of(counts, np.full((20, 7), 200.0))

    assert one.p_value == pytest.approx(1.0)


def test_without_errors_there_is_nothing_to_test() -> None:
    one = evenness_of(np.zeros((20, 7), np.int64), np.full((20, 7), 200.0))

    assert (one.errors, one.p_value, one.decided) == (0, None, False)


def test_one_scenario_alone_is_nothing_to_spread_over() -> None:
    assert evenness_of(np.ones((20, 1), np.int64), np.full((20, 1), 200.0)).p_value is None
