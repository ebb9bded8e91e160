"""Where the robot's devices stand on it, as messages."""

import math

from sdt_tools.frames import FRAME_BASE, FRAME_CAMERA, FRAME_LIDAR, CameraCalibration, FrameTransform
from sdt_tools.robot.config import CameraMount, LidarMount


def lidar_transform(mount: LidarMount, stamp_ns: int) -> FrameTransform:
    """The LiDAR's place in the frame of the base, which lies on the floor under the robot's centre."""
    place_m = (mount.ahead_m, mount.left_m, mount.height_m)
    return FrameTransform(stamp_ns, FRAME_BASE, FRAME_LIDAR, place_m, (0.0, 0.0, 0.0, 1.0))


def camera_transform(mount: CameraMount, stamp_ns: int) -> FrameTransform:
    """The camera's place in the frame of the base; its axes are the optical ones: x right, y down, z ahead."""
    place_m = (mount.ahead_m, mount.left_m, mount.height_m)
    half_rad = -math.radians(mount.pitch_deg) / 2  # a level camera's axes, turned about the base's y axis
    cos, sin = math.cos(half_rad) / 2, math.sin(half_rad) / 2
    rotation_xyzw = (-cos - sin, cos + sin, sin - cos, cos - sin)
    return FrameTransform(stamp_ns, FRAME_BASE, FRAME_CAMERA, place_m, rotation_xyzw)


def camera_calibration(mount: CameraMount, width_px: int, height_px: int, stamp_ns: int) -> CameraCalibration:
    """A pinhole as wide as the lens, its axis through the picture's centre, for pictures of that size."""
    focal_px = mount.focal_px(width_px)
    centre_px = ((width_px - 1) / 2, (height_px - 1) / 2)
    return CameraCalibration(stamp_ns, width_px, height_px, focal_px, focal_px, *centre_px)
