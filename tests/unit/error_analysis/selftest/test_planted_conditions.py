import numpy as np
import pytest

from sdt_tools.error_analysis.conditions.predicates import Features, features_of
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.selftest.material import Material, all_right
from sdt_tools.error_analysis.selftest.planted_conditions import (
    RATE_INSIDE,
    RATE_OUTSIDE,
    PlantedCondition,
    choose_conditions,
    error_rate,
)

OPTIONS = ErrorOptions()


@pytest.fixture(scope="module")
def frames() -> tuple[Features, np.ndarray]:
    labelled = all_right(Material().table(np.random.default_rng(0)), OPTIONS)
    return features_of(labelled.table, OPTIONS.conditions.features), labelled.recording


def chosen(frames: tuple[Features, np.ndarray], seeds: int, sharp: bool) -> list[tuple[PlantedCondition, ...]]:
    return [choose_conditions(*frames, 2, sharp, np.random.default_rng(seed)) for seed in range(seeds)]


def test_conditions_hold_in_enough_frames_of_enough_recordings(frames: tuple[Features, np.ndarray]) -> None:
    for conditions in chosen(frames, 30, True):
        for condition in conditions:
            assert 0.05 <= condition.inside.mean() <= 0.25
            assert np.unique(frames[1][condition.inside]).size >= 8
            assert np.array_equal(condition.inside, condition.condition.mask(frames[0]))
            assert len({predicate.feature for predicate in condition.condition.predicates}) <= 2


def test_all_sorts_are_planted(frames: tuple[Features, np.ndarray]) -> None:
    conditions = [one.condition for several in chosen(frames, 60, True) for one in several]
    features = {predicate.feature for condition in conditions for predicate in condition.predicates}
    assert {"front_range_m", "|operator_bearing_rad|", "speed_mps", "motion", "scenario", "light"} <= features
    assert any("<= " in condition.text for condition in conditions)
    shares = np.mean([" and " in condition.text for condition in conditions])
    assert 0.3 < shares < 0.9


def test_two_conditions_are_about_different_features_and_hardly_overlap(frames: tuple[Features, np.ndarray]) -> None:
    for first, second in (pair for pair in chosen(frames, 30, True) if len(pair) == 2):
        names = [{predicate.feature.strip("|") for predicate in one.condition.predicates} for one in (first, second)]
        assert not names[0] & names[1]
        assert (first.inside & second.inside).sum() <= 0.2 * min(first.inside.sum(), second.inside.sum())


def test_rates_are_80_and_2_percent_with_sharp_ends(frames: tuple[Features, np.ndarray]) -> None:
    conditions = choose_conditions(*frames, 1, True, np.random.default_rng(0))
    rates = error_rate(conditions, frames[0].frames)
    assert np.unique(rates[conditions[0].inside]) == pytest.approx([RATE_INSIDE])
    assert np.unique(rates[~conditions[0].inside]) == pytest.approx([RATE_OUTSIDE])


def test_blurred_ends_are_half_way_at_the_bound(frames: tuple[Features, np.ndarray]) -> None:
    for conditions in chosen(frames, 40, False):
        (predicate, *more) = conditions[0].condition.predicates
        if more or not predicate.is_bound:
            continue
        values, weight = frames[0].numeric[predicate.feature], conditions[0].weight
        assert weight[np.argmin(np.abs(values - predicate.bound))] == pytest.approx(0.5, abs=0.05)
        order = np.argsort(values)
        slope = np.diff(weight[order]) * (1 if predicate.operator == ">=" else -1)
        assert (slope >= 0).all()
        inside = conditions[0].inside
        assert np.mean(weight[inside] < 0.9) == pytest.approx(0.2, abs=0.05) or weight[inside].mean() > 0.9
