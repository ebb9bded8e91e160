"""What a picture is: the same for the same state, neither dark nor glaring, with gestures that one can tell apart."""

import io
import math

import numpy as np
import pytest
from camera_layouts import ELSEWHERE, ORIGIN, camera_of, layout, room
from PIL import Image

from sdt_tools.errors import ConfigError
from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.recording.live.encoder import encode_jpeg
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.layout import Box, Post, Wall
from sdt_tools.scene.rendering.light import KINDS

FACING = Pose2D(1.6, 0.1, math.pi)


def silhouette(camera: SceneCamera, place: Pose2D, gesture: Gesture, share: float = 1.0) -> np.ndarray:
    return camera.depth(ORIGIN, place, 0.0, 0.0, gesture, share) < camera.depth(ORIGIN, ELSEWHERE) - 0.1


def test_the_same_state_gives_the_same_bytes() -> None:
    scene = layout(room(), (Box(2.0, 1.0, 0.5, 0.5, 0.2),), (Post(2.0, -1.0, 0.05),), seed=9)
    state = (Pose2D(0.1, 0.2, 0.1), FACING, 1.0, 0.7, Gesture.ENABLE, 0.8, 2.5, 17)
    first, second = SceneCamera(scene), SceneCamera(scene)
    second.render(ORIGIN, ELSEWHERE, 2.0, 1.0, Gesture.DISABLE, 1.0, 9.0, 3)

    assert encode_jpeg(first.render(*state)) == encode_jpeg(second.render(*state))


def test_frames_differ_by_their_noise_alone() -> None:
    camera = camera_of(layout(room()))

    first = camera.render(ORIGIN, FACING, frame=1).astype(int)
    second = camera.render(ORIGIN, FACING, frame=2).astype(int)

    # In linear parts of the curve the difference of two frames has √2 times the noise of one.
    difference = (first - second)[100:200, 200:400]
    assert 1.0 < difference.std() < 8.0
    assert abs(difference.mean()) < 0.1


def test_seeds_give_other_people_and_rooms() -> None:
    pictures = [camera_of(layout(room(), seed=seed)).render(ORIGIN, FACING).astype(int) for seed in range(4)]

    for one in range(4):
        for other in range(one):
            assert np.abs(pictures[one] - pictures[other]).mean() > 10


@pytest.mark.parametrize("seed", range(6))
def test_gestures_have_their_shapes(seed: int) -> None:
    camera = camera_of(layout(room(), seed=seed))
    idle, enable, disable = (silhouette(camera, Pose2D(2.0, 0.0, math.pi), gesture) for gesture in Gesture)

    def top(shape: np.ndarray) -> int:
        return int(np.flatnonzero(shape.any(axis=1)).min())

    def width(shape: np.ndarray) -> int:
        return int(np.ptp(np.flatnonzero(shape.any(axis=0))))

    head_px = 0.13 * 1.7 * camera.calibration.fy / 2.1
    assert top(enable) < top(idle) - 0.4 * head_px, "a hand above the head"
    assert top(disable) == pytest.approx(top(idle), abs=3), "no hand above the head"
    assert width(disable) > 2.2 * width(idle), "arms spread"
    assert width(enable) < 0.75 * width(disable), "one arm only"
    middle = camera.calibration.cx
    spread = np.flatnonzero(disable.any(axis=0))
    assert (middle - spread.min()) == pytest.approx(spread.max() - middle, rel=0.15), "both to their sides"


@pytest.mark.parametrize("seed", range(8))
def test_a_raised_hand_stays_in_the_picture_at_one_metre(seed: int) -> None:
    camera = camera_of(layout(room(), seed=seed))
    one_metre_from_the_lidar = Pose2D(1.197, 0.0, math.pi)

    shape = silhouette(camera, one_metre_from_the_lidar, Gesture.ENABLE)

    assert not shape[:3].any()


def test_arms_move_steadily_into_a_gesture() -> None:
    camera = camera_of(layout(room()))

    heights = [
        np.flatnonzero(silhouette(camera, FACING, Gesture.DISABLE, share).any(axis=0)) for share in (0.0, 0.3, 0.6, 1.0)
    ]

    widths = [np.ptp(columns) for columns in heights]
    assert widths == sorted(widths)
    assert np.array_equal(silhouette(camera, FACING, Gesture.ENABLE, 0.0), silhouette(camera, FACING, Gesture.IDLE))


def test_an_operator_behind_a_wall_is_hidden() -> None:
    camera = camera_of(layout((*room(5.0), Wall(2.0, -2.5, 2.0, 2.5))))

    hidden = camera.render(ORIGIN, Pose2D(3.0, 0.0, math.pi), gesture=Gesture.DISABLE)

    assert np.array_equal(hidden, camera.render(ORIGIN, ELSEWHERE))


def test_an_operator_behind_a_box_shows_his_arms_but_not_his_knees() -> None:
    place = Pose2D(4.0, 0.0, math.pi)
    free, behind = (
        silhouette(camera_of(layout(room(6.0), boxes)), place, Gesture.DISABLE)
        for boxes in ((), (Box(3.0, 0.0, 0.5, 1.5, 0.0, height_m=0.6),))
    )

    rows = np.flatnonzero(free.any(axis=1))
    waist = int(rows.mean())
    assert np.array_equal(free[:waist], behind[:waist])
    assert not behind[rows.max() - 10 :].any()


@pytest.mark.parametrize("light", KINDS)
@pytest.mark.parametrize("seed", [5, 6])
def test_pictures_are_neither_black_nor_blown_out(light: str, seed: int) -> None:
    picture = camera_of(layout(room(), seed=seed, light=light)).render(ORIGIN, FACING)

    assert 60 < picture.mean() < 190
    assert (picture.max(axis=2) < 12).mean() < 0.05
    assert (picture.min(axis=2) > 250).mean() < 0.12
    assert picture.std() > 20


def test_the_light_can_be_asked_for() -> None:
    scene = layout(room())

    assert not np.array_equal(
        SceneCamera(scene, light="artificial").render(ORIGIN, FACING), SceneCamera(scene).render(ORIGIN, FACING)
    )


def test_an_unknown_light_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match="unknown light 'moon'; known are indoor"):
        camera_of(layout(room(), light="moon"))


def test_a_world_without_walls_is_closed_beyond_the_lidars_range() -> None:
    camera = camera_of(layout())

    depth_m = camera.depth(ORIGIN, ELSEWHERE)

    assert np.isfinite(depth_m).all()
    horizon = round(camera.calibration.cy + camera.calibration.fy * math.tan(camera.mount.pitch_rad))
    assert depth_m[horizon].min() > 20.0


def test_a_jpeg_is_the_picture_for_another_decoder() -> None:
    picture = camera_of(layout(room())).render(ORIGIN, FACING)

    data = encode_jpeg(picture)

    read = np.asarray(Image.open(io.BytesIO(data)))[..., ::-1].astype(float)
    assert read.shape == (480, 640, 3)
    assert np.sqrt(((read - picture) ** 2).mean()) < 8
    assert len(encode_jpeg(picture, quality=40)) < len(data) < 120_000
