import math

import pytest

from sdt_tools.statistics import wilson


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
