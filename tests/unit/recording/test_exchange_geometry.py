import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.errors import RecordingError
from sdt_tools.frames import ray_angles_rad
from sdt_tools.recording.exchange.ros2.geometry import choose_rays, our_ranges


def rays(count: int, first_deg: float, step_deg: float, resample: bool = False):
    """As a float32 message says it."""
    return choose_rays(
        count, float(np.float32(np.deg2rad(first_deg))), float(np.float32(np.deg2rad(step_deg))), resample
    )


def test_our_own_geometry_is_taken_as_it_is() -> None:
    choice = rays(541, -135, 0.5)
    assert choice.how == "as they are"
    assert list(choice.rays) == list(range(541))


def test_twice_the_rays_are_thinned() -> None:
    choice = rays(1081, -135, 0.25)
    assert choice.how == "every second ray"
    assert list(choice.rays) == list(range(0, 1081, 2))


def test_a_scanner_that_turns_clockwise_is_reversed() -> None:
    assert list(rays(541, 135, -0.5).rays) == list(range(540, -1, -1))
    assert list(rays(1081, 135, -0.25).rays) == list(range(1080, -1, -2))


@pytest.mark.parametrize(
    ("count", "first_deg", "step_deg", "said"),
    [
        (360, 0, 1, r"360 rays from 0\.00° to 359\.00°, 1\.0000° apart"),
        (541, -130, 0.5, r"541 rays from -130\.00° to 140\.00°, 0\.5000° apart"),
        (1081, -135, 0.5, r"1081 rays from -135\.00° to 405\.00°"),
    ],
)
def test_another_geometry_is_refused_with_the_reason_and_the_way_out(
    count: int, first_deg: float, step_deg: float, said: str
) -> None:
    with pytest.raises(RecordingError, match=said + ".*541 rays at 0.5° or 1081 at 0.25°.*--resample"):
        rays(count, first_deg, step_deg)


@pytest.mark.parametrize("step_rad", [0.0, float("nan"), float("inf")])
def test_what_has_no_geometry_is_refused_even_with_resampling(step_rad: float) -> None:
    with pytest.raises(RecordingError, match="has no geometry"):
        choose_rays(541, -2.0, step_rad, True)
    with pytest.raises(RecordingError, match="has no geometry"):
        choose_rays(1, -2.0, 0.1, True)


@settings(max_examples=40, deadline=None)
@given(
    count=st.integers(2, 3000),
    first_deg=st.floats(-360, 360),
    step_deg=st.floats(0.05, 5),
    clockwise=st.booleans(),
)
def test_resampling_takes_the_nearest_ray_as_brute_force_does(
    count: int, first_deg: float, step_deg: float, clockwise: bool
) -> None:
    step_rad = np.deg2rad(step_deg) * (-1 if clockwise else 1)
    count = min(count, int(2 * np.pi / abs(step_rad)))  # no further than a turn
    if count < 2:
        return
    choice = choose_rays(count, float(np.deg2rad(first_deg)), float(step_rad), True)
    if choice.how != "the nearest ray":
        return
    theirs = np.deg2rad(first_deg) + np.arange(count) * step_rad
    apart = theirs[None, :] - ray_angles_rad()[:, None]
    apart = np.abs((apart + np.pi) % (2 * np.pi) - np.pi)
    nearest, half = apart.min(axis=1), abs(step_rad) / 2
    certain = np.abs(nearest - half) > abs(step_rad) / 100
    assert np.array_equal(choice.in_view[certain], (nearest < half)[certain])
    taken = apart[np.arange(541), choice.rays]
    seen = choice.in_view & (nearest < half)
    assert np.allclose(taken[seen], nearest[seen], atol=1e-9)


def test_rays_beyond_the_view_have_no_distance_and_codes_stay_codes() -> None:
    choice = rays(181, -90, 1.0, resample=True)
    ranges = np.full(181, 2.0, np.float32)
    ours = our_ranges(ranges, choice, 0.1, 30.0)
    assert np.count_nonzero(ours == 2.0) == 361 + 2  # half a step of theirs on either side
    assert set(ours) == {0.0, 2.0}


@pytest.mark.parametrize(
    ("given_m", "expected_m"),
    [
        (np.inf, 0.0),
        (-np.inf, 0.0),
        (np.nan, 0.0),
        (-1.0, 0.0),
        (0.07, 0.0),  # under the scan's own limit of 0.1
        (30.5, 0.0),  # over its limit of 30
        (0.1, 0.1),
        (30.0, 30.0),
        (0.0, 0.0),
        (0.002, 0.002),  # a code of the LMS1xx
        (0.003, 0.003),
        (1.234, 1.234),
        (1.23456, float(np.float32(1.23456))),  # no whole millimetre: float32 as it is
    ],
)
def test_each_range_by_itself(given_m: float, expected_m: float) -> None:
    ours = our_ranges(np.full(541, given_m, np.float32), rays(541, -135, 0.5), 0.1, 30.0)
    assert set(ours) == {expected_m}
