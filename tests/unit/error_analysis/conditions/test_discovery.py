import numpy as np
import pytest

from sdt_tools.error_analysis.conditions.discovery import discover
from sdt_tools.error_analysis.conditions.predicates import Features
from sdt_tools.error_analysis.conditions.scoring import Scope, scope_of
from sdt_tools.error_analysis.definitions import ConditionOptions

FRAMES = 6000


def search(wrong: np.ndarray, numeric: dict[str, np.ndarray], codes: dict[str, np.ndarray]) -> Scope:
    categories = {name: tuple("abcd"[: int(values.max()) + 1]) for name, values in codes.items()}
    features = Features(len(wrong), numeric, codes, categories)
    return scope_of(features, wrong.astype(float), wrong, 0.5, ConditionOptions())


def data(seed: int) -> tuple[np.random.Generator, dict[str, np.ndarray], dict[str, np.ndarray], np.ndarray]:
    rng = np.random.default_rng(seed)
    numeric = {"range_m": rng.uniform(0, 4, FRAMES), "speed_mps": rng.normal(size=FRAMES)}
    codes = {"motion": rng.integers(4, size=FRAMES), "light": rng.integers(3, size=FRAMES)}
    return rng, numeric, codes, np.repeat(np.arange(20), FRAMES // 20)


def test_a_single_bound_is_found() -> None:
    rng, numeric, codes, recording = data(0)
    wrong = rng.random(FRAMES) < np.where(numeric["range_m"] < 0.62, 0.8, 0.02)
    (condition,) = discover(search(wrong, numeric, codes), recording)
    (predicate,) = condition.predicates
    assert (predicate.feature, predicate.operator) == ("range_m", "<")
    assert predicate.value == pytest.approx(0.62, abs=0.01)


def test_a_conjunction_of_a_bound_and_a_name_is_found() -> None:
    rng, numeric, codes, recording = data(1)
    wrong = rng.random(FRAMES) < np.where((numeric["speed_mps"] >= 0.7) & (codes["motion"] == 2), 0.8, 0.02)
    (condition,) = discover(search(wrong, numeric, codes), recording)
    assert {(predicate.feature, predicate.operator) for predicate in condition.predicates} == {
        ("speed_mps", ">="),
        ("motion", "="),
    }


def test_two_conditions_are_found_one_after_the_other() -> None:
    rng, numeric, codes, recording = data(2)
    inside = (numeric["range_m"] < 0.4) | ((numeric["speed_mps"] < -0.5) & (codes["light"] == 1))
    found = discover(search(rng.random(FRAMES) < np.where(inside, 0.85, 0.02), numeric, codes), recording)
    features = [{predicate.feature for predicate in condition.predicates} for condition in found]
    assert sorted(features, key=len) == [{"range_m"}, {"speed_mps", "light"}]


def test_an_interval_is_found_as_two_bounds_on_one_feature() -> None:
    rng, numeric, codes, recording = data(3)
    inside = (numeric["range_m"] >= 1.0) & (numeric["range_m"] < 1.5)
    (condition,) = discover(search(rng.random(FRAMES) < np.where(inside, 0.8, 0.02), numeric, codes), recording)
    bounds = {predicate.operator: predicate.value for predicate in condition.predicates}
    assert bounds == {">=": pytest.approx(1.0, abs=0.02), "<": pytest.approx(1.5, abs=0.02)}


def test_what_is_wrong_in_two_recordings_only_is_no_condition() -> None:
    rng, numeric, codes, recording = data(4)
    numeric["range_m"] = np.where(recording < 2, 0.1, 2.0) + 0.01 * numeric["range_m"]
    wrong = rng.random(FRAMES) < np.where(recording < 2, 0.8, 0.02)
    assert discover(search(wrong, numeric, codes), recording) == []


def test_errors_everywhere_alike_are_no_condition() -> None:
    rng, numeric, codes, recording = data(5)
    assert discover(search(rng.random(FRAMES) < 0.2, numeric, codes), recording) == []


def test_unknown_values_are_never_inside() -> None:
    rng, numeric, codes, recording = data(6)
    wrong = rng.random(FRAMES) < np.where(numeric["range_m"] < 0.62, 0.8, 0.02)
    numeric["range_m"][::3] = np.nan
    (condition,) = discover(search(wrong & (np.arange(FRAMES) % 3 > 0), numeric, codes), recording)
    assert not condition.mask(search(wrong, numeric, codes).features)[::3].any()


def test_an_interval_and_a_name_together_are_found() -> None:
    """Three predicates of which no two fulfil Definition 3."""
    rng, numeric, codes, recording = data(7)
    inside = (numeric["range_m"] >= 1.0) & (numeric["range_m"] < 1.6) & (codes["motion"] == 2)
    (condition,) = discover(search(rng.random(FRAMES) < np.where(inside, 0.8, 0.02), numeric, codes), recording)
    bounds = {(predicate.feature, predicate.operator): predicate.value for predicate in condition.predicates}
    assert bounds == {
        ("range_m", ">="): pytest.approx(1.0, abs=0.03),
        ("range_m", "<"): pytest.approx(1.6, abs=0.03),
        ("motion", "="): "c",
    }


def test_names_that_share_a_condition_are_said_together() -> None:
    rng, numeric, codes, recording = data(8)
    inside = (numeric["range_m"] < 1.0) & np.isin(codes["motion"], (1, 3))
    (condition,) = discover(search(rng.random(FRAMES) < np.where(inside, 0.8, 0.02), numeric, codes), recording)
    assert condition.text.endswith("motion in {b, d}") or condition.text.startswith("motion in {b, d}")


def test_of_conditions_that_say_the_same_the_one_without_a_bound_is_taken() -> None:
    rng, numeric, codes, recording = data(9)
    codes["near"] = (numeric["range_m"] < 0.5).astype(np.int64)
    (condition,) = discover(search(rng.random(FRAMES) < np.where(codes["near"], 0.8, 0.02), numeric, codes), recording)
    assert condition.text == "near = b"


def test_frames_to_both_sides_are_said_by_the_magnitude() -> None:
    rng, numeric, codes, recording = data(10)
    numeric["|speed_mps|"] = np.abs(numeric["speed_mps"])
    inside = numeric["|speed_mps|"] < 0.2
    (condition,) = discover(search(rng.random(FRAMES) < np.where(inside, 0.8, 0.02), numeric, codes), recording)
    (predicate,) = condition.predicates
    assert (predicate.feature, predicate.operator) == ("|speed_mps|", "<")
