import math

import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from recording_samples import T0, one_of_each, scan

from sdt_tools.errors import RecordingError
from sdt_tools.frames import (
    FrameTransform,
    Gesture,
    LidarScan,
    LogEntry,
    LogLevel,
    Mode,
    MotionClass,
    MotionCommand,
    Odometry,
    Pose2D,
    Twist,
)
from sdt_tools.recording.messages.codec import decode, encode
from sdt_tools.recording.messages.schemas import message_class
from sdt_tools.recording.messages.topics import TOPIC_BY_NAME, TOPICS, topic_of
from sdt_tools.recording.messages.wire import varint
from sdt_tools.recording.scan_kernel import find_ranges


def test_topics_and_schemas_are_those_of_the_format() -> None:
    assert {topic.name: topic.schema for topic in TOPICS} == {
        "/lidar/scan": "foxglove.LaserScan",
        "/camera/image": "foxglove.CompressedImage",
        "/camera/calibration": "foxglove.CameraCalibration",
        "/tf": "foxglove.FrameTransform",
        "/robot/odometry": "foxglove.PoseInFrame",
        "/operator/pose": "foxglove.PoseInFrame",
        "/robot/command": "sdt.MotionCommand",
        "/operator/state": "sdt.OperatorState",
        "/session/log": "foxglove.Log",
    }


@pytest.mark.parametrize(
    ("schema", "fields"),
    [
        (
            "sdt.MotionCommand",
            ["timestamp", "motion", "linear_mps", "angular_radps", "driver", "mode", "intervention", "expert"],
        ),
        ("sdt.OperatorState", ["timestamp", "gesture", "commanded_mode", "behaviour"]),
    ],
)
def test_our_own_schemas_number_their_fields_from_one_in_order(schema: str, fields: list[str]) -> None:
    assert [(field.name, field.number) for field in message_class(schema).DESCRIPTOR.fields] == [
        (name, number) for number, name in enumerate(fields, start=1)
    ]


def test_our_enums_carry_our_names_and_numbers() -> None:
    motion = message_class("sdt.MotionCommand").DESCRIPTOR.fields_by_name["motion"].enum_type
    gesture = message_class("sdt.OperatorState").DESCRIPTOR.fields_by_name["gesture"].enum_type
    assert {value.name: value.number for value in motion.values} == {f"MOTION_{m.name}": m.value for m in MotionClass}
    assert {value.name: value.number for value in gesture.values} == {f"GESTURE_{g.name}": g.value for g in Gesture}


def test_a_scan_is_the_bytes_that_protobuf_would_write() -> None:
    message = scan(5).message
    assert isinstance(message, LidarScan)
    expected = LaserScan(frame_id="lidar", start_angle=message.start_angle_rad, end_angle=message.end_angle_rad)
    expected.timestamp.seconds, expected.timestamp.nanos = divmod(message.stamp_ns, 1_000_000_000)
    expected.ranges.extend(message.ranges_m)
    assert encode(message) == expected.SerializeToString()


@pytest.mark.parametrize("received", one_of_each(), ids=lambda received: type(received.message).__name__)
def test_each_kind_comes_back_with_the_stamp_of_the_container(received) -> None:
    message = received.message
    topic = topic_of(message)
    back = decode(topic.name, topic.schema, encode(message), message.stamp_ns + 7)
    assert type(back) is type(message)
    assert back.stamp_ns == message.stamp_ns + 7


def scan_in_another_layout(layout: str) -> tuple[LidarScan, bytes]:
    message = scan(3).message
    assert isinstance(message, LidarScan)
    doubles = message.ranges_m.tobytes()
    angles = b"\x21" + np.float64(message.start_angle_rad).tobytes() + b"\x29" + np.float64(-1.0).tobytes()
    half = 300 * 8
    if layout == "one field a range":
        body = b"".join(b"\x31" + doubles[at : at + 8] for at in range(0, len(doubles), 8))
    elif layout == "ranges in two parts":
        body = b"\x32" + varint(half) + doubles[:half] + b"\x32" + varint(len(doubles) - half) + doubles[half:]
    elif layout == "intensities after":
        body = b"\x32" + varint(len(doubles)) + doubles + b"\x3a" + varint(len(doubles)) + doubles
    elif layout == "an unknown field of a high number":
        body = b"\xf8\x07\x05" + b"\x32" + varint(len(doubles)) + doubles
    else:
        body = b"\x32" + varint(len(doubles)) + doubles + b"\x12\x05lidar" + angles
        return message, body
    return message, b"\x12\x05lidar" + angles + body


