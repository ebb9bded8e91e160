"""The camera and the LiDAR see the same world: edges, depths and legs, found by other means than the renderer's."""

import math

import numpy as np
import pytest
from camera_layouts import ELSEWHERE, ORIGIN, camera_of, layout, pixels, room

from sdt_tools.frames import Pose2D
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.layout import Box, Layout, Post, Wall, lidar_pose
from sdt_tools.scene.raycast import cast_rays


def strongest_edge(picture: np.ndarray, foot: np.ndarray, head: np.ndarray, reach: int = 7) -> float:
    """How far to the right of the line from ``foot`` to ``head`` (pixels) the strongest upright edge lies."""
    rows = np.arange(math.ceil(min(foot[1], head[1])) + 3, math.floor(max(foot[1], head[1])) - 3)
    rows = rows[(rows >= 0) & (rows < picture.shape[0])]
    expected = foot[0] + (rows - foot[1]) / (head[1] - foot[1]) * (head[0] - foot[0])
    offsets = np.arange(-reach, reach + 1)
    columns = np.arange(picture.shape[1])
    change = np.zeros(2 * reach)
    for channel in picture.astype(float).transpose(2, 0, 1):
        beside = [np.interp(at + offsets, columns, channel[row]) for row, at in zip(rows, expected, strict=True)]
        change += np.abs(np.diff(np.mean(beside, axis=0)))
    return float(offsets[int(change.argmax())] + 0.5)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("robot", [ORIGIN, Pose2D(-0.7, 0.4, 0.2)])
def test_the_edges_of_a_box_are_where_a_pinhole_puts_them(seed: int, robot: Pose2D) -> None:
    box = Box(3.6, 0.5, 0.8, 0.6, 0.4, height_m=1.1)
    camera = camera_of(layout(room(6.0), (box,), seed=seed))
    picture = camera.render(robot, ELSEWHERE)
    corners = box.corners()
    bearings = np.arctan2(corners[:, 1] - robot.y_m, corners[:, 0] - robot.x_m)

    for corner in (corners[bearings.argmin()], corners[bearings.argmax()]):
        foot, head = pixels(camera, robot, np.array([(*corner, 0.0), (*corner, box.height_m)]))

        assert abs(strongest_edge(picture, foot, head)) <= 2.0


def test_the_end_of_a_wall_is_where_a_pinhole_puts_it() -> None:
    camera = camera_of(layout((*room(7.0), Wall(3.0, 0.3, 3.0, 3.0)), seed=4))

    depth_m = camera.depth(ORIGIN, ELSEWHERE)

    foot, head = pixels(camera, ORIGIN, np.array([(3.0, 0.3, 0.2), (3.0, 0.3, 2.2)]))
    for row in range(math.ceil(head[1]), math.floor(foot[1])):
        edge = foot[0] + (row - foot[1]) / (head[1] - foot[1]) * (head[0] - foot[0])
        near = np.flatnonzero(depth_m[row] < 3.6)
        assert abs(near.max() + 0.5 - edge) <= 1.0


