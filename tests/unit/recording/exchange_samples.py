"""Recordings as others see them, and bags as ROS 2 writes them."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from recording_samples import T0, image, one_of_each, read_by_mcap, scan, write
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from sdt_tools.frames import Odometry as OurOdometry
from sdt_tools.frames import Pose2D, Received

STORE = get_typestore(Stores.ROS2_JAZZY)
Timed = tuple[str, int, Any]


def as_it_lies(path: Path) -> tuple[list[tuple[str, int, int, bytes]], dict[str, dict[str, str]]]:
    """Topic, both times and bytes of every message, by the mcap package, and the metadata."""
    from mcap.reader import make_reader

    messages = [(channel.topic, m.log_time, m.publish_time, m.data) for _, channel, m in read_by_mcap(path)]
    with path.open("rb") as file:
        metadata = {record.name: record.metadata for record in make_reader(file).iter_metadata()}
    return messages, metadata


def full_recording(path: Path) -> Path:
    """A message of each kind, then scans with odd stamps and codes, pictures, and poses that turn."""
    more: list[Received] = []
    for n in range(60):
        more.append(scan(n, delay_ns=1_234_567 + n))
        more.append(Received(more[-1].received_ns, OurOdometry(T0 + n, Pose2D(0.1 * n, -1 / 3, 0.7 * n - 3))))
        if n % 3 == 0:
            more.append(image(n))
    return write(path, sorted([*one_of_each(), *more], key=lambda received: received.received_ns))


def ros(name: str, **fields: Any) -> Any:
    """A message of the type ``name``."""
    return STORE.types[name](**fields)


def header(stamp_ns: int, frame_id: str = "laser") -> Any:
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    stamp = ros("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
    return ros("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)


def laser_scan(
    stamp_ns: int = T0,
    rays: int = 541,
    first_deg: float = -135.0,
    step_deg: float = 0.5,
    ranges: Any = None,
    limits: tuple[float, float] = (0.05, 25.0),
) -> Any:
    """A sensor_msgs/LaserScan; without ``ranges`` each ray has its number in centimetres, from 1 m on."""
    values = 1 + np.arange(rays) / 100 if ranges is None else np.asarray(ranges)
    return ros(
        "sensor_msgs/msg/LaserScan",
        header=header(stamp_ns),
        angle_min=np.deg2rad(first_deg),
        angle_max=np.deg2rad(first_deg + (rays - 1) * step_deg),
        angle_increment=np.deg2rad(step_deg),
        time_increment=0.0,
        scan_time=0.02,
        range_min=limits[0],
        range_max=limits[1],
        ranges=values.astype(np.float32),
        intensities=np.zeros(0, np.float32),
    )


def twist(linear_mps: float, angular_radps: float) -> Any:
    def vector(x: float, z: float) -> Any:
        return ros("geometry_msgs/msg/Vector3", x=x, y=0.0, z=z)

    return ros("geometry_msgs/msg/Twist", linear=vector(linear_mps, 0.0), angular=vector(0.0, angular_radps))


def twist_stamped(stamp_ns: int, linear_mps: float, angular_radps: float) -> Any:
    return ros(
        "geometry_msgs/msg/TwistStamped", header=header(stamp_ns, "base"), twist=twist(linear_mps, angular_radps)
    )


def odometry(stamp_ns: int, x_m: float, y_m: float, half_yaw: tuple[float, float]) -> Any:
    position = ros("geometry_msgs/msg/Point", x=x_m, y=y_m, z=0.125)
    orientation = ros("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=half_yaw[0], w=half_yaw[1])
    pose = ros("geometry_msgs/msg/Pose", position=position, orientation=orientation)
    with_covariance = ros("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36))
    moving = ros("geometry_msgs/msg/TwistWithCovariance", twist=twist(0.1, 0.2), covariance=np.zeros(36))
    return ros(
        "nav_msgs/msg/Odometry",
        header=header(stamp_ns, "odom"),
        child_frame_id="base_link",
        pose=with_covariance,
        twist=moving,
    )


def picture(stamp_ns: int, pixels: np.ndarray, encoding: str = "rgb8", padding: int = 0) -> Any:
    """A sensor_msgs/Image whose rows are ``padding`` bytes longer than their pixels."""
    rows = pixels.reshape(len(pixels), -1).view(np.uint8)
    rows = np.pad(rows, ((0, 0), (0, padding)))
    return ros(
        "sensor_msgs/msg/Image",
        header=header(stamp_ns, "camera"),
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=rows.shape[1],
        data=rows.reshape(-1),
    )


def compressed_picture(stamp_ns: int, data: bytes, text: str) -> Any:
    return ros(
        "sensor_msgs/msg/CompressedImage",
        header=header(stamp_ns, "camera"),
        format=text,
        data=np.frombuffer(data, np.uint8),
    )


def text(value: str) -> Any:
    return ros("std_msgs/msg/String", data=value)


def write_bag(path: Path, messages: Iterable[Timed], storage: StoragePlugin = StoragePlugin.MCAP) -> Path:
    """A bag folder of ``messages``: topic, time of receipt, message."""
    with Writer(path, version=9, storage_plugin=storage) as writer:
        connections: dict[tuple[str, str], Any] = {}
        for topic, received_ns, message in messages:
            name = message.__msgtype__
            if (topic, name) not in connections:
                connections[topic, name] = writer.add_connection(topic, name, typestore=STORE)
            writer.write(connections[topic, name], received_ns, STORE.serialize_cdr(message, name))
    return path
