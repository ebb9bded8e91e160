import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.error_analysis.conditions.predicates import Condition, Features, Predicate
from sdt_tools.error_analysis.conditions.scoring import Scope, log_likelihood_ratio, scope_of
from sdt_tools.error_analysis.definitions import ConditionOptions

VALUES = np.arange(1000.0)


def search(wrong: np.ndarray) -> Scope:
    codes = {"half": (VALUES >= 500).astype(np.int64)}
    features = Features(1000, {"x": VALUES}, codes, {"half": ("first", "second")})
    return scope_of(features, wrong.astype(float), wrong, 0.5, ConditionOptions(min_support=0.05))


@given(st.integers(1, 50), st.integers(0, 50), st.integers(1, 50), st.integers(0, 50))
def test_the_score_is_the_gain_in_log_likelihood(inside: int, wrong_in: int, outside: int, wrong_out: int) -> None:
    wrong_in, wrong_out = min(wrong_in, inside), min(wrong_out, outside)

    def log_likelihood(frames: int, errors: int, rate: float) -> float:
        right = frames - errors
        return (errors * math.log(rate) if errors else 0.0) + (right * math.log(1 - rate) if right else 0.0)

    whole = (wrong_in + wrong_out) / (inside + outside)
    apart = log_likelihood(inside, wrong_in, wrong_in / inside)
    apart += log_likelihood(outside, wrong_out, wrong_out / outside)
    together = log_likelihood(inside, wrong_in, whole) + log_likelihood(outside, wrong_out, whole)
    counts = np.array([[inside], [wrong_in]], float)
    score = log_likelihood_ratio(counts[0], counts[1], float(inside + outside), float(wrong_in + wrong_out))
    assert score[0] == pytest.approx(apart - together, abs=1e-9)


def test_definition_3_is_a_gate() -> None:
    scope = search(np.where(VALUES < 100, 8, 1) > VALUES % 10)
    assert scope.score(Condition((Predicate("x", "<", 100.0),))) > 100.0
    half = Condition((Predicate("x", "<", 500.0),))
    assert scope.score(half) == -1.0
    assert scope.gain(half) > 0.0


def test_too_few_frames_are_a_gate() -> None:
    scope = search(VALUES < 50)
    assert scope.score(Condition((Predicate("x", "<", 50.0),))) > 0.0
    assert scope.score(Condition((Predicate("x", "<", 49.0),))) == -1.0


def test_fewer_errors_inside_than_outside_are_no_gain() -> None:
    assert search(VALUES < 100).gain(Condition((Predicate("x", ">=", 100.0),))) == -1.0


def test_a_bound_costs_more_than_a_name() -> None:
    scope = search(VALUES >= 500)
    bound, name = Condition((Predicate("x", ">=", 500.0),)), Condition((Predicate("half", "=", "second"),))
    assert scope.gain(bound) == scope.gain(name)
    assert scope.worth(bound) == pytest.approx(scope.gain(bound) - 0.5 * math.log(1000))
    assert scope.worth(name) > scope.worth(bound)


def test_explained_frames_no_longer_count() -> None:
    scope = search(VALUES < 100)
    left = scope.within(VALUES >= 50)
    assert left.totals.tolist() == [950.0, 50.0, 50.0]
    assert left.score(Condition((Predicate("x", "<", 50.0),))) == -1.0
