"""Our messages to and from the protobuf of their topics.

Each kind has its encoder and decoder side by side. Stamps go into the message's own timestamp as well, for other
readers; coming back, the stamp is the one that the container keeps (``publish_time``), to the nanosecond.
"""

import math
from collections.abc import Callable
from enum import IntEnum
from functools import cache
from typing import Any, Final, TypeVar

import numpy as np
from google.protobuf.message import DecodeError
from google.protobuf.message import Message as ProtobufMessage

from sdt_tools.errors import RecordingError
from sdt_tools.frames import (
    CameraCalibration,
    CameraImage,
    FrameTransform,
    Gesture,
    LidarScan,
    LogEntry,
    LogLevel,
    Message,
    Mode,
    MotionClass,
    MotionCommand,
    Odometry,
    OperatorPose,
    OperatorState,
    Pose2D,
    Twist,
)
from sdt_tools.recording.messages.schemas import message_class
from sdt_tools.recording.messages.topics import TOPIC_BY_NAME
from sdt_tools.recording.messages.wire import SECOND_NS, decode_scan, encode_image, encode_scan

_FOXGLOVE_FATAL: Final = 5
EnumT = TypeVar("EnumT", bound=IntEnum)


def encode(message: Message) -> bytes:
    """``message`` in the schema of its topic; the same message gives the same bytes."""
    return _ENCODERS[type(message)](message)


