"""Levels against the paper's Table II, membership and distance against brute force over all 240 boxes."""

import itertools

import numpy as np
import pytest

from sdt_tools.frames import MotionClass
from sdt_tools.robustness.boxes import DomainSet, distance_to_boxes_rms_m, in_any_box
from sdt_tools.robustness.domains import SafetyLevel, conflicts, distance_rms_m, domains, membership

LEVELS = [SafetyLevel.ONE, SafetyLevel.TWO, SafetyLevel.THREE, SafetyLevel.FOUR]


def brute_distance_rms_m(ranges_m: np.ndarray, boxes: DomainSet) -> np.ndarray:
    """Project each scan onto each box, and take the nearest projection."""
    projected = np.clip(ranges_m[:, None], boxes.lower_m, boxes.upper_m)
    return np.sqrt(((ranges_m[:, None] - projected) ** 2).mean(axis=2)).min(axis=1)


def scans_around_the_domains(seed: int, count: int = 60) -> np.ndarray:
    """Scans of many kinds: far, near, in domains, and just outside of them by one ray or a millimetre."""
    rng = np.random.default_rng(seed)
    scans = rng.uniform(0.0, rng.choice([2.9, 4.0, 20.0], (count, 1)), (count, 541))
    for scan in scans[: count * 2 // 3]:
        ray, width = rng.integers(140, 400), rng.integers(1, 6)
        scan[ray : ray + width] = rng.choice([0.0, 0.1, 0.2, 0.201])
    return scans.round(3)


def test_there_are_240_domains_a_level_and_none_at_level_0() -> None:
    assert [len(domains(level)) for level in SafetyLevel] == [0, 240, 240, 240, 240]
    assert domains(SafetyLevel.THREE).rays.tolist() == list(range(150, 390))


@pytest.mark.parametrize(
    ("level", "near", "far_m"),
    [
        (SafetyLevel.ONE, [199, 200, 201], 3.0),
        (SafetyLevel.TWO, [200], 3.0),
        (SafetyLevel.THREE, [200], 4.0),
        (SafetyLevel.FOUR, [200], 20.0),
    ],
)
def test_bounds_are_those_of_the_paper_s_table(level: SafetyLevel, near: list[int], far_m: float) -> None:
    of_level = domains(level)
    (place,) = np.flatnonzero(of_level.rays == 200)
    expected = np.full(541, far_m)
    expected[near] = 0.2
    np.testing.assert_array_equal(of_level.upper_m[place], expected)
    assert not of_level.lower_m.any()


def test_every_class_that_does_not_drive_forward_is_allowed() -> None:
    allowed = {MotionClass.STAY, MotionClass.BACKWARD, MotionClass.LEFT_BACKWARD, MotionClass.RIGHT_BACKWARD}
    assert domains(SafetyLevel.TWO).allowed == allowed


@pytest.mark.parametrize(("inner", "outer"), list(itertools.pairwise(LEVELS)))
def test_each_domain_is_a_proper_subset_of_its_like_at_the_next_level(inner: SafetyLevel, outer: SafetyLevel) -> None:
    assert (domains(inner).lower_m >= domains(outer).lower_m).all()
    assert (domains(inner).upper_m <= domains(outer).upper_m).all()
    assert (domains(inner).upper_m < domains(outer).upper_m).any(axis=1).all()


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_membership_is_that_of_some_box(level: SafetyLevel, precision: type[np.floating]) -> None:
    scans = scans_around_the_domains(0).astype(precision)
    lower, upper = (bounds.astype(precision) for bounds in (domains(level).lower_m, domains(level).upper_m))
    brute = ((scans[:, None] >= lower) & (scans[:, None] <= upper)).all(axis=2).any(axis=1)
    assert 0 < brute.sum() < len(scans)
    np.testing.assert_array_equal(membership(scans, level), brute)


@pytest.mark.parametrize("level", LEVELS)
def test_distance_is_that_of_the_nearest_projection(level: SafetyLevel) -> None:
    scans = scans_around_the_domains(1)
    np.testing.assert_allclose(
        distance_rms_m(scans, level), brute_distance_rms_m(scans, domains(level)), rtol=1e-9, atol=1e-12
    )


def test_the_nearest_point_of_a_domain_lies_in_it() -> None:
    scan = np.full((1, 541), 2.0)
    assert distance_rms_m(scan, SafetyLevel.THREE)[0] == pytest.approx(1.8 / np.sqrt(541))
    scan[0, 270] = 0.2
    assert membership(scan, SafetyLevel.THREE).tolist() == [True]
    assert distance_rms_m(scan, SafetyLevel.THREE).tolist() == [0.0]


def test_three_near_rays_are_needed_at_level_1() -> None:
    scan = np.full((1, 541), 2.0)
    scan[0, 269:271] = 0.1
    assert not membership(scan, SafetyLevel.ONE)[0]
    assert membership(scan, SafetyLevel.TWO)[0]


def test_one_far_ray_leaves_all_levels_but_the_fourth() -> None:
    scan = np.full((1, 541), 2.0)
    scan[0, 260:280] = 0.1
    scan[0, 0] = 4.001
    assert [bool(membership(scan, level)[0]) for level in SafetyLevel] == [False, False, False, False, True]


def test_bounds_mean_the_same_in_both_precisions() -> None:
    scan = np.full((1, 541), 4.0)
    scan[0, 300] = 0.2
    assert membership(scan, SafetyLevel.THREE)[0]
    assert membership(scan.astype(np.float32), SafetyLevel.THREE)[0]


def test_level_0_has_no_members_and_is_infinitely_far() -> None:
    scans = np.zeros((2, 541))
    assert membership(scans, SafetyLevel.NONE).tolist() == [False, False]
    assert distance_rms_m(scans, SafetyLevel.NONE).tolist() == [np.inf, np.inf]


def test_only_forward_labels_conflict_and_only_inside() -> None:
    near, clear = np.full(541, 2.0), np.full(541, 2.0)
    near[270] = 0.1
    scans = np.stack([near] * 7 + [clear] * 7)
    labels = np.array(list(MotionClass) * 2, dtype=np.int64)
    expected = [motion.is_forward for motion in MotionClass] + [False] * 7
    assert conflicts(scans, labels, SafetyLevel.TWO).tolist() == expected


def test_domains_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        domains(SafetyLevel.ONE).upper_m[0, 0] = 5.0


def test_a_scan_outside_by_less_than_rounding_is_no_member() -> None:
    """The first box is wide on ray 0, where the scan is 10 m outside the common one, and missed on ray 1 by 1e-12 m."""
    upper = np.full((3, 541), 1.0)
    upper[0, 0] = 20.0
    boxes = DomainSet("own", np.zeros_like(upper), upper, np.arange(3), domains(SafetyLevel.ONE).allowed)
    scan = np.full((1, 541), 0.5)
    scan[0, :2] = 11.0, 1.0 + 1e-12
    assert not in_any_box(scan, boxes)[0]
    assert distance_to_boxes_rms_m(scan, boxes)[0] == pytest.approx(0.0, abs=1e-6)
