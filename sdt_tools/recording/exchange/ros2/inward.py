"""Messages of ROS 2 as ours."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sdt_tools.config import MotionConfig
from sdt_tools.frames import FIRST_RAY_RAD, Mode, MotionClass, Twist
from sdt_tools.recording.exchange.carried import Carried
from sdt_tools.recording.exchange.ros2 import types
from sdt_tools.recording.exchange.ros2.geometry import RayChoice, choose_rays, our_ranges
from sdt_tools.recording.exchange.ros2.outward import LEVEL_STEP
from sdt_tools.recording.exchange.ros2.pictures import JPEG, PictureFormat, compressed
from sdt_tools.recording.exchange.ros2.types import stamp_of
from sdt_tools.recording.messages import topics
from sdt_tools.recording.messages.schemas import message_class
from sdt_tools.recording.messages.topics import TOPIC_BY_NAME

DRIVER: Final = "ros2"
"""The driver of commands that came as a twist: who it was the bag does not say."""


_MOTIONS: Final = MotionConfig()


@dataclass(frozen=True)
class Taking:
    """How messages are taken over: other LiDARs resampled or refused, pictures compressed, twists classed."""

    resample: bool = False
    pictures: PictureFormat = JPEG
    motions: MotionConfig = _MOTIONS


def from_ros(type_name: str, message: Any, received_ns: int, taking: Taking) -> Iterator[Carried]:
    """What a message of ``type_name``, received at ``received_ns``, becomes; one without a stamp takes that moment.

    A twist that is not finite and a picture that is cut off become nothing. Raises RecordingError where a geometry or
    an encoding cannot be taken over.
    """
    chosen = _AS_CHOSEN.get(type_name)
    for topic, stamp_ns, built in chosen(message, taking) if chosen else _AS_IT_IS[type_name](message):
        yield Carried(TOPIC_BY_NAME[topic], received_ns, stamp_ns if stamp_ns > 0 else received_ns, built)


def is_stamped(type_name: str, message: Any) -> bool:
    """Whether the message says when it was made; drivers that do not know write zero."""
    if type_name == types.TWIST:
        return False
    if type_name == types.TF_MESSAGE:
        return all(stamp_of(stamped.header.stamp) > 0 for stamped in message.transforms)
    return stamp_of(message.stamp if type_name == types.LOG else message.header.stamp) > 0


def rays_of(scan: Any, taking: Taking) -> RayChoice:
    """Which rays of a sensor_msgs/LaserScan become ours. Raises RecordingError where none do."""
    return choose_rays(len(scan.ranges), float(scan.angle_min), float(scan.angle_increment), taking.resample)


def nearest_motion(twist: Twist, motions: MotionConfig) -> MotionClass:
    """The class whose twist is nearest, speeds counted in those of ``forward`` and of a turn; the first of equals."""

    def distance(motion: MotionClass) -> float:
        other = motions.twist(motion)
        return math.hypot(
            (twist.linear_mps - other.linear_mps) / motions.forward_mps,
            (twist.angular_radps - other.angular_radps) / motions.turn_radps,
        )

    return min(MotionClass, key=distance)


_Built = tuple[str, int, Any]


def _scan(scan: Any, taking: Taking) -> Iterator[_Built]:
    ranges_m = our_ranges(np.asarray(scan.ranges, np.float32), rays_of(scan, taking), scan.range_min, scan.range_max)
    built = _new(topics.LIDAR_SCAN)
    built.frame_id, built.start_angle, built.end_angle = scan.header.frame_id, FIRST_RAY_RAD, -FIRST_RAY_RAD
    built.ranges.extend(ranges_m.tolist())
    yield topics.LIDAR_SCAN, stamp_of(scan.header.stamp), built


def _compressed_image(image: Any) -> Iterator[_Built]:
    built = _new(topics.CAMERA_IMAGE)
    built.frame_id, built.data, built.format = image.header.frame_id, bytes(image.data), _format(image.format)
    yield topics.CAMERA_IMAGE, stamp_of(image.header.stamp), built


def _image(image: Any, taking: Taking) -> Iterator[_Built]:
    data = compressed(image, taking.pictures)
    if data is None:
        return
    built = _new(topics.CAMERA_IMAGE)
    built.frame_id, built.data, built.format = image.header.frame_id, data, taking.pictures.name
    yield topics.CAMERA_IMAGE, stamp_of(image.header.stamp), built


def _format(text: str) -> str:
    """As Foxglove calls it: ROS 2 says ``jpeg``, or ``rgb8; jpeg compressed bgr8``."""
    for name, spellings in {"jpeg": ("jpeg", "jpg"), "png": ("png",)}.items():
        if any(spelling in text.lower() for spelling in spellings):
            return name
    return text


def _camera_info(camera: Any) -> Iterator[_Built]:
    built = _new(topics.CAMERA_CALIBRATION)
    built.frame_id, built.width, built.height = camera.header.frame_id, camera.width, camera.height
    built.distortion_model = camera.distortion_model
    built.D.extend(camera.d.tolist())
    built.K.extend(camera.k.tolist())
    built.R.extend(camera.r.tolist())
    built.P.extend(camera.p.tolist())
    yield topics.CAMERA_CALIBRATION, stamp_of(camera.header.stamp), built


def _twist_stamped(stamped: Any, taking: Taking) -> Iterator[_Built]:
    yield from _command(stamped.twist, stamp_of(stamped.header.stamp), taking)


def _twist(twist: Any, taking: Taking) -> Iterator[_Built]:
    yield from _command(twist, 0, taking)


def _command(twist: Any, stamp_ns: int, taking: Taking) -> Iterator[_Built]:
    ours = Twist(twist.linear.x, twist.angular.z)
    if not (math.isfinite(ours.linear_mps) and math.isfinite(ours.angular_radps)):
        return
    built = _new(topics.COMMAND)
    built.motion, built.driver, built.mode = nearest_motion(ours, taking.motions), DRIVER, Mode.ACTIVE
    built.linear_mps, built.angular_radps = ours.linear_mps, ours.angular_radps
    yield topics.COMMAND, stamp_ns, built


def _decision(command: Any) -> Iterator[_Built]:
    built = _new(topics.COMMAND)
    built.motion, built.driver, built.mode = command.motion, command.driver, command.mode
    built.linear_mps, built.angular_radps = command.linear_mps, command.angular_radps
    built.intervention = bool(command.intervention)
    if command.expert != types.NO_EXPERT:
        built.expert = command.expert
    yield topics.COMMAND, stamp_of(command.header.stamp), built


def _odometry(odometry: Any) -> Iterator[_Built]:
    yield topics.ODOMETRY, stamp_of(odometry.header.stamp), _posed(topics.ODOMETRY, odometry, odometry.pose.pose)


def _pose_stamped(posed: Any) -> Iterator[_Built]:
    yield topics.OPERATOR_POSE, stamp_of(posed.header.stamp), _posed(topics.OPERATOR_POSE, posed, posed.pose)


def _posed(topic: str, message: Any, pose: Any) -> Any:
    built = _new(topic)
    built.frame_id = message.header.frame_id
    _copy_vector(pose.position, built.pose.position)
    _copy_quaternion(pose.orientation, built.pose.orientation)
    return built


def _transforms(message: Any) -> Iterator[_Built]:
    for stamped in message.transforms:
        built = _new(topics.TRANSFORM)
        built.parent_frame_id, built.child_frame_id = stamped.header.frame_id, stamped.child_frame_id
        _copy_vector(stamped.transform.translation, built.translation)
        _copy_quaternion(stamped.transform.rotation, built.rotation)
        yield topics.TRANSFORM, stamp_of(stamped.header.stamp), built


def _operator_state(state: Any) -> Iterator[_Built]:
    built = _new(topics.OPERATOR_STATE)
    built.gesture, built.commanded_mode = state.gesture, state.commanded_mode
    built.behaviour = state.behaviour
    yield topics.OPERATOR_STATE, stamp_of(state.header.stamp), built


def _log(entry: Any) -> Iterator[_Built]:
    built = _new(topics.SESSION_LOG)
    built.level, built.name, built.message = entry.level // LEVEL_STEP, entry.name, entry.msg
    built.file, built.line = entry.file, entry.line
    yield topics.SESSION_LOG, stamp_of(entry.stamp), built


def _new(topic: str) -> Any:
    return message_class(TOPIC_BY_NAME[topic].schema)()


def _copy_vector(theirs: Any, ours: Any) -> None:
    ours.x, ours.y, ours.z = theirs.x, theirs.y, theirs.z


def _copy_quaternion(theirs: Any, ours: Any) -> None:
    ours.x, ours.y, ours.z, ours.w = theirs.x, theirs.y, theirs.z, theirs.w


_AS_CHOSEN: Final[dict[str, Callable[[Any, Taking], Iterator[_Built]]]] = {
    types.LASER_SCAN: _scan,
    types.IMAGE: _image,
    types.TWIST: _twist,
    types.TWIST_STAMPED: _twist_stamped,
}
_AS_IT_IS: Final[dict[str, Callable[[Any], Iterator[_Built]]]] = {
    types.COMPRESSED_IMAGE: _compressed_image,
    types.CAMERA_INFO: _camera_info,
    types.MOTION_COMMAND: _decision,
    types.ODOMETRY: _odometry,
    types.POSE_STAMPED: _pose_stamped,
    types.TF_MESSAGE: _transforms,
    types.OPERATOR_STATE: _operator_state,
    types.LOG: _log,
}
