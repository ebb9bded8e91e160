"""Room around the footprint, against pymunk's shape queries; lines of sight against its ray queries."""

import math

import numpy as np
import pymunk
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.frames import ROBOT_LENGTH_M, ROBOT_WIDTH_M, Pose2D
from sdt_tools.scene.footprint import FAR_M, clearance_m, distance_to_footprint_m
from sdt_tools.scene.sight import any_visible

NO_SEGMENTS, NO_CIRCLES = np.empty((0, 4)), np.empty((0, 3))


def footprint(x: float, y: float, yaw: float) -> pymunk.Poly:
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    body.position, body.angle = (x, y), yaw
    shape = pymunk.Poly.create_box(body, (ROBOT_LENGTH_M, ROBOT_WIDTH_M))
    shape.cache_bb()
    return shape


poses = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-7, 7))
points = st.tuples(st.floats(-2, 2), st.floats(-2, 2))


@settings(max_examples=100, deadline=None)
@given(poses, points)
def test_distance_of_a_point_is_pymunks(pose: tuple[float, float, float], point: tuple[float, float]) -> None:
    expected = max(0.0, footprint(*pose).point_query(point).distance)

    assert abs(distance_to_footprint_m(Pose2D(*pose), *point) - expected) < 1e-9
    circle = np.array([[*point, 0.05]])
    assert abs(clearance_m(*pose, NO_SEGMENTS, circle) - (expected - 0.05)) < 1e-9


@settings(max_examples=40, deadline=None)
@given(poses, points, points)
def test_distance_of_a_segment_is_the_nearest_of_its_points(
    pose: tuple[float, float, float], start: tuple[float, float], end: tuple[float, float]
) -> None:
    shares = np.linspace(0.0, 1.0, 201)[:, None]
    ways = np.array(start) + shares * (np.array(end) - np.array(start))
    sampled = min(distance_to_footprint_m(Pose2D(*pose), x, y) for x, y in ways.tolist())

    exact = clearance_m(*pose, np.array([[*start, *end]]), NO_CIRCLES)

    spacing = math.dist(start, end) / 200
    assert exact <= sampled + 1e-9
    assert exact >= sampled - spacing


def test_nothing_near_is_far() -> None:
    assert clearance_m(0.0, 0.0, 0.0, NO_SEGMENTS, NO_CIRCLES) == FAR_M


def test_a_segment_through_the_footprint_leaves_no_room() -> None:
    assert clearance_m(0.0, 0.0, 0.4, np.array([[-5.0, 0.1, 5.0, 0.1]]), NO_CIRCLES) == 0.0


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**32))
def test_sight_is_pymunks_ray_query(seed: int) -> None:
    rng = np.random.default_rng(seed)
    segments = rng.uniform(-4, 4, (6, 4))
    circles = np.column_stack([rng.uniform(-4, 4, (3, 2)), rng.uniform(0.05, 0.5, 3)])
    space = pymunk.Space()
    for x0, y0, x1, y1 in segments.tolist():
        space.add(pymunk.Segment(space.static_body, (x0, y0), (x1, y1), 0.0))
    for x, y, radius in circles.tolist():
        space.add(pymunk.Circle(space.static_body, radius, (x, y)))
    eye, *targets = rng.uniform(-4, 4, (4, 2)).tolist()

    seen = any_visible(*eye, np.array([[*target, 0.06] for target in targets]), segments, circles)

    everything = pymunk.ShapeFilter()
    hits = [space.segment_query_first(tuple(eye), tuple(target), 0.0, everything) for target in targets]
    assert seen == any(hit is None for hit in hits)
