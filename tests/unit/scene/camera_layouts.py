"""Small worlds for looking at, and what the camera should see of them by other means than the renderer's."""

import math
from functools import cache

import cv2
import numpy as np

from sdt_tools.frames import Pose2D
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.layout import Box, Layout, OperatorPlan, Post, Wall

ORIGIN = Pose2D(0.0, 0.0, 0.0)
ELSEWHERE = Pose2D(-6.0, 0.0, 0.0)
"""Behind a robot at the origin that looks ahead."""


def layout(
    walls: tuple[Wall, ...] = (),
    boxes: tuple[Box, ...] = (),
    posts: tuple[Post, ...] = (),
    seed: int = 1,
    light: str = "indoor",
) -> Layout:
    """A world with an operator whose legs are 0.22 m apart and 0.06 m thick."""
    plan = OperatorPlan(
        path_m=((2.0, 0.0),),
        pauses_s=(0.0,),
        speed_mps=0.5,
        waits_at_lead_m=1.8,
        keeps_away_m=0.4,
        patience_s=5.0,
        yaw_rad=math.pi,
        leg_radius_m=0.06,
        leg_separation_m=0.22,
        step_length_m=0.4,
        first_phase_rad=0.0,
    )
    return Layout("test", seed, 60.0, ORIGIN, plan, walls, boxes, posts, light=light)


def room(half_m: float = 4.0) -> tuple[Wall, ...]:
    """Four walls around the origin."""
    h = half_m
    return (Wall(-h, -h, h, -h), Wall(h, -h, h, h), Wall(h, h, -h, h), Wall(-h, h, -h, -h))


@cache
def camera_of(scene: Layout) -> SceneCamera:
    """A camera, made once: what it was asked before makes no difference to it (which a test holds)."""
    return SceneCamera(scene)


def pixels(camera: SceneCamera, robot: Pose2D, points_m: np.ndarray) -> np.ndarray:
    """Where OpenCV projects world points, given the calibration and the published transform of the camera."""
    lens, (qx, qy, qz, qw) = camera.calibration, camera.mount.rotation_xyzw
    angle = 2 * math.acos(qw)
    in_base, _ = cv2.Rodrigues(np.array([qx, qy, qz]) / math.sin(angle / 2) * angle)
    turn, _ = cv2.Rodrigues(np.array([0.0, 0.0, robot.yaw_rad]))
    rotation = (turn @ in_base).T
    position = turn @ np.array(camera.mount.translation_m) + (robot.x_m, robot.y_m, 0.0)
    matrix = np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1]])
    rvec, _ = cv2.Rodrigues(rotation)
    projected, _ = cv2.projectPoints(np.asarray(points_m, dtype=np.float64), rvec, -rotation @ position, matrix, None)
    return projected[:, 0]
