"""Bags of anybody, as ROS 2 writes them."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from exchange_samples import (
    STORE,
    compressed_picture,
    laser_scan,
    odometry,
    picture,
    text,
    twist,
    twist_stamped,
    write_bag,
)
from hypothesis import given
from hypothesis import strategies as st
from recording_samples import T0, write
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from sdt_tools.config import MotionConfig
from sdt_tools.errors import OutputExistsError, RecordingError, UsageError
from sdt_tools.frames import CameraImage, MotionClass, MotionCommand, Odometry, Twist
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.exchange.ros2.importing import RosImportSummary, import_ros2
from sdt_tools.recording.exchange.ros2.inward import Taking, nearest_motion
from sdt_tools.recording.exchange.ros2.pictures import LOSSLESS, PictureFormat
from sdt_tools.recording.exchange.ros2.routes import Wanted
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.repair import repair_recording

LATER = T0 + 7_654_321
SQLITE, MCAP = StoragePlugin.SQLITE3, StoragePlugin.MCAP


def bring(bag: Path, out: Path, wanted: Wanted | None = None, taking: Taking | None = None) -> RosImportSummary:
    return import_ros2(bag, out, wanted or Wanted(), taking or Taking())


def drive() -> list:
    """A robot's bag: everything that has a place, and something that has none."""
    jpeg = cv2.imencode(".jpg", np.full((8, 8, 3), 90, np.uint8))[1].tobytes()
    return [
        ("/scan", LATER, laser_scan(T0 + 1)),
        ("/image_raw/compressed", LATER + 1, compressed_picture(T0 + 2, jpeg, "rgb8; jpeg compressed bgr8")),
        ("/cmd_vel", LATER + 2, twist(0.31, -0.7)),
        ("/odom", LATER + 3, odometry(T0 + 4, 1.5, -2.25, (np.sin(0.4), np.cos(0.4)))),
        ("/chatter", LATER + 4, text("hello")),
        ("/scan", LATER + 5, laser_scan(T0 + 20_000_001)),
    ]


@pytest.mark.parametrize("storage", [SQLITE, MCAP], ids=["sqlite3", "mcap"])
@pytest.mark.parametrize("single", [False, True], ids=["folder", "file"])
def test_a_bag_comes_in_with_its_stamps(tmp_path: Path, storage: StoragePlugin, single: bool) -> None:
    bag = write_bag(tmp_path / "bag", drive(), storage)
    summary = bring(next(bag.glob("bag.*")) if single else bag, tmp_path / "r.mcap")
    with Recording.open(tmp_path / "r.mcap") as recording:
        scans = recording.scans()
        received = {type(r.message): r for r in recording.messages()}
        assert recording.session["source"] == "import"
        assert recording.stats["left_out./chatter"] == "1: its type has no place in a recording"
    assert list(scans.stamps_ns) == [T0 + 1, T0 + 20_000_001]
    assert list(scans.received_ns) == [LATER, LATER + 5]
    assert np.array_equal(scans.ranges_m[0], (100 + np.arange(541)) / 100)
    image, command, moved = received[CameraImage], received[MotionCommand], received[Odometry]
    assert (image.message.stamp_ns, image.message.format, image.message.data[:2]) == (T0 + 2, "jpeg", b"\xff\xd8")
    assert command.message.twist == Twist(0.31, -0.7)
    assert command.message.motion is MotionClass.RIGHT_FORWARD
    assert command.message.stamp_ns == command.received_ns == LATER + 2
    assert moved.message.pose.x_m == 1.5
    assert moved.message.pose.yaw_rad == pytest.approx(0.8)
    assert {topic.name: reason for topic, reason in summary.left_out.items()} == {
        "/chatter": "its type has no place in a recording"
    }
    assert summary.unstamped == {"/cmd_vel": 1}
    assert summary.scans == {"as they are": 2}


