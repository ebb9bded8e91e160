"""Pairing by time, against brute force."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.recording.pairing import nearest_pairs

STAMPS = st.lists(st.integers(0, 60), max_size=14).map(lambda stamps: np.array(sorted(stamps), dtype=np.int64))
TOLERANCE = st.integers(0, 10)


def greedy_pairs(first: list[int], second: list[int], tolerance: int) -> list[tuple[int, int]]:
    """Again and again the nearest two that are free: what is promised, said as slowly as can be."""
    free_first, free_second, pairs = set(range(len(first))), set(range(len(second))), []
    while True:
        candidates = [(abs(first[a] - second[b]), a, b) for a in free_first for b in free_second]
        apart, a, b = min(candidates, default=(tolerance + 1, 0, 0))
        if apart > tolerance:
            return sorted(pairs)
        pairs.append((a, b))
        free_first.remove(a)
        free_second.remove(b)


@given(STAMPS, STAMPS, TOLERANCE)
def test_pairs_are_those_of_brute_force(first: np.ndarray, second: np.ndarray, tolerance: int) -> None:
    pairs = nearest_pairs(first, second, tolerance)
    assert [tuple(row) for row in pairs.tolist()] == greedy_pairs(first.tolist(), second.tolist(), tolerance)


@given(STAMPS, STAMPS, TOLERANCE)
def test_pairs_are_one_to_one_near_and_leave_no_better_pair(
    images: np.ndarray, scans: np.ndarray, tolerance: int
) -> None:
    pairs = nearest_pairs(images, scans, tolerance)
    assert len(set(pairs[:, 0])) == len(set(pairs[:, 1])) == len(pairs)
    assert np.all(np.diff(pairs[:, 0]) > 0)
    distance_of_image = dict.fromkeys(range(len(images)), 10**6)
    distance_of_scan = dict.fromkeys(range(len(scans)), 10**6)
    for image, scan in pairs.tolist():
        distance_of_image[image] = distance_of_scan[scan] = abs(int(images[image]) - int(scans[scan]))
        assert distance_of_image[image] <= tolerance
    for image in range(len(images)):
        for scan in range(len(scans)):
            apart = abs(int(images[image]) - int(scans[scan]))
            if apart <= tolerance:
                assert distance_of_image[image] <= apart or distance_of_scan[scan] <= apart


@given(STAMPS, STAMPS, TOLERANCE, st.integers(-(10**15), 10**15))
def test_pairing_depends_on_differences_alone(
    images: np.ndarray, scans: np.ndarray, tolerance: int, shift: int
) -> None:
    np.testing.assert_array_equal(
        nearest_pairs(images, scans, tolerance), nearest_pairs(images + shift, scans + shift, tolerance)
    )


@given(st.integers(1, 40), st.integers(0, 9), st.data())
def test_images_that_jitter_less_than_half_a_period_find_their_own_scans(
    count: int, jitter: int, data: st.DataObject
) -> None:
    scans = np.arange(count, dtype=np.int64) * 20
    moved = data.draw(st.lists(st.integers(-jitter, jitter), min_size=count, max_size=count))
    pairs = nearest_pairs(scans + np.array(moved, dtype=np.int64), scans, 9)
    np.testing.assert_array_equal(pairs, np.stack([np.arange(count)] * 2, axis=1))
