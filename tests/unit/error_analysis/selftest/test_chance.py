import numpy as np
import pytest

from sdt_tools.error_analysis.selftest.chance import BAD_RECORDINGS, NULLS, RATES, in_bursts, sticky_uniforms

RECORDING = np.repeat(np.arange(40), 400)


def follow_up_rate(wrong: np.ndarray) -> float:
    """Share of errors whose next frame, in the same recording, is one."""
    follows = (RECORDING[1:] == RECORDING[:-1]) & wrong[:-1]
    return float(wrong[1:][follows].mean())


def test_sticky_numbers_are_uniform_and_hold() -> None:
    numbers = sticky_uniforms(RECORDING, 5.0, np.random.default_rng(0))
    assert np.histogram(numbers, 10, (0, 1))[0] / len(numbers) == pytest.approx(np.full(10, 0.1), abs=0.02)
    same = numbers[1:] == numbers[:-1]
    assert same[RECORDING[1:] == RECORDING[:-1]].mean() == pytest.approx(0.8, abs=0.02)
    assert not same[RECORDING[1:] != RECORDING[:-1]].any()


def test_numbers_that_hold_for_one_frame_are_independent() -> None:
    numbers = sticky_uniforms(RECORDING, 1.0, np.random.default_rng(0))
    assert len(np.unique(numbers)) == len(numbers)


@pytest.mark.parametrize("kind", ["random", "autocorrelated", "bursts"])
def test_rates_are_within_their_limits(kind: str) -> None:
    rates = [NULLS[kind](RECORDING, np.random.default_rng(seed)).mean() for seed in range(20)]
    assert min(rates) > RATES[0] - 0.03
    assert max(rates) < RATES[1] + 0.05
    assert np.std(rates) > 0.05


def test_errors_at_random_do_not_follow_each_other() -> None:
    wrong = NULLS["random"](RECORDING, np.random.default_rng(3))
    assert follow_up_rate(wrong) == pytest.approx(wrong.mean(), abs=0.03)


def test_correlated_errors_and_bursts_do() -> None:
    for kind, least in (("autocorrelated", 0.6), ("bursts", 0.9)):
        wrong = NULLS[kind](RECORDING, np.random.default_rng(3))
        assert follow_up_rate(wrong) > least


def test_bursts_have_the_length_they_are_said_to_have() -> None:
    wrong = np.concatenate([in_bursts(np.zeros(20_000, np.int64), np.random.default_rng(seed)) for seed in range(5)])
    begins = np.sum(wrong[1:] & ~wrong[:-1])
    assert wrong.sum() / begins == pytest.approx(25, rel=0.15)


def test_some_recordings_are_bad_and_the_others_good() -> None:
    bad = []
    for seed in range(20):
        wrong = NULLS["bad_recordings"](RECORDING, np.random.default_rng(seed))
        rates = wrong.reshape(40, 400).mean(axis=1)
        assert np.mean((rates > 0.2) & (rates < 0.6)) < 0.05
        bad.append((rates > 0.5).mean())
    assert np.mean(bad) == pytest.approx(BAD_RECORDINGS, abs=0.05)