def test_the_same_bag_taken_the_same_way_is_the_same_recording(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", drive())
    ids = [bring(bag, tmp_path / f"{n}.mcap").recording_id for n in range(2)]
    other = bring(bag, tmp_path / "o.mcap", Wanted(odometry="none")).recording_id
    assert ids[0] == ids[1] != other
    assert (tmp_path / "0.mcap").read_bytes() == (tmp_path / "1.mcap").read_bytes()


def test_thinned_flipped_and_resampled_scans(tmp_path: Path) -> None:
    messages = [
        ("/scan", T0, laser_scan(T0, 1081, -135, 0.25)),
        ("/scan", T0 + 1, laser_scan(T0 + 1, 541, 135, -0.5)),
        ("/scan", T0 + 2, laser_scan(T0 + 2, 361, -90, 0.5)),
    ]
    bag = write_bag(tmp_path / "bag", messages)
    with pytest.raises(
        RecordingError, match=r"bag: /scan at \d+ ns: scans of 361 rays from -90\.00° to 90\.00°.*--resample"
    ):
        bring(bag, tmp_path / "r.mcap")
    assert not (tmp_path / "r.mcap").exists()
    summary = bring(bag, tmp_path / "r.mcap", taking=Taking(resample=True))
    with Recording.open(tmp_path / "r.mcap") as recording:
        thinned, flipped, narrow = recording.scans().ranges_m
    assert np.array_equal(thinned, (100 + 2 * np.arange(541)) / 100)
    assert np.array_equal(flipped, (640 - np.arange(541)) / 100)
    assert np.array_equal(narrow[90:451], (100 + np.arange(361)) / 100)
    assert set(narrow[:90]) | set(narrow[451:]) == {0.0}
    assert summary.scans == {"every second ray": 1, "as they are": 1, "the nearest ray": 1}
    assert summary.no_distance == pytest.approx(180 / (3 * 541))


@pytest.mark.parametrize(
    ("encoding", "make"),
    [
        ("bgr8", lambda bgr: bgr),
        ("rgb8", lambda bgr: bgr[:, :, ::-1]),
        ("bgra8", lambda bgr: np.dstack([bgr, np.full(bgr.shape[:2], 255, np.uint8)])),
        ("rgba8", lambda bgr: np.dstack([bgr[:, :, ::-1], np.full(bgr.shape[:2], 255, np.uint8)])),
    ],
)
@pytest.mark.parametrize("padding", [0, 5])
def test_raw_pictures_without_loss_keep_every_pixel(tmp_path: Path, encoding: str, make, padding: int) -> None:
    bgr = np.random.default_rng(0).integers(0, 256, (12, 10, 3), np.uint8)
    shown = picture(T0 + 3, np.ascontiguousarray(make(bgr)), encoding, padding)
    bag = write_bag(tmp_path / "bag", [("/scan", T0, laser_scan()), ("/image", T0, shown)])
    bring(bag, tmp_path / "r.mcap", taking=Taking(pictures=LOSSLESS))
    with Recording.open(tmp_path / "r.mcap") as recording:
        (received,) = recording.messages(["/camera/image"])
    assert isinstance(received.message, CameraImage)
    assert (received.message.format, received.message.stamp_ns) == ("png", T0 + 3)
    assert np.array_equal(cv2.imdecode(np.frombuffer(received.message.data, np.uint8), cv2.IMREAD_COLOR), bgr)


def test_raw_pictures_become_jpeg_of_the_quality_asked_for(tmp_path: Path) -> None:
    smooth = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8), (0, 0), 4)
    bag = write_bag(tmp_path / "bag", [("/scan", T0, laser_scan()), ("/image", T0, picture(T0, smooth, "bgr8"))])
    sizes = {}
    for quality in (40, 95):
        bring(bag, tmp_path / f"{quality}.mcap", taking=Taking(pictures=PictureFormat("jpeg", quality)))
        with Recording.open(tmp_path / f"{quality}.mcap") as recording:
            (received,) = recording.messages(["/camera/image"])
        assert isinstance(received.message, CameraImage)
        back = cv2.imdecode(np.frombuffer(received.message.data, np.uint8), cv2.IMREAD_COLOR)
        assert np.abs(back.astype(int) - smooth).mean() < 3
        sizes[quality] = len(received.message.data)
    assert sizes[40] < sizes[95]
    with pytest.raises(UsageError, match="--jpeg-quality 0"):
        PictureFormat("jpeg", 0)


def test_pictures_that_are_none_are_refused_and_cut_ones_counted(tmp_path: Path) -> None:
    depth = picture(T0, np.zeros((4, 4), np.uint16), "16UC1")
    bag = write_bag(tmp_path / "depth", [("/scan", T0, laser_scan()), ("/image", T0, depth)])
    with pytest.raises(RecordingError, match=r"/image at \d+ ns: pictures in 16UC1 cannot be taken over"):
        bring(bag, tmp_path / "r.mcap")
    cut = picture(T0, np.zeros((4, 4, 3), np.uint8))
    cut.height = 5
    bag = write_bag(tmp_path / "cut", [("/scan", T0, laser_scan()), ("/image", T0, cut)])
    assert bring(bag, tmp_path / "r.mcap").unreadable == {"/image": 1}


