import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.error_analysis.copies import copy_classes
from sdt_tools.error_analysis.neighbours import LEAF_FRAMES, build_index, count_neighbours


def literal_counts(scans: np.ndarray, rows: np.ndarray, epsilon_m: float, groups: np.ndarray) -> np.ndarray:
    exact = scans.astype(np.float64)
    counts = np.zeros((len(groups), len(rows)), np.int64)
    for position, row in enumerate(rows):
        squares = ((exact - exact[row]) ** 2).sum(axis=1)
        near = (squares > 0) & (squares <= epsilon_m * epsilon_m * scans.shape[1])
        counts[:, position] = (groups & near).sum(axis=1)
    return counts


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    frames=st.integers(1, 3 * LEAF_FRAMES),
    rays=st.sampled_from([1, 2, 16, 17, 64, 65, 130]),
    roughness=st.sampled_from([0.0, 0.01, 0.3]),
    copies=st.floats(0.0, 0.5),
)
def test_counts_equal_those_of_brute_force(seed: int, frames: int, rays: int, roughness: float, copies: float) -> None:
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(0, 0.05, (frames, 3)), axis=0) @ rng.normal(size=(3, rays))
    scans = (1.0 + walk + roughness * rng.normal(size=(frames, rays))).clip(0.0, 2.5).astype(np.float32)
    scans[rng.random(frames) < copies] = scans[rng.integers(frames)]
    rows = rng.permutation(frames)[: 1 + frames // 2]
    groups = np.array([np.ones(frames, bool), rng.random(frames) < 0.3])
    apart = np.sqrt(((scans[rows[0]].astype(float) - scans) ** 2).mean(axis=1))
    epsilon_m = float(np.quantile(apart, rng.random())) + 1e-6  # so that there is something to count
    found = count_neighbours(build_index(scans), rows, epsilon_m, groups)
    np.testing.assert_array_equal(found, literal_counts(scans, rows, epsilon_m, groups))


def test_the_bound_itself_belongs_to_the_neighbourhood() -> None:
    scans = np.array([[1.0, 1.0], [1.25, 1.25], [1.5, 1.5]], np.float32)
    counts = count_neighbours(build_index(scans), np.arange(3), 0.25, np.ones((1, 3), bool))
    assert counts.tolist() == [[1, 2, 1]]


def test_neither_the_frame_itself_nor_its_copy_is_a_neighbour() -> None:
    scans = np.ones((5, 7), np.float32)
    counts = count_neighbours(build_index(scans), np.arange(5), 1.0, np.ones((1, 5), bool))
    assert counts.tolist() == [[0] * 5]


def rooms(seed: int, frames: int, rays: int = 130) -> np.ndarray:
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(0, 0.03, (frames, 4)), axis=0) @ rng.normal(size=(4, rays))
    return (1.5 + walk + 0.01 * rng.normal(size=(frames, rays))).clip(0.0, 2.5).astype(np.float32)


def test_counts_are_the_same_for_any_number_of_workers() -> None:
    scans, rows = rooms(0, 2000), np.arange(2000)
    groups = np.random.default_rng(1).random((3, 2000)) < 0.5
    alone, many = (count_neighbours(build_index(scans, n), rows, 0.1, groups, n) for n in (1, 5))
    np.testing.assert_array_equal(alone, many)


def test_an_epsilon_larger_than_everything_takes_in_whole_boxes() -> None:
    scans = rooms(1, 3 * LEAF_FRAMES)
    scans[1::3] = scans[0]  # a third are copies of one frame
    rows = np.array([0, 2, 5])
    counts = count_neighbours(build_index(scans), rows, 10.0, np.ones((1, len(scans)), bool))
    assert counts.tolist() == [[2 * LEAF_FRAMES - 1, len(scans) - 1, len(scans) - 1]]


def test_an_epsilon_smaller_than_everything_leaves_none() -> None:
    scans = rooms(2, 300)
    assert not count_neighbours(build_index(scans), np.arange(300), 1e-9, np.ones((1, 300), bool)).any()


def test_at_every_epsilon_both_bounds_agree_with_brute_force() -> None:
    scans, rows = rooms(3, 6 * LEAF_FRAMES), np.arange(0, 6 * LEAF_FRAMES, 13)
    index, groups = build_index(scans), np.ones((1, 6 * LEAF_FRAMES), bool)
    for epsilon_m in np.geomspace(0.01, 4.0, 12):
        np.testing.assert_array_equal(
            count_neighbours(index, rows, float(epsilon_m), groups),
            literal_counts(scans, rows, float(epsilon_m), groups),
        )


@given(st.lists(st.lists(st.sampled_from([0.0, -0.0, 0.5, 1.0]), min_size=2, max_size=2), min_size=1, max_size=40))
def test_copies_are_the_frames_that_are_equal(frames: list[list[float]]) -> None:
    scans = np.array(frames, np.float32)
    classes = copy_classes(scans)
    equal = (scans[:, None] == scans[None]).all(axis=2)
    np.testing.assert_array_equal(classes[:, None] == classes[None], equal)


def test_frames_whose_keys_round_to_the_same_are_still_told_apart() -> None:
    near = np.float32(0.1)
    scans = np.array([[near], [np.nextafter(near, np.float32(1.0))], *[[2.5]] * 8], np.float32)
    counts = count_neighbours(build_index(scans), np.arange(2), 1e-10, np.ones((1, len(scans)), bool))
    assert counts.tolist() == [[0, 0]]
