import numpy as np
import pytest

from sdt_tools.error_analysis.definitions import PICTURE_FEATURES, ConditionOptions, ErrorOptions
from sdt_tools.error_analysis.epsilon import estimate_epsilon
from sdt_tools.error_analysis.spaces import TimeSpace, feature_space
from sdt_tools.error_analysis.suited import suited_options
from sdt_tools.errors import UsageError
from sdt_tools.replay.predictions import PredictionKind

MS = 1_000_000


def moments(seed: int = 0, recordings: int = 3, frames: int = 40) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    stamps_ns = np.cumsum(rng.integers(20 * MS, 300 * MS, (recordings, frames)), axis=1)
    return np.repeat(np.arange(recordings), frames), stamps_ns.ravel()


def test_neighbours_in_time_are_those_of_brute_force() -> None:
    recording, stamp_ns = moments()
    space = TimeSpace(recording, stamp_ns)
    rows = np.array([0, 5, 39, 40, 77, 119])
    groups = np.vstack([np.ones(120, bool), np.random.default_rng(1).random(120) < 0.5])
    apart_ms = space.distances(np.repeat(rows, 120), np.tile(np.arange(120), 6)).reshape(6, 120)
    within = (apart_ms <= 400.0) & (np.arange(120)[None] != rows[:, None])
    np.testing.assert_array_equal(space.count(rows, 400.0, groups), groups.astype(int) @ within.T.astype(int))
    for row, near in zip(rows, space.nearest(rows, 400.0, 2), strict=True):
        inside = np.flatnonzero(within[list(rows).index(row)])
        nearest = sorted(inside, key=lambda other: abs(stamp_ns[other] - stamp_ns[row]))[:2]
        assert [one.row for one in near] == nearest


def test_frames_of_different_recordings_are_never_neighbours_in_time() -> None:
    recording = np.array([0, 1])
    space = TimeSpace(recording, np.zeros(2, np.int64))
    assert np.isinf(space.distances(np.array([0]), np.array([1]))[0])
    assert space.count(np.array([0]), 1e6, np.ones((1, 2), bool))[0, 0] == 0


def test_epsilon_in_time_is_a_percentile_of_the_gaps() -> None:
    recording, stamp_ns = moments(recordings=1)
    epsilon = estimate_epsilon(TimeSpace(recording, stamp_ns), recording, stamp_ns, ErrorOptions())
    assert epsilon.value == pytest.approx(np.percentile(np.diff(stamp_ns) / MS, 90))
    assert epsilon.text.endswith(" ms")


def test_features_have_a_distance_of_their_own() -> None:
    features = np.random.default_rng(2).random((30, 7), np.float32)
    space = feature_space(features)
    exact = np.sqrt(((features[:, None].astype(float) - features[None]) ** 2).mean(axis=2))
    np.testing.assert_allclose(space.distances(np.zeros(30, int), np.arange(30)), exact[0], atol=1e-7)
    counted = space.count(np.arange(30), 0.4, np.ones((1, 30), bool))[0]
    np.testing.assert_array_equal(counted, (exact <= 0.4).sum(axis=1) - 1)


def test_options_suit_what_was_answered() -> None:
    scans = suited_options(ErrorOptions(), PredictionKind.SCANS)
    pictures = suited_options(ErrorOptions(), PredictionKind.PICTURES)
    assert (scans.neighbourhood, pictures.neighbourhood) == ("scan", "feature")
    assert scans.conditions == ConditionOptions()
    assert pictures.conditions.features == PICTURE_FEATURES
    chosen = ErrorOptions(neighbourhood="time", epsilon_ms=50, conditions=ConditionOptions(features=("light",)))
    assert suited_options(chosen, PredictionKind.PICTURES) == chosen


def test_options_of_another_neighbourhood_are_refused() -> None:
    with pytest.raises(UsageError, match="'scan': these are answers to pictures"):
        suited_options(ErrorOptions(neighbourhood="scan"), PredictionKind.PICTURES)
    with pytest.raises(UsageError, match="'feature': these are answers to scans"):
        suited_options(ErrorOptions(neighbourhood="feature"), PredictionKind.SCANS)
    with pytest.raises(UsageError, match=r"epsilon_m is about the neighbourhood 'scan'.* set epsilon_feature"):
        suited_options(ErrorOptions(epsilon_m=0.2), PredictionKind.PICTURES)
