"""The ROS 2 messages that are read and written: the standard ones, and two of our own where there is none.

Ours, for a command with all that is known of it and for the scene's truth about the operator, come with their
definition in the bag, so that readers without the package understand them as well.
"""

from functools import cache
from typing import Any, Final

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from sdt_tools.clock import SECOND_NS

LASER_SCAN: Final = "sensor_msgs/msg/LaserScan"
IMAGE: Final = "sensor_msgs/msg/Image"
COMPRESSED_IMAGE: Final = "sensor_msgs/msg/CompressedImage"
CAMERA_INFO: Final = "sensor_msgs/msg/CameraInfo"
TWIST: Final = "geometry_msgs/msg/Twist"
TWIST_STAMPED: Final = "geometry_msgs/msg/TwistStamped"
ODOMETRY: Final = "nav_msgs/msg/Odometry"
POSE_STAMPED: Final = "geometry_msgs/msg/PoseStamped"
TF_MESSAGE: Final = "tf2_msgs/msg/TFMessage"
LOG: Final = "rcl_interfaces/msg/Log"
MOTION_COMMAND: Final = "sdt_msgs/msg/MotionCommand"
OPERATOR_STATE: Final = "sdt_msgs/msg/OperatorState"
_OLD_OPERATOR_STATE: Final = "sdt_msgs/msg/OperatorStateWithoutBehaviour"
"""What older bags hold as ``OPERATOR_STATE``."""

NO_EXPERT: Final = -1

_OWN: Final = {
    MOTION_COMMAND: """\
std_msgs/Header header
uint8 motion
float64 linear_mps
float64 angular_radps
string driver
uint8 mode
bool intervention
int8 expert
""",
    OPERATOR_STATE: """\
std_msgs/Header header
uint8 gesture
uint8 commanded_mode
string behaviour
""",
    _OLD_OPERATOR_STATE: """\
std_msgs/Header header
uint8 gesture
uint8 commanded_mode
""",
}
"""Numbers are those of ``sdt_tools.frames``; an ``expert`` of -1 is none."""


@cache
def type_store() -> Typestore:
    """All messages that we know."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, definition in _OWN.items():
        store.register(get_types_from_msg(definition, name))
    return store


def decoded(data: bytes, type_name: str) -> Any:
    """The message of ``type_name`` that ``data`` holds. Raises SerdeError where it holds none."""
    store = type_store()
    try:
        return store.deserialize_cdr(data, type_name)
    except SerdeError:
        if type_name != OPERATOR_STATE:
            raise
        old: Any = store.deserialize_cdr(data, _OLD_OPERATOR_STATE)
        return new(
            OPERATOR_STATE,
            header=old.header,
            gesture=old.gesture,
            commanded_mode=old.commanded_mode,
            behaviour="",
        )


def new(type_name: str, **fields: object) -> Any:
    """A message of ``type_name``."""
    message: Any = type_store().types[type_name]
    return message(**fields)


def time_of(stamp_ns: int) -> Any:
    """A builtin_interfaces/Time."""
    seconds, nanoseconds = divmod(stamp_ns, SECOND_NS)
    return new("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)


def stamp_of(time: Any) -> int:
    """Nanoseconds since the epoch of a builtin_interfaces/Time."""
    return int(time.sec) * SECOND_NS + int(time.nanosec)


def header(stamp_ns: int, frame_id: str) -> Any:
    """A std_msgs/Header."""
    return new("std_msgs/msg/Header", stamp=time_of(stamp_ns), frame_id=frame_id)
