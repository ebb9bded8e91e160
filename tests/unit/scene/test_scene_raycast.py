"""Ray casting where the answer is known in closed form."""

import numpy as np

from sdt_tools.frames import MAX_RANGE_M, RAYS, ray_angles_rad
from sdt_tools.scene.raycast import cast_rays

NO_SEGMENTS, NO_CIRCLES = np.empty((0, 4)), np.empty((0, 3))


def cast(segments: np.ndarray, circles: np.ndarray, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    out = np.empty(RAYS)
    cast_rays(x, y, yaw, segments, circles, out)
    return out


def test_nothing_is_seen_as_twenty_metres() -> None:
    assert (cast(NO_SEGMENTS, NO_CIRCLES) == MAX_RANGE_M).all()


def test_a_wall_ahead_is_seen_on_a_secant() -> None:
    ranges = cast(np.array([[2.0, -50.0, 2.0, 50.0]]), NO_CIRCLES)

    ahead = np.abs(ray_angles_rad()) < np.deg2rad(80)
    np.testing.assert_allclose(ranges[ahead], 2.0 / np.cos(ray_angles_rad()[ahead]), atol=1e-9)


def test_ray_zero_looks_to_the_right_and_back() -> None:
    ranges = cast(np.array([[-5.0, -1.0, 5.0, -1.0]]), NO_CIRCLES)

    assert ranges[0] == np.float64(ranges.max()) or abs(ranges[0] - np.sqrt(2)) < 1e-9
    assert abs(ranges[90] - 1.0) < 1e-9  # -90°, straight to the right
    assert ranges[450] == MAX_RANGE_M


def test_a_wall_across_the_direction_straight_back_is_seen_at_both_ends_of_the_scan() -> None:
    ranges = cast(np.array([[-1.0, 30.0, -1.0, -30.0]]), NO_CIRCLES)

    np.testing.assert_allclose(ranges[[0, RAYS - 1]], np.sqrt(2.0), atol=1e-9)
    assert ranges[RAYS // 2] == MAX_RANGE_M


def test_a_circle_ahead() -> None:
    ranges = cast(NO_SEGMENTS, np.array([[3.0, 0.0, 0.5]]))

    angles = ray_angles_rad()
    hit = np.abs(angles) < np.arcsin(0.5 / 3.0)
    expected = 3.0 * np.cos(angles) - np.sqrt(np.maximum(0.25 - (3.0 * np.sin(angles)) ** 2, 0.0))
    np.testing.assert_allclose(ranges[hit], expected[hit], atol=1e-9)
    assert (ranges[~hit] == MAX_RANGE_M).all()


def test_a_wide_circle_behind_is_seen_at_both_ends_of_the_scan() -> None:
    for y in (0.02, -0.02):
        ranges = cast(NO_SEGMENTS, np.array([[-1.0, y, 0.95]]))

        angles = ray_angles_rad()[[0, RAYS - 1]]
        along, across = -np.cos(angles) + y * np.sin(angles), -np.sin(angles) - y * np.cos(angles)
        np.testing.assert_allclose(ranges[[0, RAYS - 1]], along - np.sqrt(0.95**2 - across**2), atol=1e-9)
        assert ranges[RAYS // 2] == MAX_RANGE_M


def test_from_within_a_circle_every_ray_measures_nothing() -> None:
    assert (cast(NO_SEGMENTS, np.array([[0.1, 0.0, 0.5]])) == 0.0).all()


def test_what_is_beyond_twenty_metres_is_not_seen() -> None:
    far = cast(np.array([[20.5, -1.0, 20.5, 1.0]]), np.array([[0.0, 21.0, 0.9]]))

    assert (far == MAX_RANGE_M).all()


def test_a_segment_seen_from_its_end_hides_nothing() -> None:
    edge_on = cast(np.array([[1.0, 0.0, 2.0, 0.0], [3.0, -1.0, 3.0, 1.0]]), NO_CIRCLES)

    assert abs(edge_on[RAYS // 2] - 3.0) < 1e-9


def test_the_nearer_of_two_things_is_seen() -> None:
    ranges = cast(np.array([[2.0, -1.0, 2.0, 1.0], [1.0, -1.0, 1.0, 1.0]]), np.array([[4.0, 0.0, 1.0]]))

    assert abs(ranges[RAYS // 2] - 1.0) < 1e-9