def test_several_topics_of_a_kind_have_to_be_chosen(tmp_path: Path) -> None:
    bag = write_bag(
        tmp_path / "bag",
        [
            ("/front/scan", T0, laser_scan(T0 + 1)),
            ("/rear/scan", T0, laser_scan(T0 + 2)),
            ("/cmd_vel", T0, twist(0.0, 0.0)),
            ("/cmd_vel_safe", T0, twist_stamped(T0 + 3, -0.4, 0.0)),
        ],
    )
    with pytest.raises(
        UsageError, match=r"several topics hold scans: /front/scan \(.*LaserScan, 1\), /rear/scan .*--scan"
    ):
        bring(bag, tmp_path / "r.mcap")
    with pytest.raises(UsageError, match=r"several topics hold commands: /cmd_vel .*/cmd_vel_safe .*--command-topic"):
        bring(bag, tmp_path / "r.mcap", Wanted(scans="/rear/scan"))
    with pytest.raises(UsageError, match=r"--scan-topic /scan: no such topic of scans; there is /front/scan"):
        bring(bag, tmp_path / "r.mcap", Wanted(scans="/scan"))
    summary = bring(bag, tmp_path / "r.mcap", Wanted(scans="/rear/scan", commands="/cmd_vel_safe"))
    with Recording.open(tmp_path / "r.mcap") as recording:
        assert list(recording.scans().stamps_ns) == [T0 + 2]
        (command,) = recording.messages(["/robot/command"])
    assert command.message.stamp_ns == T0 + 3
    assert {topic.name: reason for topic, reason in summary.left_out.items()} == {
        "/front/scan": "not the --scan-topic chosen",
        "/cmd_vel": "not the --command-topic chosen",
    }