def brute_force_depth(camera: SceneCamera, robot: Pose2D, scene: Layout, rows: np.ndarray) -> np.ndarray:
    """Depth of every pixel of ``rows`` (all below the horizon) by intersecting its ray with every surface."""
    lens, mount = camera.calibration, camera.mount
    v, u = np.meshgrid(rows, np.arange(lens.width), indexing="ij")
    x, y = (u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy
    c, s = math.cos(mount.pitch_rad), math.sin(mount.pitch_rad)
    level, rise = c + y * s, s - y * c
    cos, sin = math.cos(robot.yaw_rad), math.sin(robot.yaw_rad)
    dx, dy = cos * level + sin * x, sin * level - cos * x
    px, py = robot.x_m + mount.ahead_m * cos, robot.y_m + mount.ahead_m * sin
    best = -mount.height_m / rise
    heights = [math.inf] * len(scene.walls) + [box.height_m for box in scene.boxes for _ in range(4)]
    for (x0, y0, x1, y1), height in zip(scene.segments(), heights, strict=True):
        ex, ey = x1 - x0, y1 - y0
        cross = dx * ey - dy * ex
        depth = ((x0 - px) * ey - (y0 - py) * ex) / cross
        share = ((x0 - px) * dy - (y0 - py) * dx) / cross
        top = mount.height_m + depth * rise
        hit = (depth > 0) & (share >= 0) & (share <= 1) & (top >= 0) & (top <= height)
        best = np.where(hit & (depth < best), depth, best)
    for box in scene.boxes:
        depth = (box.height_m - mount.height_m) / rise
        qx, qy = px + depth * dx - box.x_m, py + depth * dy - box.y_m
        bc, bs = math.cos(box.yaw_rad), math.sin(box.yaw_rad)
        along, aside = qx * bc + qy * bs, -qx * bs + qy * bc
        on = (depth > 0) & (np.abs(along) <= box.length_m / 2) & (np.abs(aside) <= box.width_m / 2)
        best = np.where(on & (depth < best), depth, best)
    return best


def test_every_pixel_below_the_horizon_is_as_far_as_ray_casting_says() -> None:
    boxes = (Box(2.5, -0.7, 0.6, 0.5, 0.5, 0.55), Box(3.5, 1.4, 1.0, 0.4, -0.3, 0.7), Box(0.9, 0.5, 0.3, 0.3, 0.0, 0.4))
    scene = layout((*room(5.0), Wall(1.5, -3.0, 4.0, -1.2)), boxes, seed=3)
    camera = camera_of(scene)
    for robot in (ORIGIN, Pose2D(0.3, -0.5, 0.9), Pose2D(-1.0, 1.0, -0.6)):
        horizon = camera.calibration.cy + camera.calibration.fy * math.tan(camera.mount.pitch_rad)
        rows = np.arange(math.ceil(horizon) + 2, camera.calibration.height)

        seen = camera.depth(robot, ELSEWHERE)[rows]

        expected = brute_force_depth(camera, robot, scene, rows)
        wrong = np.abs(seen / expected - 1) > 0.0045
        assert wrong.mean() < 0.004, "more than pixels on edges"


def test_walls_are_as_far_as_the_lidar_says() -> None:
    scene = layout((*room(4.0), Wall(2.0, 0.2, 2.6, 2.0)), (Box(2.4, -1.0, 0.5, 0.5, 0.3, 1.3),), seed=2)
    camera, robot = camera_of(scene), Pose2D(-0.2, 0.1, 0.15)
    lidar = lidar_pose(robot)
    ranges_m = np.empty(541)
    cast_rays(lidar.x_m, lidar.y_m, lidar.yaw_rad, scene.segments(), scene.circles(), ranges_m)
    ahead = np.arange(205, 336)
    angles = lidar.yaw_rad + np.deg2rad((ahead - 270) * 0.5)
    hits = np.column_stack(
        [
            lidar.x_m + ranges_m[ahead] * np.cos(angles),
            lidar.y_m + ranges_m[ahead] * np.sin(angles),
            np.full(len(ahead), 1.2),
        ]
    )

    depth_m = camera.depth(robot, ELSEWHERE)

    px, py = (
        robot.x_m + camera.mount.ahead_m * math.cos(robot.yaw_rad),
        robot.y_m + camera.mount.ahead_m * math.sin(robot.yaw_rad),
    )
    way = hits - (px, py, camera.mount.height_m)
    level = way[:, 0] * math.cos(robot.yaw_rad) + way[:, 1] * math.sin(robot.yaw_rad)
    expected = level * math.cos(camera.mount.pitch_rad) + way[:, 2] * math.sin(camera.mount.pitch_rad)
    at = np.rint(pixels(camera, robot, hits)).astype(int)
    inside = (at >= 0).all(axis=1) & (at < (640, 480)).all(axis=1)
    agrees = np.abs(depth_m[at[inside, 1], at[inside, 0]] / expected[inside] - 1) < 0.02
    # The LiDAR stands 0.3 m ahead of the camera and looks round some corners that the camera does not.
    assert inside.sum() > 100
    assert agrees.mean() > 0.9


def legs_columns(camera: SceneCamera, place: Pose2D, phase: float, amplitude: float, row: int) -> tuple[float, float]:
    """The leftmost and rightmost pixel of the operator in a row."""
    with_him = camera.depth(ORIGIN, place, phase, amplitude)[row]
    without = camera.depth(ORIGIN, ELSEWHERE)[row]
    covered = np.flatnonzero(with_him < without - 0.1)
    return float(covered.min()), float(covered.max())


def test_the_standing_operators_legs_are_where_the_lidar_meets_them() -> None:
    camera, place = camera_of(layout(room(6.0))), Pose2D(3.6, 0.4, math.pi)

    # Seen from the camera, an upright cylinder's edge lies beside its middle by its radius.
    left, right = pixels(camera, ORIGIN, np.array([(3.6, 0.4 + 0.11 + 0.06, 0.35), (3.6, 0.4 - 0.11 - 0.06, 0.35)]))
    seen = legs_columns(camera, place, 0.0, 0.0, round(left[1]))

    assert seen == (pytest.approx(left[0], abs=2.0), pytest.approx(right[0], abs=2.0))


@pytest.mark.parametrize("phase", np.linspace(0, 2 * math.pi, 9)[:-1])
def test_the_walking_operators_legs_swing_as_the_lidar_sees_them(phase: float) -> None:
    camera, place = camera_of(layout(room(6.0))), Pose2D(3.6, 0.0, math.pi / 2)
    swing = 0.2 * abs(math.sin(phase))

    # He walks to the left: the leg ahead is farthest left, the other one as far to the right.
    left, right = pixels(camera, ORIGIN, np.array([(3.6, swing + 0.06, 0.35), (3.6, -swing - 0.06, 0.35)]))
    seen = legs_columns(camera, place, float(phase), 1.0, round(left[1]))

    five_cm = 0.05 * camera.calibration.fx / 3.6
    assert seen == (pytest.approx(left[0], abs=five_cm), pytest.approx(right[0], abs=five_cm))


def test_the_operator_stands_on_the_floor() -> None:
    camera, place = camera_of(layout(room(8.0))), Pose2D(5.0, 0.0, math.pi)

    covered = camera.depth(ORIGIN, place) < camera.depth(ORIGIN, ELSEWHERE) - 0.02

    heels, toes = pixels(camera, ORIGIN, np.array([(5.1, 0.0, 0.0), (4.75, 0.0, 0.0)]))
    lowest = np.flatnonzero(covered.any(axis=1)).max()
    assert heels[1] - 2 <= lowest <= toes[1] + 2
    columns = np.flatnonzero(covered.any(axis=0))
    assert columns.mean() == pytest.approx(camera.calibration.cx, abs=4.0)


def test_a_post_is_as_wide_as_it_is() -> None:
    camera = camera_of(layout(room(6.0), posts=(Post(3.5, -0.8, 0.1),)))

    depth_m = camera.depth(ORIGIN, ELSEWHERE)

    left, right = pixels(camera, ORIGIN, np.array([(3.5, -0.7, 0.4), (3.5, -0.9, 0.4)]))
    near = np.flatnonzero(depth_m[round(left[1])] < 3.6)
    assert near.min() == pytest.approx(left[0], abs=2.0)
    assert near.max() == pytest.approx(right[0], abs=2.0)


def test_what_stands_right_before_the_lens_fills_the_picture() -> None:
    camera = camera_of(layout((*room(6.0), Wall(0.3, -3.0, 0.3, 3.0))))

    depth_m = camera.depth(ORIGIN, ELSEWHERE)

    assert depth_m[240, 320] == pytest.approx(0.4 / math.cos(camera.mount.pitch_rad), rel=0.01)
    assert depth_m.max() < 3.0
