"""One scan of 60 segments and 2 circles: ours beside pymunk's own segment queries, in the same run."""

import math
import time

import numpy as np
import pymunk
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.frames import MAX_RANGE_M, RAYS, ray_angles_rad
from sdt_tools.scene.layout import Box
from sdt_tools.scene.raycast import cast_rays, cast_rays_many, pack_scenes

POSE = (0.0, 0.0, 0.3)
CIRCLES = np.array([[1.0, 0.1, 0.06], [1.0, -0.1, 0.06]])


def sixty_segments() -> np.ndarray:
    rng = np.random.default_rng(0)
    boxes = [Box(0.0, 0.0, 12.0, 12.0, 0.0)]
    boxes += [Box(*rng.uniform(-5, 5, 2), *rng.uniform(0.3, 1.0, 2), rng.uniform(0, 3)) for _ in range(14)]
    corners = [box.corners() for box in boxes]
    return np.concatenate([np.hstack([corner, np.roll(corner, -1, axis=0)]) for corner in corners])


def pymunk_space(segments: np.ndarray) -> pymunk.Space:
    space = pymunk.Space()
    for x0, y0, x1, y1 in segments.tolist():
        space.add(pymunk.Segment(space.static_body, (x0, y0), (x1, y1), 0.0))
    for x, y, radius in CIRCLES.tolist():
        space.add(pymunk.Circle(space.static_body, radius, (x, y)))
    return space


def query_all(space: pymunk.Space, everything: pymunk.ShapeFilter) -> np.ndarray:
    x, y, yaw = POSE
    ranges = np.full(RAYS, MAX_RANGE_M)
    for k, angle in enumerate((yaw + ray_angles_rad()).tolist()):
        end = (x + MAX_RANGE_M * math.cos(angle), y + MAX_RANGE_M * math.sin(angle))
        hit = space.segment_query_first((x, y), end, 0.0, everything)
        if hit is not None:
            ranges[k] = hit.alpha * MAX_RANGE_M
    return ranges


def test_scan_beside_pymunk(benchmark: BenchmarkFixture) -> None:
    segments, out = sixty_segments(), np.empty(RAYS)
    space, everything = pymunk_space(segments), pymunk.ShapeFilter()
    cast_rays(*POSE, segments, CIRCLES, out)
    np.testing.assert_allclose(out, query_all(space, everything), rtol=0, atol=1e-9)

    def peer_s() -> float:
        start = time.perf_counter()
        query_all(space, everything)
        return time.perf_counter() - start

    peer = min(peer_s() for _ in range(15))
    benchmark.pedantic(cast_rays, (*POSE, segments, CIRCLES, out), rounds=300, iterations=50, warmup_rounds=10)
    if benchmark.stats is not None:
        benchmark.extra_info["pymunk_us"] = peer * 1e6
        benchmark.extra_info["times_faster_than_pymunk"] = peer / benchmark.stats.stats.min
        benchmark.extra_info["us_per_scan"] = benchmark.stats.stats.min * 1e6


@pytest.mark.parametrize("scenes", [64])
def test_batch_of_scenes(benchmark: BenchmarkFixture, scenes: int) -> None:
    packed = pack_scenes([sixty_segments()] * scenes, [CIRCLES] * scenes)
    poses, out = np.tile(POSE, (scenes, 1)), np.empty((scenes, RAYS))
    arguments = (poses, packed.segments, packed.segment_ends, packed.circles, packed.circle_ends, out)
    cast_rays_many(*arguments)

    benchmark.pedantic(cast_rays_many, arguments, rounds=100, iterations=5, warmup_rounds=5)

    if benchmark.stats is not None:
        benchmark.extra_info["us_per_scan"] = benchmark.stats.stats.min / scenes * 1e6
