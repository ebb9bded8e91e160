"""Where each kind of message goes in a recording, and in which schema."""

from dataclasses import dataclass
from typing import Final

from sdt_tools.frames import (
    CameraCalibration,
    CameraImage,
    FrameTransform,
    LidarScan,
    LogEntry,
    Message,
    MotionCommand,
    Odometry,
    OperatorPose,
    OperatorState,
)

LIDAR_SCAN: Final = "/lidar/scan"
CAMERA_IMAGE: Final = "/camera/image"
CAMERA_CALIBRATION: Final = "/camera/calibration"
TRANSFORM: Final = "/tf"
ODOMETRY: Final = "/robot/odometry"
OPERATOR_POSE: Final = "/operator/pose"
COMMAND: Final = "/robot/command"
OPERATOR_STATE: Final = "/operator/state"
SESSION_LOG: Final = "/session/log"


@dataclass(frozen=True)
class Topic:
    """A topic, its protobuf schema, and the kind of message that it carries.

    A ``periodic`` one has a message every so often, so that one that is missing shows; others speak when there is
    something to say.
    """

    name: str
    schema: str
    message: type[Message]
    periodic: bool = False


TOPICS: Final = (
    Topic(LIDAR_SCAN, "foxglove.LaserScan", LidarScan, periodic=True),
    Topic(CAMERA_IMAGE, "foxglove.CompressedImage", CameraImage, periodic=True),
    Topic(CAMERA_CALIBRATION, "foxglove.CameraCalibration", CameraCalibration),
    Topic(TRANSFORM, "foxglove.FrameTransform", FrameTransform),
    Topic(ODOMETRY, "foxglove.PoseInFrame", Odometry, periodic=True),
    Topic(OPERATOR_POSE, "foxglove.PoseInFrame", OperatorPose, periodic=True),
    Topic(COMMAND, "sdt.MotionCommand", MotionCommand, periodic=True),
    Topic(OPERATOR_STATE, "sdt.OperatorState", OperatorState),
    Topic(SESSION_LOG, "foxglove.Log", LogEntry),
)
"""Everything that a recording holds; each kind of message has one topic."""

SENSORS: Final = (LIDAR_SCAN, CAMERA_IMAGE, ODOMETRY)
"""Topics whose stamps are a sensor's."""

TOPIC_BY_NAME: Final = {topic.name: topic for topic in TOPICS}
_TOPIC_BY_MESSAGE: Final = {topic.message: topic for topic in TOPICS}


def topic_of(message: Message) -> Topic:
    """The topic that ``message`` is recorded on."""
    return _TOPIC_BY_MESSAGE[type(message)]


def is_ours(topic: str, schema: str, encoding: str) -> bool:
    """Whether a channel carries one of our topics in the schema and encoding that we read."""
    known = TOPIC_BY_NAME.get(topic)
    return known is not None and known.schema == schema and encoding == "protobuf"
