"""Codes and safety domains over anything that arrays can hold."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sdt_tools.frames import MotionClass
from sdt_tools.models.preprocess import PreprocessConfig, invalid_rays, resolve_codes
from sdt_tools.robustness.boxes import DomainSet, distance_to_boxes_rms_m, in_any_box

READINGS = st.one_of(
    st.sampled_from([0.0, 0.002, 0.003, 0.005, 20.0, float("nan"), float("inf"), -0.5]),
    st.floats(0.0, 40.0, allow_nan=False),
)
SCANS = arrays(np.float64, st.tuples(st.integers(0, 4), st.integers(1, 30)), elements=READINGS)
POLICIES = st.sampled_from(["interpolate", "max_range", "near"])


@given(SCANS, POLICIES)
@settings(deadline=None)
def test_resolved_scans_lie_in_the_sensor_s_range_and_keep_what_was_measured(scans: np.ndarray, policy: str) -> None:
    config = PreprocessConfig(code_policy=policy)
    resolved = resolve_codes(scans, config)
    valid = ~invalid_rays(scans, config)
    assert ((resolved >= 0.0) & (resolved <= 20.0)).all()
    np.testing.assert_array_equal(resolved[valid], np.minimum(scans[valid], 20.0))


@given(SCANS)
@settings(deadline=None)
def test_interpolation_is_that_of_numpy(scans: np.ndarray) -> None:
    config = PreprocessConfig()
    valid = ~invalid_rays(scans, config)
    rays = np.arange(scans.shape[1])
    expected = [
        np.interp(rays, rays[ok], np.minimum(scan[ok], 20.0)) if ok.any() else np.zeros(len(rays))
        for scan, ok in zip(scans, valid, strict=True)
    ]
    np.testing.assert_allclose(resolve_codes(scans, config), np.array(expected).reshape(scans.shape), atol=1e-9)


def _boxes_and_scans(rays: int) -> st.SearchStrategy[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Corners on a coarse grid, so that boxes share many bounds and scans often lie on one."""
    grid = st.integers(0, 5).map(lambda value: value / 2)
    corners = arrays(np.float64, st.tuples(st.integers(1, 5), st.just(rays)), elements=grid)
    scans = arrays(np.float64, (6, rays), elements=grid)
    return corners.flatmap(lambda one: st.tuples(st.just(one), arrays(np.float64, one.shape, elements=grid), scans))


@given(_boxes_and_scans(6))
@settings(deadline=None)
def test_any_boxes_are_measured_as_by_projection_onto_each(drawn: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    one, other, scans = drawn
    lower, upper = np.minimum(one, other), np.maximum(one, other)
    boxes = DomainSet("drawn", lower, upper, np.arange(len(lower)), frozenset({MotionClass.STAY}))
    squares = ((scans[:, None] - np.clip(scans[:, None], lower, upper)) ** 2).mean(axis=2).min(axis=1)
    np.testing.assert_allclose(distance_to_boxes_rms_m(scans, boxes), np.sqrt(squares), atol=1e-6)
    np.testing.assert_array_equal(in_any_box(scans, boxes), squares == 0.0)
