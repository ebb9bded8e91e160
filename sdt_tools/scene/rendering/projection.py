"""The pinhole camera and where it is mounted: the one place where metres become pixels.

The camera's own axes are the usual optical ones: x right, y down, z ahead. A pixel's centre has whole coordinates.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from sdt_tools.frames import Pose2D


@dataclass(frozen=True)
class Pinhole:
    """A pinhole camera without distortion; all numbers in pixels."""

    width: int = 640
    height: int = 480
    fx: float = 380.0
    fy: float = 380.0
    cx: float = 319.5
    cy: float = 239.5

    def project(self, points_camera: Float64[np.ndarray, "points 3"]) -> Float64[np.ndarray, "points 2"]:
        """Pixels of points in the camera's axes; meaningless for points that are not ahead of the camera (z ≤ 0)."""
        z = points_camera[:, 2]
        return np.stack(
            [self.cx + self.fx * points_camera[:, 0] / z, self.cy + self.fy * points_camera[:, 1] / z], axis=1
        )


@dataclass(frozen=True)
class CameraMount:
    """Where the camera stands on the robot: on a mast above its centre, looking ahead and a little up.

    Tilted so that the raised hand of a person who stands a metre away is still in the picture.
    """

    height_m: float = 0.9
    pitch_rad: float = math.radians(17.0)
    ahead_m: float = -0.1

    @property
    def translation_m(self) -> tuple[float, float, float]:
        """The camera's place in the frame of the base, which lies on the floor under the robot's centre."""
        return (self.ahead_m, 0.0, self.height_m)

    @property
    def rotation_xyzw(self) -> tuple[float, float, float, float]:
        """The turn of the optical axes (x right, y down, z ahead) in the frame of the base, as a unit quaternion."""
        # Optical axes of a level camera, (-1/2, 1/2, -1/2, 1/2), after a turn about the base's y axis by -pitch.
        half = -self.pitch_rad / 2
        c, s = math.cos(half) / 2, math.sin(half) / 2
        return (-c - s, c + s, s - c, c - s)


@dataclass(frozen=True, eq=False)
class View:
    """A camera in the world: its place, and its axes right, down and ahead as the rows of ``axes``."""

    position_m: Float64[np.ndarray, "3"]
    axes: Float64[np.ndarray, "3 3"]

    def to_camera(self, points_m: Float64[np.ndarray, "points 3"]) -> Float64[np.ndarray, "points 3"]:
        """World points in the camera's axes."""
        seen: Float64[np.ndarray, "points 3"] = (points_m - self.position_m) @ self.axes.T
        return seen


def view_from(robot: Pose2D, mount: CameraMount) -> View:
    """The camera of a robot whose centre is at ``robot``."""
    cos_yaw, sin_yaw = math.cos(robot.yaw_rad), math.sin(robot.yaw_rad)
    cos_pitch, sin_pitch = math.cos(mount.pitch_rad), math.sin(mount.pitch_rad)
    ahead = np.array([cos_yaw * cos_pitch, sin_yaw * cos_pitch, sin_pitch])
    right = np.array([sin_yaw, -cos_yaw, 0.0])
    position = np.array([robot.x_m + mount.ahead_m * cos_yaw, robot.y_m + mount.ahead_m * sin_yaw, mount.height_m])
    return View(position, np.stack([right, np.cross(ahead, right), ahead]))
