"""Our messages as those of ROS 2.

Scans lose what float32 cannot hold: a range in whole millimetres comes back equal, any other to seven digits. Commands
go out twice, as the geometry_msgs/TwistStamped that everyone understands and as our own message with all the rest.
Transforms are of mounts and hold from then on, so they go to ``/tf_static``.
"""

from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from sdt_tools.errors import RecordingError
from sdt_tools.frames import FRAME_BASE, MAX_RANGE_M
from sdt_tools.recording.exchange.carried import Carried
from sdt_tools.recording.exchange.ros2 import types
from sdt_tools.recording.exchange.ros2.geometry import CODE_BELOW_M
from sdt_tools.recording.exchange.ros2.types import header, new
from sdt_tools.recording.messages import topics

SCAN: Final = "/lidar/scan"
IMAGE: Final = "/camera/image/compressed"
CAMERA_INFO: Final = "/camera/camera_info"
TRANSFORM: Final = "/tf_static"
ODOMETRY: Final = "/robot/odometry"
OPERATOR_POSE: Final = "/operator/pose"
TWIST: Final = "/robot/command"
DECISION: Final = "/robot/decision"
OPERATOR_STATE: Final = "/operator/state"
SESSION_LOG: Final = "/session/log"

LEVEL_STEP: Final = 10
"""rcl_interfaces/Log counts its levels in tens, foxglove.Log in ones."""
_LAST_SECOND: Final = 2**31


class Sent(NamedTuple):
    """A message on a topic of the bag."""

    topic: str
    type_name: str
    message: Any


def to_ros(carried: Carried) -> Iterator[Sent]:
    """What ``carried`` becomes. Raises RecordingError where its stamp is beyond what ROS 2 can say (the year 2038)."""
    if not 0 <= carried.stamp_ns < _LAST_SECOND * 10**9:
        raise RecordingError(
            f"{carried.topic.name} at {carried.stamp_ns} ns: ROS 2 stamps end in 2038; `sdt export parquet` keeps them"
        )
    yield from _CONVERTERS[carried.topic.name](carried.stamp_ns, carried.message)


def _scan(stamp_ns: int, scan: Any) -> Iterator[Sent]:
    ranges = np.array(scan.ranges, np.float64).astype(np.float32)
    step_rad = (scan.end_angle - scan.start_angle) / max(1, len(ranges) - 1)
    message = new(
        types.LASER_SCAN,
        header=header(stamp_ns, scan.frame_id),
        angle_min=scan.start_angle,
        angle_max=scan.end_angle,
        angle_increment=step_rad,
        time_increment=0.0,
        scan_time=0.0,
        range_min=CODE_BELOW_M,  # codes are below, so that others discard them
        range_max=max(MAX_RANGE_M, float(ranges.max(initial=0.0))),
        ranges=ranges,
        intensities=np.array(scan.intensities, np.float64).astype(np.float32),
    )
    yield Sent(SCAN, types.LASER_SCAN, message)


def _image(stamp_ns: int, image: Any) -> Iterator[Sent]:
    data = np.frombuffer(image.data, np.uint8)
    message = new(types.COMPRESSED_IMAGE, header=header(stamp_ns, image.frame_id), format=image.format, data=data)
    yield Sent(IMAGE, types.COMPRESSED_IMAGE, message)


def _calibration(stamp_ns: int, camera: Any) -> Iterator[Sent]:
    if (len(camera.K), len(camera.R), len(camera.P)) != (9, 9, 12):
        raise RecordingError(f"{topics.CAMERA_CALIBRATION} at {stamp_ns} ns: K, R and P have 9, 9 and 12 values")
    region = new("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    message = new(
        types.CAMERA_INFO,
        header=header(stamp_ns, camera.frame_id),
        height=camera.height,
        width=camera.width,
        distortion_model=camera.distortion_model,
        d=np.array(camera.D, np.float64),
        k=np.array(camera.K, np.float64),
        r=np.array(camera.R, np.float64),
        p=np.array(camera.P, np.float64),
        binning_x=0,
        binning_y=0,
        roi=region,
    )
    yield Sent(CAMERA_INFO, types.CAMERA_INFO, message)


