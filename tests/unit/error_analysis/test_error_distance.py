import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.distance import pair_distances_m, rms_m, situations
from sdt_tools.error_analysis.epsilon import estimate_epsilon, follows_closely
from sdt_tools.error_analysis.spaces import VectorSpace, scan_space
from sdt_tools.errors import UsageError

SECOND_NS = 1_000_000_000
OPTIONS = ErrorOptions()


def straight_drives(steps_m: list[float], recordings: int = 1) -> tuple[VectorSpace, np.ndarray, np.ndarray]:
    """The space of scans that are flat at a distance growing by ``steps_m``; recordings are 1 m apart."""
    at = np.concatenate([0.1 + number + np.cumsum([0.0, *steps_m]) for number in range(recordings)])
    frames = len(steps_m) + 1
    scans = np.repeat(at[:, None], 8, axis=1).astype(np.float32)
    stamps_ns = np.tile(np.arange(frames) * SECOND_NS // 10, recordings)
    return scan_space(scans), np.repeat(np.arange(recordings), frames), stamps_ns


@given(st.floats(-1.0, 1.0), st.integers(1, 541))
def test_a_shift_of_all_rays_is_its_own_distance(shift_m: float, rays: int) -> None:
    left = np.full((1, rays), 1.0, np.float32)
    right = (left + np.float32(shift_m)).astype(np.float32)
    assert rms_m(left, right)[0] == pytest.approx(abs(float(right[0, 0]) - 1.0), abs=1e-12)


def test_codes_are_filled_and_far_ranges_clipped() -> None:
    scans = np.array([[1.0, 0.0, 0.002, 4.0, 9.0]])
    np.testing.assert_allclose(situations(scans, OPTIONS)[0], [1.0, 2.0, 2.5, 2.5, 2.5], atol=1e-6)


def test_two_noisy_copies_with_codes_are_near_each_other() -> None:
    rng = np.random.default_rng(0)
    room = np.linspace(1.0, 2.0, 541)
    copies = room + rng.normal(0, 0.011, (2, 541))
    copies[0, ::9] = 0.0
    filled = situations(copies, OPTIONS)
    raw = situations(copies, ErrorOptions(fill_codes=False))
    assert rms_m(filled[:1], filled[1:])[0] < 0.02
    assert rms_m(raw[:1], raw[1:])[0] > 0.4


def test_epsilon_is_the_percentile_of_successive_distances() -> None:
    steps = [0.01 * step for step in range(1, 12)]
    epsilon = estimate_epsilon(*straight_drives(steps), OPTIONS)
    assert epsilon.value == pytest.approx(np.percentile(steps, 90), abs=1e-6)


def test_epsilon_is_taken_within_recordings() -> None:
    epsilon = estimate_epsilon(*straight_drives([0.01] * 5, recordings=2), OPTIONS)
    assert epsilon.successive.max() == pytest.approx(0.01, abs=1e-6)


def test_a_gap_in_time_parts_frames() -> None:
    stamps_ns = np.array([0, 1, 8, 9]) * SECOND_NS // 10
    assert follows_closely(np.zeros(4, np.int64), stamps_ns, 0.5).tolist() == [False, True, False, True]


def test_a_given_epsilon_is_taken_as_it_is() -> None:
    epsilon = estimate_epsilon(*straight_drives([0.01] * 5), ErrorOptions(epsilon_m=0.3))
    assert (epsilon.value, epsilon.source) == (0.3, "given")


def test_a_wide_epsilon_is_warned_of() -> None:
    drives = straight_drives([0.01] * 5, recordings=3)
    assert estimate_epsilon(*drives, OPTIONS).warning == ""
    assert "of unrelated frames lie within it" in estimate_epsilon(*drives, ErrorOptions(epsilon_m=1.2)).warning


def test_of_one_recording_frames_far_apart_in_time_are_unrelated() -> None:
    scans, recording, stamps_ns = straight_drives([0.01] * 199)
    epsilon = estimate_epsilon(scans, recording, stamps_ns, OPTIONS)
    assert epsilon.unrelated.size > 100
    assert epsilon.unrelated.min() == pytest.approx(1.0, abs=1e-3)  # 10 s are 100 steps of 1 cm


def test_lone_frames_cannot_give_epsilon() -> None:
    scans, recording, stamps_ns = straight_drives([0.01] * 5)
    with pytest.raises(UsageError, match="set epsilon_m"):
        estimate_epsilon(scans, recording, stamps_ns * 100, OPTIONS)


def test_copies_cannot_give_epsilon() -> None:
    with pytest.raises(UsageError, match="exact copies"):
        estimate_epsilon(*straight_drives([0.0] * 5), OPTIONS)


def test_distances_of_many_pairs_are_those_of_each() -> None:
    rng = np.random.default_rng(3)
    scans = rng.random((50, 541), np.float32)
    left, right = rng.integers(50, size=(2, 40_000))  # more than a block
    np.testing.assert_allclose(pair_distances_m(scans, left, right), rms_m(scans[left], scans[right]), rtol=1e-12)
