import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.error_analysis.conditions.discovery import Scope, discover, log_likelihood_ratio
from sdt_tools.error_analysis.conditions.predicates import Features
from sdt_tools.error_analysis.definitions import ConditionOptions

FRAMES = 6000


def scope_of(wrong: np.ndarray, numeric: dict[str, np.ndarray], codes: dict[str, np.ndarray]) -> Scope:
    categories = {name: tuple("abcd"[: int(values.max()) + 1]) for name, values in codes.items()}
    features = Features(len(wrong), numeric, codes, categories)
    return Scope(features, wrong.astype(float), wrong, np.ones(len(wrong), bool), 0.5, ConditionOptions())


def data(seed: int) -> tuple[np.random.Generator, dict[str, np.ndarray], dict[str, np.ndarray], np.ndarray]:
    rng = np.random.default_rng(seed)
    numeric = {"range_m": rng.uniform(0, 4, FRAMES), "speed_mps": rng.normal(size=FRAMES)}
    codes = {"motion": rng.integers(4, size=FRAMES), "light": rng.integers(3, size=FRAMES)}
    return rng, numeric, codes, np.repeat(np.arange(20), FRAMES // 20)


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


def test_a_single_bound_is_found() -> None:
    rng, numeric, codes, recording = data(0)
    wrong = rng.random(FRAMES) < np.where(numeric["range_m"] < 0.62, 0.8, 0.02)
    (condition,) = discover(scope_of(wrong, numeric, codes), recording)
    (predicate,) = condition.predicates
    assert (predicate.feature, predicate.operator) == ("range_m", "<")
    assert predicate.value == pytest.approx(0.62, abs=0.01)


def test_a_conjunction_of_a_bound_and_a_name_is_found() -> None:
    rng, numeric, codes, recording = data(1)
    wrong = rng.random(FRAMES) < np.where((numeric["speed_mps"] >= 0.7) & (codes["motion"] == 2), 0.8, 0.02)
    (condition,) = discover(scope_of(wrong, numeric, codes), recording)
    assert {(predicate.feature, predicate.operator) for predicate in condition.predicates} == {
        ("speed_mps", ">="),
        ("motion", "="),
    }


def test_two_conditions_are_found_one_after_the_other() -> None:
    rng, numeric, codes, recording = data(2)
    inside = (numeric["range_m"] < 0.4) | ((numeric["speed_mps"] < -0.5) & (codes["light"] == 1))
    found = discover(scope_of(rng.random(FRAMES) < np.where(inside, 0.85, 0.02), numeric, codes), recording)
    features = [{predicate.feature for predicate in condition.predicates} for condition in found]
    assert sorted(features, key=len) == [{"range_m"}, {"speed_mps", "light"}]


def test_an_interval_is_found_as_two_bounds_on_one_feature() -> None:
    rng, numeric, codes, recording = data(3)
    inside = (numeric["range_m"] >= 1.0) & (numeric["range_m"] < 1.5)
    (condition,) = discover(scope_of(rng.random(FRAMES) < np.where(inside, 0.8, 0.02), numeric, codes), recording)
    bounds = {predicate.operator: predicate.value for predicate in condition.predicates}
    assert bounds == {">=": pytest.approx(1.0, abs=0.02), "<": pytest.approx(1.5, abs=0.02)}


def test_what_is_wrong_in_two_recordings_only_is_no_condition() -> None:
    rng, numeric, codes, recording = data(4)
    numeric["range_m"] = np.where(recording < 2, 0.1, 2.0) + 0.01 * numeric["range_m"]
    wrong = rng.random(FRAMES) < np.where(recording < 2, 0.8, 0.02)
    assert discover(scope_of(wrong, numeric, codes), recording) == []


def test_errors_everywhere_alike_are_no_condition() -> None:
    rng, numeric, codes, recording = data(5)
    assert discover(scope_of(rng.random(FRAMES) < 0.2, numeric, codes), recording) == []


def test_unknown_values_are_never_inside() -> None:
    rng, numeric, codes, recording = data(6)
    wrong = rng.random(FRAMES) < np.where(numeric["range_m"] < 0.62, 0.8, 0.02)
    numeric["range_m"][::3] = np.nan
    (condition,) = discover(scope_of(wrong & (np.arange(FRAMES) % 3 > 0), numeric, codes), recording)
    assert not condition.mask(scope_of(wrong, numeric, codes).features)[::3].any()