def _transform(stamp_ns: int, transform: Any) -> Iterator[Sent]:
    stamped = new(
        "geometry_msgs/msg/TransformStamped",
        header=header(stamp_ns, transform.parent_frame_id),
        child_frame_id=transform.child_frame_id,
        transform=new(
            "geometry_msgs/msg/Transform",
            translation=_vector(transform.translation),
            rotation=_quaternion(transform.rotation),
        ),
    )
    yield Sent(TRANSFORM, types.TF_MESSAGE, new(types.TF_MESSAGE, transforms=[stamped]))


def _odometry(stamp_ns: int, posed: Any) -> Iterator[Sent]:
    unknown = np.zeros(36)
    message = new(
        types.ODOMETRY,
        header=header(stamp_ns, posed.frame_id),
        child_frame_id=FRAME_BASE,
        pose=new("geometry_msgs/msg/PoseWithCovariance", pose=_pose(posed.pose), covariance=unknown),
        twist=new("geometry_msgs/msg/TwistWithCovariance", twist=_twist(0.0, 0.0), covariance=unknown),
    )
    yield Sent(ODOMETRY, types.ODOMETRY, message)


def _operator_pose(stamp_ns: int, posed: Any) -> Iterator[Sent]:
    message = new(types.POSE_STAMPED, header=header(stamp_ns, posed.frame_id), pose=_pose(posed.pose))
    yield Sent(OPERATOR_POSE, types.POSE_STAMPED, message)


def _command(stamp_ns: int, command: Any) -> Iterator[Sent]:
    stamped = header(stamp_ns, FRAME_BASE)
    twist = _twist(command.linear_mps, command.angular_radps)
    yield Sent(TWIST, types.TWIST_STAMPED, new(types.TWIST_STAMPED, header=stamped, twist=twist))
    decision = new(
        types.MOTION_COMMAND,
        header=stamped,
        motion=command.motion,
        linear_mps=command.linear_mps,
        angular_radps=command.angular_radps,
        driver=command.driver,
        mode=command.mode,
        intervention=command.intervention,
        expert=command.expert if command.HasField("expert") else types.NO_EXPERT,
    )
    yield Sent(DECISION, types.MOTION_COMMAND, decision)


def _operator_state(stamp_ns: int, state: Any) -> Iterator[Sent]:
    message = new(
        types.OPERATOR_STATE,
        header=header(stamp_ns, ""),
        gesture=state.gesture,
        commanded_mode=state.commanded_mode,
        behaviour=state.behaviour,
    )
    yield Sent(OPERATOR_STATE, types.OPERATOR_STATE, message)


def _log(stamp_ns: int, entry: Any) -> Iterator[Sent]:
    message = new(
        types.LOG,
        stamp=types.time_of(stamp_ns),
        level=entry.level * LEVEL_STEP,
        name=entry.name,
        msg=entry.message,
        file=entry.file,
        function="",
        line=entry.line,
    )
    yield Sent(SESSION_LOG, types.LOG, message)


def _vector(vector: Any) -> Any:
    return new("geometry_msgs/msg/Vector3", x=vector.x, y=vector.y, z=vector.z)


def _quaternion(turn: Any) -> Any:
    return new("geometry_msgs/msg/Quaternion", x=turn.x, y=turn.y, z=turn.z, w=turn.w)


def _pose(pose: Any) -> Any:
    place = new("geometry_msgs/msg/Point", x=pose.position.x, y=pose.position.y, z=pose.position.z)
    return new("geometry_msgs/msg/Pose", position=place, orientation=_quaternion(pose.orientation))


def _twist(linear_mps: float, angular_radps: float) -> Any:
    linear = new("geometry_msgs/msg/Vector3", x=linear_mps, y=0.0, z=0.0)
    angular = new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=angular_radps)
    return new(types.TWIST, linear=linear, angular=angular)


_CONVERTERS: Final[dict[str, Callable[[int, Any], Iterator[Sent]]]] = {
    topics.LIDAR_SCAN: _scan,
    topics.CAMERA_IMAGE: _image,
    topics.CAMERA_CALIBRATION: _calibration,
    topics.TRANSFORM: _transform,
    topics.ODOMETRY: _odometry,
    topics.OPERATOR_POSE: _operator_pose,
    topics.COMMAND: _command,
    topics.OPERATOR_STATE: _operator_state,
    topics.SESSION_LOG: _log,
}
