"""The robot as a whole: which devices it has, where they stand on it, how fast each motion is."""

import math

from pydantic import Field, model_validator

from sdt_tools.config import Config, MotionConfig, RateConfig
from sdt_tools.frames import LIDAR_AHEAD_M
from sdt_tools.robot.camera.config import CameraConfig
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.p3at.config import P3atConfig

MOUNT_HEIGHT_M = 0.35
"""On top of a P3-AT, which is 0.28 m high."""


class LidarMount(Config):
    """Where the LiDAR stands from the robot's centre on the floor. It looks straight ahead."""

    ahead_m: float = LIDAR_AHEAD_M
    left_m: float = 0.0
    height_m: float = MOUNT_HEIGHT_M


class CameraMount(Config):
    """Where the camera stands from the robot's centre on the floor, how far it looks up, and how wide it sees."""

    ahead_m: float = -0.1
    left_m: float = 0.0
    height_m: float = 0.9
    pitch_deg: float = Field(default=17.0, ge=-90, le=90)
    width_deg: float = Field(default=80.2, gt=0, lt=180)
    """Horizontal angle of view, from the lens's data sheet."""

    def focal_px(self, width_px: int) -> float:
        """Focal length of a picture of that width."""
        return width_px / 2 / math.tan(math.radians(self.width_deg) / 2)


class MountingConfig(Config):
    """Where the devices stand."""

    lidar: LidarMount = LidarMount()
    camera: CameraMount = CameraMount()


class DecisionRates(Config):
    """How often motions are decided and gestures read, in hertz."""

    follow_hz: float = Field(default=10.0, gt=0, le=1000)
    vision_hz: float = Field(default=5.0, gt=0, le=1000)


class RobotConfig(Config):
    """One robot. Without a table ``camera`` or ``base`` it has none; an empty one takes the defaults."""

    lidar: Lms1xxConfig = Lms1xxConfig()
    camera: CameraConfig | None = None
    base: P3atConfig | None = None
    mounting: MountingConfig = MountingConfig()
    motions: MotionConfig = MotionConfig()
    decisions: DecisionRates = DecisionRates()

    @model_validator(mode="after")
    def _networks_can_read_it(self) -> "RobotConfig":
        if self.lidar.all_rays:
            raise ValueError("lidar.all_rays gives 1081 rays, and networks and recordings take 541; leave it out")
        return self

    @property
    def rates(self) -> RateConfig:
        """What comes and is decided how often."""
        image_hz = 30.0 if self.camera is None else self.camera.rate_hz
        decisions = self.decisions
        return RateConfig(
            scan_hz=self.lidar.scan_hz,
            image_hz=image_hz,
            follow_hz=decisions.follow_hz,
            vision_hz=decisions.vision_hz,
        )
