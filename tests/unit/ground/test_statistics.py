import math

import pytest
from scipy.stats import chi2

from sdt_tools.statistics import poisson_interval, wilson


@pytest.mark.parametrize(("successes", "trials"), [(18, 20), (1, 7), (350, 700)])
def test_the_ends_solve_the_score_equation(successes: int, trials: int) -> None:
    z = 1.959963984540054
    for end in wilson(successes, trials):
        assert abs(successes / trials - end) == pytest.approx(z * math.sqrt(end * (1 - end) / trials), rel=1e-9)


def test_all_or_none_reach_the_ends() -> None:
    assert wilson(0, 20)[0] == 0.0
    assert wilson(20, 20)[1] == 1.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_impossible_counts_are_refused() -> None:
    with pytest.raises(ValueError, match="3 successes in 2 trials"):
        wilson(3, 2)


@pytest.mark.parametrize("count", [0, 1, 2, 7, 40, 300])
@pytest.mark.parametrize("confidence", [0.95, 0.8])
def test_the_interval_of_a_count_is_that_of_scipys_quantiles(count: int, confidence: float) -> None:
    tail = (1 - confidence) / 2
    low = 0.0 if count == 0 else chi2.ppf(tail, 2 * count) / 2

    assert poisson_interval(count, confidence) == pytest.approx((low, chi2.ppf(1 - tail, 2 * count + 2) / 2), rel=1e-6)


def test_a_count_is_not_negative() -> None:
    with pytest.raises(ValueError, match="a count of -1"):
        poisson_interval(-1)