def decode(topic: str, schema: str, data: bytes, stamp_ns: int) -> Message:
    """The message that ``data`` holds, stamped ``stamp_ns``.

    Raises RecordingError where the topic is not ours, comes in another schema, or the data does not parse.
    """
    known = TOPIC_BY_NAME.get(topic)
    if known is None or known.schema != schema:
        raise RecordingError(f"{topic} ({schema}): not a topic and schema that recordings hold")
    try:
        return _DECODERS[known.message](data, stamp_ns)
    except (DecodeError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise RecordingError(
            f"{topic} at {stamp_ns} ns: not a valid {schema} ({reason}); the data is damaged"
        ) from None


def _new(schema: str, stamp_ns: int) -> Any:
    message = message_class(schema)()
    _set_stamp(message, stamp_ns)
    return message


def _set_stamp(message: Any, stamp_ns: int) -> None:
    message.timestamp.seconds, message.timestamp.nanos = divmod(stamp_ns, SECOND_NS)


def _bytes(message: ProtobufMessage) -> bytes:
    data: bytes = message.SerializeToString(deterministic=True)
    return data


@cache
def _parser(schema: str) -> Callable[[bytes], Any]:
    parse: Callable[[bytes], Any] = message_class(schema).FromString
    return parse


def _encode_scan(scan: LidarScan) -> bytes:
    ranges = np.ascontiguousarray(scan.ranges_m, "<f8").data.cast("B")
    return encode_scan(scan.stamp_ns, scan.frame_id, scan.start_angle_rad, scan.end_angle_rad, ranges)


def _decode_scan(data: bytes, stamp_ns: int) -> LidarScan:
    fields = decode_scan(data)
    return LidarScan(stamp_ns, fields.ranges_m, fields.start_angle_rad, fields.end_angle_rad, fields.frame_id)


def _encode_image(image: CameraImage) -> bytes:
    return encode_image(image.stamp_ns, image.frame_id, image.data, image.format)


def _decode_image(data: bytes, stamp_ns: int) -> CameraImage:
    image = _parser("foxglove.CompressedImage")(data)
    return CameraImage(stamp_ns, image.data, image.format, image.frame_id)


def _encode_calibration(camera: CameraCalibration) -> bytes:
    message = _new("foxglove.CameraCalibration", camera.stamp_ns)
    message.frame_id, message.width, message.height = camera.frame_id, camera.width, camera.height
    message.distortion_model = "plumb_bob"
    message.D.extend([0.0] * 5)
    message.K.extend([camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0])
    message.R.extend([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    message.P.extend([camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0])
    return _bytes(message)


def _decode_calibration(data: bytes, stamp_ns: int) -> CameraCalibration:
    message = _parser("foxglove.CameraCalibration")(data)
    if len(message.K) != 9:
        raise ValueError(f"K has {len(message.K)} values, 9 expected")
    fx, _, cx, _, fy, cy = message.K[:6]
    return CameraCalibration(stamp_ns, message.width, message.height, fx, fy, cx, cy, message.frame_id)


def _encode_transform(transform: FrameTransform) -> bytes:
    message = _new("foxglove.FrameTransform", transform.stamp_ns)
    message.parent_frame_id, message.child_frame_id = transform.parent, transform.child
    _set_vector(message.translation, transform.translation_m)
    _set_quaternion(message.rotation, transform.rotation_xyzw)
    return _bytes(message)


def _decode_transform(data: bytes, stamp_ns: int) -> FrameTransform:
    message = _parser("foxglove.FrameTransform")(data)
    move, turn = message.translation, message.rotation
    return FrameTransform(
        stamp_ns,
        message.parent_frame_id,
        message.child_frame_id,
        (move.x, move.y, move.z),
        (turn.x, turn.y, turn.z, turn.w),
    )


def _encode_pose(posed: Odometry | OperatorPose) -> bytes:
    message = _new("foxglove.PoseInFrame", posed.stamp_ns)
    message.frame_id = posed.frame_id
    pose = posed.pose
    _set_vector(message.pose.position, (pose.x_m, pose.y_m, 0.0))
    half_rad = pose.yaw_rad / 2
    _set_quaternion(message.pose.orientation, (0.0, 0.0, math.sin(half_rad), math.cos(half_rad)))
    return _bytes(message)


def _decode_odometry(data: bytes, stamp_ns: int) -> Odometry:
    return Odometry(stamp_ns, *_decode_pose(data))


def _decode_operator_pose(data: bytes, stamp_ns: int) -> OperatorPose:
    return OperatorPose(stamp_ns, *_decode_pose(data))


def _decode_pose(data: bytes) -> tuple[Pose2D, str]:
    message = _parser("foxglove.PoseInFrame")(data)
    position, q = message.pose.position, message.pose.orientation
    yaw_rad = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
    return Pose2D(position.x, position.y, yaw_rad), message.frame_id


def _encode_command(command: MotionCommand) -> bytes:
    message = _new("sdt.MotionCommand", command.stamp_ns)
    message.motion = command.motion
    message.linear_mps, message.angular_radps = command.twist.linear_mps, command.twist.angular_radps
    message.driver, message.mode, message.intervention = command.driver, command.mode, command.intervention
    if command.expert is not None:
        message.expert = command.expert
    return _bytes(message)


def _decode_command(data: bytes, stamp_ns: int) -> MotionCommand:
    message = _parser("sdt.MotionCommand")(data)
    return MotionCommand(
        stamp_ns,
        MotionClass(message.motion),
        Twist(message.linear_mps, message.angular_radps),
        message.driver,
        Mode(message.mode),
        message.intervention,
        MotionClass(message.expert) if message.HasField("expert") else None,
    )


def _encode_state(state: OperatorState) -> bytes:
    message = _new("sdt.OperatorState", state.stamp_ns)
    message.gesture, message.commanded_mode = state.gesture, state.commanded_mode
    message.behaviour = state.behaviour
    return _bytes(message)


def _decode_state(data: bytes, stamp_ns: int) -> OperatorState:
    message = _parser("sdt.OperatorState")(data)
    return OperatorState(stamp_ns, Gesture(message.gesture), Mode(message.commanded_mode), message.behaviour)


def _encode_log(entry: LogEntry) -> bytes:
    message = _new("foxglove.Log", entry.stamp_ns)
    message.level, message.message, message.name = entry.level, entry.text, entry.name
    return _bytes(message)


def _decode_log(data: bytes, stamp_ns: int) -> LogEntry:
    message = _parser("foxglove.Log")(data)
    level = min(message.level, _FOXGLOVE_FATAL - 1) or LogLevel.INFO  # we know neither FATAL nor UNKNOWN
    return LogEntry(stamp_ns, LogLevel(level), message.message, message.name)


def _set_vector(vector: Any, xyz: tuple[float, float, float]) -> None:
    vector.x, vector.y, vector.z = xyz


def _set_quaternion(quaternion: Any, xyzw: tuple[float, float, float, float]) -> None:
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = xyzw


_ENCODERS: Final[dict[type[Message], Callable[[Any], bytes]]] = {
    LidarScan: _encode_scan,
    CameraImage: _encode_image,
    CameraCalibration: _encode_calibration,
    FrameTransform: _encode_transform,
    Odometry: _encode_pose,
    OperatorPose: _encode_pose,
    MotionCommand: _encode_command,
    OperatorState: _encode_state,
    LogEntry: _encode_log,
}
_DECODERS: Final[dict[type[Message], Callable[[bytes, int], Message]]] = {
    LidarScan: _decode_scan,
    CameraImage: _decode_image,
    CameraCalibration: _decode_calibration,
    FrameTransform: _decode_transform,
    Odometry: _decode_odometry,
    OperatorPose: _decode_operator_pose,
    MotionCommand: _decode_command,
    OperatorState: _decode_state,
    LogEntry: _decode_log,
}