@pytest.mark.parametrize(
    "layout",
    [
        "one field a range",
        "ranges in two parts",
        "intensities after",
        "an unknown field of a high number",
        "ranges first",
    ],
)
def test_a_scan_is_read_in_every_layout_that_protobuf_allows(layout: str) -> None:
    message, data = scan_in_another_layout(layout)
    back = decode("/lidar/scan", "foxglove.LaserScan", data, 1)
    assert isinstance(back, LidarScan)
    assert np.array_equal(back.ranges_m, message.ranges_m)
    assert (back.start_angle_rad, back.end_angle_rad, back.frame_id) == (message.start_angle_rad, -1.0, "lidar")


def test_a_scan_of_other_rays_decodes() -> None:
    message = scan(1, rays=1081).message
    assert isinstance(message, LidarScan)
    back = decode("/lidar/scan", "foxglove.LaserScan", encode(message), message.stamp_ns)
    assert isinstance(back, LidarScan)
    assert np.array_equal(back.ranges_m, message.ranges_m)


def test_ranges_of_a_decoded_scan_cannot_be_changed() -> None:
    back = decode("/lidar/scan", "foxglove.LaserScan", encode(scan(1).message), 1)
    assert isinstance(back, LidarScan)
    with pytest.raises(ValueError, match="read-only"):
        back.ranges_m[0] = 1.0


@pytest.mark.parametrize("expert", [None, *MotionClass])
def test_no_expert_is_another_thing_than_an_expert_who_stays(expert: MotionClass | None) -> None:
    command = MotionCommand(T0, MotionClass.FORWARD, Twist(0.5, 0.0), "policy:x", Mode.IDLE, True, expert)
    assert decode("/robot/command", "sdt.MotionCommand", encode(command), T0) == command


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -3.1, math.pi, 4.0, -7.0])
def test_a_yaw_comes_back_as_the_same_direction(yaw_rad: float) -> None:
    back = decode("/robot/odometry", "foxglove.PoseInFrame", encode(Odometry(T0, Pose2D(0.0, 0.0, yaw_rad))), T0)
    assert isinstance(back, Odometry)
    assert abs(back.pose.yaw_rad) <= math.pi
    assert math.remainder(back.pose.yaw_rad - yaw_rad, 2 * math.pi) == pytest.approx(0.0, abs=1e-12)


def test_a_transform_keeps_its_quaternion() -> None:
    turned = FrameTransform(T0, "base_link", "camera", (0.1, 0.0, 0.8), (-0.5, 0.5, -0.5, 0.5))
    assert decode("/tf", "foxglove.FrameTransform", encode(turned), T0) == turned


@pytest.mark.parametrize(("number", "level"), [(0, LogLevel.INFO), (1, LogLevel.DEBUG), (5, LogLevel.ERROR)])
def test_levels_of_others_become_ours(number: int, level: LogLevel) -> None:
    log = message_class("foxglove.Log")()
    log.level = number
    back = decode("/session/log", "foxglove.Log", log.SerializeToString(), T0)
    assert isinstance(back, LogEntry)
    assert back.level is level


@pytest.mark.parametrize("topic", sorted(TOPIC_BY_NAME))
def test_damaged_data_is_said_to_be_damaged(topic: str) -> None:
    with pytest.raises(RecordingError, match=rf"^{topic} at 5 ns: not a valid .*; the data is damaged$"):
        decode(topic, TOPIC_BY_NAME[topic].schema, b"\xff\xff\xff", 5)


@pytest.mark.parametrize("cut", [1, 9, 20, 40, 4000])
def test_a_scan_that_is_cut_is_damaged(cut: int) -> None:
    with pytest.raises(RecordingError, match="damaged"):
        decode("/lidar/scan", "foxglove.LaserScan", encode(scan(0).message)[:-cut], 5)


@pytest.mark.parametrize("data", [b"\x32\x80", b"\x32", b"\x32\x08\x00", b"\x21\x00", b"\x32\xff\xff\xff\xff\xff\x0f"])
def test_compiled_code_leaves_what_is_cut_to_protobuf(data: bytes) -> None:
    assert find_ranges(np.frombuffer(data, np.uint8), 0, len(data)) == (-1, 0)


def test_a_motion_that_does_not_exist_is_damage() -> None:
    with pytest.raises(RecordingError, match="9 is not a valid MotionClass"):
        decode("/robot/command", "sdt.MotionCommand", b"\x10\x09", 5)


@pytest.mark.parametrize(
    ("topic", "schema"), [("/other", "foxglove.LaserScan"), ("/lidar/scan", "sensor_msgs/LaserScan")]
)
def test_topics_and_schemas_of_others_are_refused(topic: str, schema: str) -> None:
    with pytest.raises(RecordingError, match="not a topic and schema"):
        decode(topic, schema, b"", 5)
