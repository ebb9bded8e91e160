"""How many pictures a second one thread renders: 640 x 480, with and without JPEG. The aim is 60, then 100."""

import itertools
import math

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.recording.live.encoder import encode_jpeg
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.scenario import layout_for


def _moving_states() -> "itertools.cycle[tuple[Pose2D, Pose2D, float, float, Gesture, float, float, int]]":
    """An operator who walks ahead of a turning robot, gesturing in turn."""
    gestures = list(Gesture)
    return itertools.cycle(
        (
            Pose2D(0.02 * i, 0.0, 0.1 * math.sin(0.2 * i)),
            Pose2D(1.4 + 0.02 * i, 0.1, math.pi + 0.05 * i),
            0.3 * i,
            (i % 10) / 10,
            gestures[i % 3],
            1.0,
            i / 30,
            i,
        )
        for i in range(60)
    )


def test_render(benchmark: BenchmarkFixture) -> None:
    camera, states = SceneCamera(layout_for("around_boxes", 7)), _moving_states()
    camera.render(*next(states))

    benchmark(lambda: camera.render(*next(states)))

    if benchmark.stats is not None:
        benchmark.extra_info["frames_per_s"] = 1 / benchmark.stats.stats.median
        benchmark.extra_info["best_frames_per_s"] = 1 / benchmark.stats.stats.min


def test_render_and_encode(benchmark: BenchmarkFixture) -> None:
    camera, states = SceneCamera(layout_for("around_boxes", 7)), _moving_states()
    camera.render(*next(states))

    data = benchmark(lambda: encode_jpeg(camera.render(*next(states))))

    if benchmark.stats is not None:
        benchmark.extra_info["frames_per_s"] = 1 / benchmark.stats.stats.median
        benchmark.extra_info["jpeg_bytes"] = len(data)


@pytest.mark.parametrize("name", ["artificial_light_follow", "direct_sunlight"])
def test_render_video(benchmark: BenchmarkFixture, name: str) -> None:
    """Flicker, or glare and shadows; exposure and the blur of turning in both."""
    layout = layout_for(name, 7)
    camera, robot = SceneCamera(layout), layout.robot
    x_m, y_m = layout.operator.path_m[0]
    frames = itertools.count()

    def one() -> None:
        frame = next(frames)
        seen_from = Pose2D(robot.x_m, robot.y_m, robot.yaw_rad + 0.1 * math.sin(0.2 * frame))
        operator = Pose2D(x_m, y_m, robot.yaw_rad + math.pi)
        gesture, turn_radps = list(Gesture)[frame % 3], 0.8 * math.cos(0.2 * frame)
        camera.render(seen_from, operator, 0.3 * frame, 0.5, gesture, 1.0, frame / 30, frame, turn_radps=turn_radps)

    one()
    benchmark(one)

    if benchmark.stats is not None:
        benchmark.extra_info["frames_per_s"] = 1 / benchmark.stats.stats.median
        benchmark.extra_info["best_frames_per_s"] = 1 / benchmark.stats.stats.min


def test_a_new_scene(benchmark: BenchmarkFixture) -> None:
    layout = layout_for("plain", 3)

    benchmark.pedantic(lambda: SceneCamera(layout), rounds=5, iterations=1)
