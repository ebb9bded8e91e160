import numpy as np

from sdt_tools.error_analysis.conditions.merging import merge, refit
from sdt_tools.error_analysis.conditions.predicates import Condition, Features, Predicate
from sdt_tools.error_analysis.conditions.scoring import Scope, scope_of
from sdt_tools.error_analysis.definitions import ConditionOptions

FRAMES = 4000
RNG = np.random.default_rng(0)
X, Y = RNG.random(FRAMES), RNG.random(FRAMES)
MOTION = RNG.integers(4, size=FRAMES)


def search(inside: np.ndarray) -> Scope:
    features = Features(FRAMES, {"x": X, "y": Y}, {"motion": MOTION}, {"motion": ("a", "b", "c", "d")})
    wrong = np.random.default_rng(1).random(FRAMES) < np.where(inside, 0.8, 0.02)
    return scope_of(features, wrong.astype(float), wrong, 0.5, ConditionOptions())


def condition(*predicates: tuple[str, str, object]) -> Condition:
    return Condition(tuple(Predicate(*predicate) for predicate in predicates))  # type: ignore[arg-type]


def test_two_halves_of_one_condition_become_one() -> None:
    scope = search(X < 0.3)
    (merged,) = merge(
        scope, [condition(("x", "<", 0.3), ("y", "<", 0.6)), condition(("x", "<", 0.31), ("y", ">=", 0.5))]
    )
    (predicate,) = merged.predicates
    assert (predicate.feature, predicate.operator) == ("x", "<")
    assert abs(predicate.bound - 0.3) < 0.01


def test_two_names_become_a_set() -> None:
    scope = search((X < 0.4) & np.isin(MOTION, (0, 2)))
    parts = [condition(("x", "<", 0.4), ("motion", "=", "a")), condition(("x", "<", 0.4), ("motion", "=", "c"))]
    (merged,) = merge(scope, parts)
    assert merged.text.endswith("motion in {a, c}")


def test_a_condition_inside_another_goes() -> None:
    scope = search(X < 0.3)
    wide, narrow = condition(("x", "<", 0.3)), condition(("x", "<", 0.2), ("y", "<", 0.5))
    (merged,) = merge(scope, [wide, narrow])
    assert [predicate.feature for predicate in merged.predicates] == ["x"]


def test_conditions_that_explain_different_errors_stay() -> None:
    scope = search((X < 0.15) | (Y < 0.1))
    both = [condition(("x", "<", 0.15)), condition(("y", "<", 0.1))]
    assert merge(scope, both) == both


def test_apart_on_one_feature_they_stay() -> None:
    scope = search((X < 0.15) | (X >= 0.9))
    both = [condition(("x", "<", 0.15)), condition(("x", ">=", 0.9))]
    assert merge(scope, both) == both


def test_a_condition_is_fitted_beside_the_other() -> None:
    """Seen alone, the first takes in what belongs to the second."""
    scope = search((X < 0.2) | ((X < 0.4) & (Y < 0.5)))
    second = condition(("x", "<", 0.4), ("y", "<", 0.5))
    first = refit(scope, [condition(("x", "<", 0.3)), second])[0]
    assert abs(first.predicates[0].bound - 0.2) < 0.01
