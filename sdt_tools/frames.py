"""The words of the robot: what sensors say, what drivers answer, and how both are stamped.

Stamps are integer nanoseconds since the Unix epoch (UTC). Frames follow the right-hand rule with x ahead, y left, z up;
angles are radians, counter-clockwise positive.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from jaxtyping import Float64, UInt8

from sdt_tools.errors import UsageError

RAYS: Final = 541
RAY_STEP_RAD: Final = float(np.deg2rad(0.5))
FIRST_RAY_RAD: Final = float(np.deg2rad(-135.0))
MAX_RANGE_M: Final = 20.0
ROBOT_LENGTH_M: Final = 0.626
ROBOT_WIDTH_M: Final = 0.505
LIDAR_AHEAD_M: Final = 0.197
"""The LiDAR stands this far ahead of the robot's centre (Pioneer P3-AT with a SICK LMS1xx)."""

FRAME_ODOM: Final = "odom"
FRAME_BASE: Final = "base_link"
FRAME_LIDAR: Final = "lidar"
FRAME_CAMERA: Final = "camera"


def ray_angles_rad() -> Float64[np.ndarray, "rays"]:
    """Angles of the 541 rays in the LiDAR frame: ray 0 at -135° (right), ray 270 ahead, ray 540 at +135° (left)."""
    return (np.arange(RAYS) - RAYS // 2) * RAY_STEP_RAD


class MotionClass(IntEnum):
    """The seven answers of the follow network, in the order of its logits."""

    STAY = 0
    FORWARD = 1
    LEFT_FORWARD = 2
    RIGHT_FORWARD = 3
    BACKWARD = 4
    LEFT_BACKWARD = 5
    RIGHT_BACKWARD = 6

    @property
    def label(self) -> str:
        """The name used in files and on the command line, as in ``left_forward``."""
        return self.name.lower()

    @property
    def is_forward(self) -> bool:
        """Whether the class drives forward: the set that the safety domains forbid."""
        return self in FORWARD_CLASSES

    @property
    def mirrored(self) -> "MotionClass":
        """The class for the scene mirrored left to right."""
        return _MIRROR[self]


def motion_labelled(label: str) -> MotionClass:
    """The class called ``label``. Raises UsageError, listing the classes, where there is none."""
    known = {motion.label: motion for motion in MotionClass}
    if label not in known:
        raise UsageError(f"'{label}': no such motion class; the classes are {', '.join(known)}")
    return known[label]


FORWARD_CLASSES: Final = frozenset({MotionClass.FORWARD, MotionClass.LEFT_FORWARD, MotionClass.RIGHT_FORWARD})
_MIRROR: Final[Mapping[MotionClass, MotionClass]] = {
    MotionClass.STAY: MotionClass.STAY,
    MotionClass.FORWARD: MotionClass.FORWARD,
    MotionClass.LEFT_FORWARD: MotionClass.RIGHT_FORWARD,
    MotionClass.RIGHT_FORWARD: MotionClass.LEFT_FORWARD,
    MotionClass.BACKWARD: MotionClass.BACKWARD,
    MotionClass.LEFT_BACKWARD: MotionClass.RIGHT_BACKWARD,
    MotionClass.RIGHT_BACKWARD: MotionClass.LEFT_BACKWARD,
}


class Gesture(IntEnum):
    """What the operator's arms say, in the order of the vision network's logits."""

    IDLE = 0
    ENABLE = 1
    DISABLE = 2

    @property
    def label(self) -> str:
        """The name used in files and on the command line."""
        return self.name.lower()


class Mode(IntEnum):
    """The two states of the controller."""

    IDLE = 0
    ACTIVE = 1

    @property
    def label(self) -> str:
        """The name used in files and on the command line."""
        return self.name.lower()


class LogLevel(IntEnum):
    """Severity of a session log entry (the numbers of foxglove.Log)."""

    DEBUG = 1
    INFO = 2
    WARNING = 3
    ERROR = 4


@dataclass(frozen=True)
class Twist:
    """A velocity of the base in its own frame."""

    linear_mps: float
    angular_radps: float


@dataclass(frozen=True)
class Pose2D:
    """A pose in the plane."""

    x_m: float
    y_m: float
    yaw_rad: float


@dataclass(frozen=True, eq=False)
class LidarScan:
    """One sweep of the LiDAR, as the sensor gave it: metres, invalid codes (0.000, 0.002, 0.003) kept.

    ``stamp_ns`` is when the sensor took it.
    """

    stamp_ns: int
    ranges_m: Float64[np.ndarray, "rays"]
    start_angle_rad: float = FIRST_RAY_RAD
    end_angle_rad: float = -FIRST_RAY_RAD
    frame_id: str = FRAME_LIDAR


@dataclass(frozen=True)
class CameraImage:
    """One picture, compressed; ``stamp_ns`` is when it was grabbed."""

    stamp_ns: int
    data: bytes
    format: str = "jpeg"
    frame_id: str = FRAME_CAMERA


@dataclass(frozen=True, eq=False)
class RawPicture:
    """A picture as the camera gave it, blue, green, red, and when the host received it; ``stamp_ns`` is its grab time.

    No recording holds it: whoever records makes a CameraImage of it. The pixels are not written to any more.
    """

    received_ns: int
    stamp_ns: int
    image_bgr_u8: UInt8[np.ndarray, "height width 3"]
    frame_id: str = FRAME_CAMERA


@dataclass(frozen=True)
class CameraCalibration:
    """A pinhole camera without distortion: focal lengths and centre in pixels."""

    stamp_ns: int
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    frame_id: str = FRAME_CAMERA


@dataclass(frozen=True)
class FrameTransform:
    """Where ``child`` stands in ``parent``: translation in metres, rotation as a unit quaternion (x, y, z, w)."""

    stamp_ns: int
    parent: str
    child: str
    translation_m: tuple[float, float, float]
    rotation_xyzw: tuple[float, float, float, float]


@dataclass(frozen=True)
class Odometry:
    """The base's pose in the odometry frame."""

    stamp_ns: int
    pose: Pose2D
    frame_id: str = FRAME_ODOM


@dataclass(frozen=True)
class OperatorPose:
    """The operator's true pose in the odometry frame; known in the scene only."""

    stamp_ns: int
    pose: Pose2D
    frame_id: str = FRAME_ODOM


@dataclass(frozen=True)
class MotionCommand:
    """What a driver decided, what went to the wheels, and what the expert would have done, where one was asked.

    ``stamp_ns`` is the stamp of the scan that the decision was based on.
    """

    stamp_ns: int
    motion: MotionClass
    twist: Twist
    driver: str
    mode: Mode = Mode.ACTIVE
    intervention: bool = False
    expert: MotionClass | None = None


@dataclass(frozen=True)
class OperatorState:
    """The gesture that the operator makes and the mode he has asked for; known in the scene only.

    ``behaviour`` names what else his hands do (a phone call, pointing): it may look like a gesture, and is none.
    """

    stamp_ns: int
    gesture: Gesture
    commanded_mode: Mode
    behaviour: str = ""


@dataclass(frozen=True)
class LogEntry:
    """One line of the session log: a gap, a drop, a reconnect, a mode change, a mark."""

    stamp_ns: int
    level: LogLevel
    text: str
    name: str = "sdt"


Message = (
    LidarScan
    | CameraImage
    | CameraCalibration
    | FrameTransform
    | Odometry
    | OperatorPose
    | MotionCommand
    | OperatorState
    | LogEntry
)
"""Everything that a recording can hold; each kind has one topic."""


@dataclass(frozen=True)
class Received:
    """A message and when the host received it."""

    received_ns: int
    message: Message