def test_a_bag_without_scans_is_refused_unless_they_are_declined(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", [("/cmd_vel", T0, twist(0.5, 0.0))])
    with pytest.raises(
        RecordingError, match=r"bag: holds no scans .*but /cmd_vel \(.*--scan-topic none imports the rest"
    ):
        bring(bag, tmp_path / "r.mcap")
    assert bring(bag, tmp_path / "r.mcap", Wanted(scans="none")).messages == {"/robot/command": 1}


def test_messages_that_do_not_parse_are_counted_and_the_rest_comes_in(tmp_path: Path) -> None:
    with Writer(tmp_path / "bag", version=9) as writer:
        scans = writer.add_connection("/scan", "sensor_msgs/msg/LaserScan", typestore=STORE)
        writer.write(scans, T0, STORE.serialize_cdr(laser_scan(), "sensor_msgs/msg/LaserScan"))
        writer.write(scans, T0 + 1, b"\0\1\0\0 not a scan")
    summary = bring(tmp_path / "bag", tmp_path / "r.mcap")
    assert (summary.messages, summary.unreadable) == ({"/lidar/scan": 1}, {"/scan": 1})


def test_a_scan_without_a_stamp_has_that_of_its_receipt(tmp_path: Path) -> None:
    summary = bring(write_bag(tmp_path / "bag", [("/scan", LATER, laser_scan(0))]), tmp_path / "r.mcap")
    with Recording.open(tmp_path / "r.mcap") as recording:
        assert list(recording.scans().stamps_ns) == [LATER]
    assert summary.unstamped == {"/scan": 1}


@given(motion=st.sampled_from(MotionClass), off=st.floats(-0.06, 0.06), turn_off=st.floats(-0.15, 0.15))
def test_a_twist_near_that_of_a_class_is_of_it(motion: MotionClass, off: float, turn_off: float) -> None:
    motions = MotionConfig()
    own = motions.twist(motion)
    assert nearest_motion(Twist(own.linear_mps + off, own.angular_radps + turn_off), motions) is motion


def test_other_motions_class_twists_otherwise() -> None:
    slow = MotionConfig(forward_mps=0.1, backward_mps=0.1)
    assert nearest_motion(Twist(0.08, 0.0), MotionConfig()) is MotionClass.STAY
    assert nearest_motion(Twist(0.08, 0.0), slow) is MotionClass.FORWARD


def test_what_is_no_bag_is_refused_in_one_line_and_nothing_is_left(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    unindexed = write_bag(tmp_path / "unindexed", drive(), SQLITE)
    (unindexed / "metadata.yaml").unlink()
    corrupt = write_bag(tmp_path / "corrupt", drive(), SQLITE)
    (corrupt / "corrupt.db3").write_bytes(b"no database, however long this text may go on " * 200)
    late = write_bag(tmp_path / "late", drive() * 40, SQLITE)
    data = (late / "late.db3").read_bytes()
    (late / "late.db3").write_bytes(data[: len(data) // 2] + bytes(len(data) - len(data) // 2))
    cut = write_bag(tmp_path / "cut", drive())
    (cut / "cut.mcap").write_bytes((cut / "cut.mcap").read_bytes()[:-50])
    flipped = write_bag(tmp_path / "flipped", drive())
    spoilt = bytearray((flipped / "flipped.mcap").read_bytes())
    spoilt[-30:-20] = bytes(range(10))
    (flipped / "flipped.mcap").write_bytes(spoilt)
    mangled = write_bag(tmp_path / "mangled", drive())
    (mangled / "metadata.yaml").write_text("rosbag2_bagfile_information: [1, 2")
    for name, content in {"old.bag": b"#ROSBAG V2.0", "notes.txt": b"notes", "empty.db3": b""}.items():
        (tmp_path / name).write_bytes(content)
    write(tmp_path / "ours.mcap", [])
    before = sorted(tmp_path.rglob("*"))
    for name, said in {
        "missing": "no such bag; check the path",
        "folder": r"has no metadata\.yaml; name the folder of one ROS 2 bag",
        "unindexed": r"has no metadata\.yaml; name unindexed\.db3 itself, or `ros2 bag reindex` it",
        "corrupt": "a ROS 2 bag that is damaged or unfinished: .*not a database",
        "late": "a ROS 2 bag that is damaged or unfinished: .*malformed",
        "cut/cut.mcap": "the bag was cut off; finish it first with `sdt repair",
        "flipped": "a ROS 2 bag that is damaged or unfinished: Invalid MCAP",
        "mangled": "a ROS 2 bag that is damaged or unfinished: .*YAML",
        "old.bag": "a bag of ROS 1; convert it",
        "notes.txt": "not a ROS 2 bag; give its folder, or a .db3 or .mcap file",
        "empty.db3": "is empty",
        "ours.mcap": "an MCAP, but not of ROS 2",
    }.items():
        with pytest.raises(RecordingError, match=rf"{name}: {said}") as error:
            bring(tmp_path / name.split("/")[0], tmp_path / "r.mcap")
        assert "\n" not in str(error.value)
    assert sorted(tmp_path.rglob("*")) == before


def test_an_existing_output_is_left_alone(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", drive())
    (tmp_path / "r.mcap").write_text("mine")
    with pytest.raises(OutputExistsError):
        bring(bag, tmp_path / "r.mcap")
    assert (tmp_path / "r.mcap").read_text() == "mine"


@pytest.mark.parametrize("tenths", [5, 7, 9])
def test_a_bag_that_was_cut_comes_in_once_it_is_repaired(tmp_path: Path, tenths: int) -> None:
    messages = [("/scan", LATER + n, laser_scan(T0 + n * 20_000_000)) for n in range(400)]
    whole = next(write_bag(tmp_path / "bag", messages).glob("*.mcap"))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size * tenths // 10])
    with pytest.raises(RecordingError, match=r"cut off; finish it first with `sdt repair .*cut\.mcap --out NEW\.mcap`"):
        bring(cut, tmp_path / "r.mcap")
    report = repair_recording(cut, tmp_path / "repaired.mcap")
    assert 0 < report.messages["/scan"] <= 400
    with Reader(tmp_path / "repaired.mcap") as reader:
        received = [received_ns for _, received_ns, _ in reader.messages()]
    assert received == [LATER + n for n in range(report.messages["/scan"])]
    bring(tmp_path / "repaired.mcap", tmp_path / "r.mcap")
    with Recording.open(tmp_path / "r.mcap") as recording:
        assert list(recording.scans().stamps_ns) == [T0 + n * 20_000_000 for n in range(len(received))]


def test_a_bag_with_a_damaged_chunk_comes_in_once_it_is_repaired(tmp_path: Path) -> None:
    messages = [("/scan", LATER + n, laser_scan(T0 + n * 20_000_000)) for n in range(800)]
    bag = next(write_bag(tmp_path / "bag", messages).glob("*.mcap"))
    with McapReader(bag) as source:
        chunk = source.segments()[1]
    data = bytearray(bag.read_bytes())
    data[chunk.offset : chunk.offset + 100] = bytes(100)
    bag.write_bytes(data)
    with pytest.raises(RecordingError, match=r"cannot be read as a ROS 2 bag.*`sdt repair` saves what can be read"):
        bring(bag, tmp_path / "r.mcap")
    report = repair_recording(bag, tmp_path / "repaired.mcap")
    assert report.damage
    summary = bring(tmp_path / "repaired.mcap", tmp_path / "r.mcap")
    assert summary.messages["/lidar/scan"] == report.messages["/scan"]
