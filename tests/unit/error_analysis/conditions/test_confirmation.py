from itertools import permutations, product

import numpy as np
import pytest

from sdt_tools.error_analysis.conditions.confirmation import Recordings, confirm, holm, permutation_p
from sdt_tools.error_analysis.conditions.predicates import Condition, Predicate
from sdt_tools.error_analysis.definitions import ConditionOptions

CONDITION = Condition((Predicate("range_m", "<", 1.0),))
OPTIONS = ConditionOptions()


def recordings_of(loss: np.ndarray, length: int) -> Recordings:
    return Recordings(loss.astype(float), loss > 0.5, np.arange(len(loss)) // length)


def judged(inside: np.ndarray, wrong: np.ndarray, length: int = 50):
    rng = np.random.default_rng(0)
    return confirm([CONDITION], [inside], recordings_of(wrong.astype(float), length), 0.5, OPTIONS, rng)[0]


def test_holm_on_a_textbook_example() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])


def test_the_p_value_is_that_of_all_swaps_and_shifts() -> None:
    loss = np.array([1.0, 1, 0, 0, 0, 1, 0, 0, 0])
    inside = np.array([True, True, False, False, True, True, False, True, False])
    effects = []
    for order, shifts in product(permutations(range(3)), product(range(3), repeat=3)):
        moved = np.concatenate(
            [np.roll(loss[3 * source : 3 * source + 3], -shift) for source, shift in zip(order, shifts, strict=True)]
        )
        effects.append(moved[inside].mean() - moved[~inside].mean())
    exact = np.mean(np.array(effects) >= loss[inside].mean() - loss[~inside].mean() - 1e-9)
    found = permutation_p(recordings_of(loss, 3), inside, 20_000, np.random.default_rng(0))
    assert found == pytest.approx(exact, abs=0.01)


def test_recordings_of_other_lengths_can_be_swapped() -> None:
    number = np.repeat([0, 1, 2], [5, 50, 500])
    loss = np.ones(555)
    recordings = Recordings(loss, loss > 0.5, number)
    assert permutation_p(recordings, np.arange(555) % 2 == 0, 99, np.random.default_rng(0)) == 1.0


def test_a_true_condition_is_confirmed() -> None:
    rng = np.random.default_rng(1)
    inside = rng.random(1000) < 0.2
    verdict = judged(inside, rng.random(1000) < np.where(inside, 0.8, 0.02))
    assert verdict.confirmed
    assert verdict.effect_interval is not None
    assert verdict.effect is not None
    assert verdict.effect_interval[0] < verdict.effect < verdict.effect_interval[1]
    assert verdict.effect == pytest.approx(0.78, abs=0.06)


def test_one_bad_recording_is_not_enough() -> None:
    number = np.arange(1000) // 50
    inside = number < 4
    wrong = number == 0
    assert "mean loss is not above eta" in judged(inside, wrong).reason


def test_errors_in_too_few_recordings_are_not_enough() -> None:
    number = np.arange(1000) // 50
    inside = np.isin(number, (0, 1)) | ((number == 2) & (np.arange(1000) % 50 < 10))
    wrong = np.isin(number, (0, 1))
    assert judged(inside, wrong).reason == "only 2 confirming recordings have errors inside"


def test_frames_in_too_few_recordings_are_not_enough() -> None:
    inside = np.arange(1000) < 100
    verdict = judged(inside, inside)
    assert verdict.reason == "only 100 frames of 2 confirming recordings lie inside"
    assert verdict.p_adjusted is None


def test_a_sliver_of_the_frames_is_not_enough() -> None:
    inside = np.arange(4000) % 150 == 0
    assert judged(inside, inside).reason == "only 0.68% of the confirming frames lie inside"


def test_bursts_that_the_condition_only_meets_are_not_confirmed() -> None:
    """Three of six recordings fail throughout, and the condition lies in them by chance alone."""
    number = np.arange(600) // 100
    wrong = np.isin(number, (0, 1, 2))
    inside = np.isin(number, (0, 1, 2)) & (np.arange(600) % 100 < 40)
    verdict = judged(inside, wrong & (np.arange(600) % 10 > 0), length=100)
    assert verdict.p_adjusted is not None
    assert verdict.p_adjusted > OPTIONS.alpha


def test_a_p_value_above_alpha_is_not_enough() -> None:
    rng = np.random.default_rng(1)
    inside = rng.random(1000) < 0.2
    wrong = rng.random(1000) < np.where(inside, 0.8, 0.02)
    strict = ConditionOptions(alpha=0.0005)  # fewer than one in a thousand, the least that 999 permutations can tell
    recordings = recordings_of(wrong.astype(float), 50)
    (verdict,) = confirm([CONDITION], [inside], recordings, 0.5, strict, np.random.default_rng(0))
    assert verdict.p_adjusted == pytest.approx(0.001)
    assert verdict.reason == "errors gather there by chance as often"
