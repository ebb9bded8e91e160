"""Ray casting against pymunk's own segment queries, in random scenes."""

import math

import numpy as np
import pymunk
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.frames import MAX_RANGE_M, RAYS, ray_angles_rad
from sdt_tools.scene.layout import Box
from sdt_tools.scene.raycast import cast_rays, cast_rays_many, pack_scenes

_NEAR_TIE_RAD = 1e-7
"""A ray this close to the end of a segment or the rim of a circle may hit it or miss it: both answers are right."""
_GRAZING = 1e-5
"""Sine of the angle at which a segment is met; below it rounding alone moves the hit by more than 1e-9 m."""


def random_scene(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Up to 60 segments, single and as boxes, up to 8 circles, and a pose that is in none of the circles."""
    rng = np.random.default_rng(seed)
    free = rng.uniform(-12, 12, (rng.integers(0, 20), 4))
    corners = [
        Box(*rng.uniform(-6, 6, 2), *rng.uniform(0.05, 3, 2), rng.uniform(0, 7)).corners()
        for _ in range(rng.integers(0, 11))
    ]
    sides = [np.hstack([box, np.roll(box, -1, axis=0)]) for box in corners]
    circles = np.column_stack([rng.uniform(-6, 6, (8, 2)), rng.uniform(0.02, 1.0, 8)])[: rng.integers(0, 9)]
    while True:
        pose = np.array([*rng.uniform(-8, 8, 2), rng.uniform(-7, 7)])
        if all(math.hypot(*(circle[:2] - pose[:2])) > circle[2] + 1e-6 for circle in circles):
            return np.concatenate([free, *sides]), circles, pose


def cast(pose: np.ndarray, segments: np.ndarray, circles: np.ndarray) -> np.ndarray:
    out = np.empty(RAYS)
    cast_rays(*pose, segments, circles, out)
    return out


def cast_with_pymunk(pose: np.ndarray, segments: np.ndarray, circles: np.ndarray) -> np.ndarray:
    space = pymunk.Space()
    for x0, y0, x1, y1 in segments.tolist():
        space.add(pymunk.Segment(space.static_body, (x0, y0), (x1, y1), 0.0))
    for x, y, radius in circles.tolist():
        space.add(pymunk.Circle(space.static_body, radius, (x, y)))
    x, y, yaw = pose.tolist()
    ranges = np.full(RAYS, MAX_RANGE_M)
    for k, angle in enumerate(yaw + ray_angles_rad()):
        end = (x + MAX_RANGE_M * math.cos(angle), y + MAX_RANGE_M * math.sin(angle))
        hit = space.segment_query_first((x, y), end, 0.0, pymunk.ShapeFilter())
        if hit is not None:
            ranges[k] = hit.alpha * MAX_RANGE_M
    return ranges


def undecided(pose: np.ndarray, segments: np.ndarray, circles: np.ndarray) -> np.ndarray:
    """The rays whose answer rounding may decide: through an end, along a segment, along a rim."""
    angles = pose[2] + ray_angles_rad()
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    bad = np.zeros(RAYS, bool)
    for segment in segments:
        for end in (segment[:2], segment[2:]):
            offset = np.arctan2(*(end - pose[:2])[::-1]) - angles
            bad |= np.abs(np.remainder(offset + np.pi, 2 * np.pi) - np.pi) < _NEAR_TIE_RAD
        along = (segment[2:] - segment[:2]) / np.linalg.norm(segment[2:] - segment[:2])
        bad |= np.abs(directions[:, 0] * along[1] - directions[:, 1] * along[0]) < _GRAZING
    for circle in circles:
        centre = circle[:2] - pose[:2]
        miss = np.abs(directions[:, 0] * centre[1] - directions[:, 1] * centre[0])
        bad |= np.abs(miss - circle[2]) < 1e-4 * circle[2]
    return bad


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32))
def test_equals_pymunks_segment_queries(seed: int) -> None:
    segments, circles, pose = random_scene(seed)

    ours = cast(pose, segments, circles)

    theirs = cast_with_pymunk(pose, segments, circles)
    clear = ~undecided(pose, segments, circles) & (np.abs(theirs - MAX_RANGE_M) > 1e-7)
    nothing = theirs == MAX_RANGE_M
    assert (clear | nothing).mean() > 0.98
    np.testing.assert_allclose(ours[clear], theirs[clear], rtol=0, atol=1e-9)
    decided = nothing & ~undecided(pose, segments, circles)
    np.testing.assert_allclose(ours[decided], MAX_RANGE_M, rtol=0, atol=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.floats(-3.9, 3.9), st.floats(-2.9, 2.9), st.floats(-10, 10))
def test_no_ray_leaves_a_closed_room(x: float, y: float, yaw: float) -> None:
    room = np.array([(-4, -3, 4, -3), (4, -3, 4, 3), (4, 3, -4, 3), (-4, 3, -4, -3)], dtype=float)

    ranges = cast(np.array([x, y, yaw]), room, np.empty((0, 3)))

    c, s = np.cos(yaw + ray_angles_rad()), np.sin(yaw + ray_angles_rad())
    with np.errstate(divide="ignore", over="ignore"):
        across = np.minimum(
            np.where(c > 0, (4 - x) / c, np.where(c < 0, (-4 - x) / c, np.inf)),
            np.where(s > 0, (3 - y) / s, np.where(s < 0, (-3 - y) / s, np.inf)),
        )
    np.testing.assert_allclose(ranges, across, rtol=0, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32))
def test_order_and_direction_of_segments_do_not_matter(seed: int) -> None:
    segments, circles, pose = random_scene(seed)
    rng = np.random.default_rng(seed)
    turned = np.where(rng.random((len(segments), 1)) < 0.5, segments[:, [2, 3, 0, 1]], segments)

    other = cast(pose, rng.permutation(turned), rng.permutation(circles))

    np.testing.assert_array_equal(other, cast(pose, segments, circles))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32))
def test_a_mirrored_scene_gives_the_scan_backwards(seed: int) -> None:
    segments, circles, pose = random_scene(seed)
    bad = undecided(pose, segments, circles)

    mirrored = cast(pose * (1, -1, -1), segments * (1, -1, 1, -1), circles * (1, -1, 1))

    np.testing.assert_allclose(mirrored[::-1][~bad], cast(pose, segments, circles)[~bad], rtol=0, atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 2**32), min_size=1, max_size=6))
def test_a_batch_is_the_scenes_one_by_one(seeds: list[int]) -> None:
    scenes = [random_scene(seed) for seed in seeds]
    packed = pack_scenes([scene[0] for scene in scenes], [scene[1] for scene in scenes])
    out = np.empty((len(scenes), RAYS))

    cast_rays_many(
        np.stack([scene[2] for scene in scenes]),
        packed.segments,
        packed.segment_ends,
        packed.circles,
        packed.circle_ends,
        out,
    )

    for row, (segments, circles, pose) in zip(out, scenes, strict=True):
        np.testing.assert_array_equal(row, cast(pose, segments, circles))
