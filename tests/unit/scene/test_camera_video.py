"""The video camera: what it makes of time, of turning, of lamps and of the sun."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from camera_layouts import ELSEWHERE, ORIGIN, layout, room

from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.layout import AS_EVER, Layout, Sun, Wall
from sdt_tools.scene.rendering.light import roof_over
from sdt_tools.scene.rendering.projection import Pinhole, view_from
from sdt_tools.scene.rendering.video import VideoCamera, VideoStyle

FACING = Pose2D(1.6, 0.0, math.pi)
STEADY = VideoStyle((1.0, 1.0, 1.0), 1.0, 0.5, 1.0, 0.0, 50.0, 1.0)


def yard(azimuth_deg: float, elevation_deg: float = 30.0) -> Layout:
    sun = Sun(math.radians(azimuth_deg), math.radians(elevation_deg))
    return replace(layout(room(), light="sunlight"), surroundings="outdoor", sun=sun, camera="video")


def inside(seed: int = 1, light: str = "indoor") -> Layout:
    return replace(layout(room(), seed=seed, light=light), surroundings="indoor", camera="video")


def exposures(levels: list[float], step_s: float = 0.1) -> list[float]:
    """What the camera makes of an even grey, picture after picture."""
    scene = SceneCamera(inside())
    camera = VideoCamera(STEADY, Pinhole())
    far = np.full((480, 640), 0.1, np.float32)
    means = []
    for number, level in enumerate(levels):
        radiance = np.full((480, 640, 3), level, np.float32)
        view = view_from(ORIGIN, scene.mount)
        picture = camera.take(radiance, far, scene._light, view, 0.0, number * step_s, number)
        means.append(float(picture.mean()))
    return means


def test_exposure_takes_its_time_and_comes_to_the_same_end() -> None:
    means = exposures([0.1] * 3 + [0.6] * 40 + [0.1] * 40)

    assert means[0] == pytest.approx(means[2], abs=0.5)
    assert means[3] > means[2] + 40
    assert all(later <= earlier + 0.3 for earlier, later in pairwise(means[3:43]))
    assert means[43] < means[0] - 25
    assert means[-1] == pytest.approx(means[0], abs=1.0)


def test_one_that_goes_back_in_time_begins_anew() -> None:
    scene = inside()
    fresh, used = SceneCamera(scene), SceneCamera(scene)
    used.render(Pose2D(0.0, 0.0, 2.0), ELSEWHERE, time_s=9.0)

    assert np.array_equal(used.render(ORIGIN, FACING, time_s=1.0), fresh.render(ORIGIN, FACING, time_s=1.0))


def test_turning_blurs_sideways_alone() -> None:
    camera = SceneCamera(inside())

    def edges(turn_radps: float) -> tuple[float, float]:
        picture = camera.render(ORIGIN, FACING, turn_radps=turn_radps).astype(float)
        return float(np.abs(np.diff(picture, axis=1)).mean()), float(np.abs(np.diff(picture, axis=0)).mean())

    (still_x, still_y), (turned_x, turned_y) = edges(0.0), edges(2.0)

    assert turned_x < 0.85 * still_x
    assert turned_y > 0.85 * still_y
    assert edges(-2.0) == pytest.approx(edges(2.0), rel=0.01)


def test_lamps_that_flicker_make_bands_that_wander() -> None:
    scene = SceneCamera(inside(light="indoor"))
    radiance = np.full((480, 640, 3), 0.3, np.float32)
    far, view = np.full((480, 640), 0.1, np.float32), view_from(ORIGIN, scene.mount)

    def rows(flicker: float, time_s: float) -> np.ndarray:
        camera = VideoCamera(replace(STEADY, flicker=flicker, noise=0.0), Pinhole())
        picture = camera.take(radiance.copy(), far, scene._light, view, 0.0, time_s, 0)
        return picture[:, 310:330].astype(float).mean(axis=(1, 2))

    first, half_a_pulse_later = (rows(0.5, time_s) / rows(0.0, time_s) - 1.0 for time_s in (0.0, 0.005))

    bands = int(np.argmax(np.abs(np.fft.rfft(first))))
    assert bands in (2, 3)  # 100 pulses a second, 25 ms from the first row to the last: two and a half
    assert np.corrcoef(first, half_a_pulse_later)[0, 1] < -0.9
    assert rows(0.0, 0.0).tolist() == rows(0.0, 0.005).tolist()


def test_the_sun_dazzles_where_it_stands_unless_somebody_hides_it() -> None:
    scene = yard(0.0)
    lens, elevation = Pinhole(), math.radians(30.0)
    row = lens.cy - lens.fy * math.tan(elevation - math.radians(17.0))
    camera = SceneCamera(scene)

    seen = camera.render(ORIGIN, ELSEWHERE).astype(int)
    hidden = camera.render(ORIGIN, Pose2D(0.75, 0.0, math.pi)).astype(int)

    at = seen[round(row) - 5 : round(row) + 5, 315:325]
    assert at.min() > 245
    assert seen[round(row), 330:640].mean(axis=1)[::30].tolist() == sorted(
        seen[round(row), 330:640].mean(axis=1)[::30].tolist(), reverse=True
    )
    assert hidden[round(row), 320].mean() < 150


def test_a_shadow_falls_away_from_the_sun_and_is_no_darker_where_limbs_overlap() -> None:
    scene, away = replace(yard(90.0), walls=room(9.0)), Pose2D(5.0, 0.0, math.pi)
    camera, plain = SceneCamera(scene), SceneCamera(replace(scene, camera="plain"))
    camera._draw(ORIGIN, away, 0.0, 0.0, Gesture.IDLE, 1.0, 0.0, AS_EVER)
    shaded = camera._radiance.copy()
    plain._draw(ORIGIN, away, 0.0, 0.0, Gesture.IDLE, 1.0, 0.0, AS_EVER)
    ratio = shaded.mean(axis=2) / np.maximum(plain._radiance.mean(axis=2), 1e-6)

    light = camera._light
    kept = light.kind.ambient / (light.kind.ambient + light.power * math.sin(math.radians(30.0)))
    dark = ratio < 0.95
    columns = np.flatnonzero(dark.any(axis=0))
    assert dark.sum() > 400
    assert columns.mean() > 330  # the sun is on the left, the shadow on the right
    assert ratio[dark].min() == pytest.approx(kept, rel=1e-3)


def test_a_garage_is_dark_inside_and_opens_where_no_wall_stands() -> None:
    walls = (Wall(0.0, -1.5, -4.0, -1.5), Wall(-4.0, -1.5, -4.0, 1.5), Wall(-4.0, 1.5, 0.0, 1.5))

    roof = roof_over(walls)

    assert roof.rectangle_m == (-4.0, -1.5, 0.0, 1.5)
    assert roof.open_sides == (False, False, True, False)
    deep, door, out = roof.daylight(np.array([[-3.5, 0.0, 0.0], [-0.2, 0.0, 0.0], [0.5, 0.0, 0.0]])).tolist()
    assert deep < 0.15
    assert deep < door < 1.0
    assert out == 1.0
    assert not roof.covers(0.5, 0.0)


def test_from_the_garage_the_yard_is_brighter_than_the_walls() -> None:
    walls = (Wall(1.0, -1.5, -4.0, -1.5), Wall(-4.0, -1.5, -4.0, 1.5), Wall(-4.0, 1.5, 1.0, 1.5))
    scene = replace(yard(180.0), walls=walls, surroundings="garage")

    picture = SceneCamera(scene).render(Pose2D(-2.0, 0.0, 0.0), Pose2D(3.0, 0.0, math.pi)).astype(int)

    assert picture[200:240, 300:340].mean() > 2 * picture[200:400, :40].mean()
