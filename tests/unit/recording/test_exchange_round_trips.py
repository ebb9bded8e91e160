"""What goes out comes back equal: to the byte of every message, to the nanosecond of every stamp."""

import struct
import tracemalloc
from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from exchange_samples import as_it_lies, full_recording
from hypothesis import given, settings
from hypothesis import strategies as st
from recording_samples import T0, image, read_by_mcap, write
from rosbags.highlevel import AnyReader
from ruamel.yaml import YAML

from sdt_tools.errors import OutputExistsError, RecordingError
from sdt_tools.frames import FrameTransform, LidarScan, LogEntry, LogLevel, MotionClass, MotionCommand, Received, Twist
from sdt_tools.recording.container.file import McapFile
from sdt_tools.recording.exchange.parquet.exporting import export_parquet
from sdt_tools.recording.exchange.parquet.importing import import_parquet
from sdt_tools.recording.exchange.ros2.exporting import export_ros2
from sdt_tools.recording.exchange.ros2.importing import import_ros2
from sdt_tools.recording.exchange.ros2.inward import Taking
from sdt_tools.recording.exchange.ros2.routes import Wanted
from sdt_tools.recording.reader import Recording

DEFAULT = (Wanted(), Taking())
SAMPLES = sorted((Path(__file__).parents[3] / "recordings").glob("*.mcap"))


@pytest.mark.parametrize("out", ["bag", "bag.mcap"])
def test_ros2_and_back_every_byte_is_equal(tmp_path: Path, out: str) -> None:
    there = full_recording(tmp_path / "r.mcap")
    export_ros2(there, tmp_path / out)
    import_ros2(tmp_path / out, tmp_path / "back.mcap", *DEFAULT)
    assert as_it_lies(tmp_path / "back.mcap") == as_it_lies(there)


def test_parquet_and_back_every_byte_is_equal(tmp_path: Path) -> None:
    there = full_recording(tmp_path / "r.mcap")
    export_parquet(there, tmp_path / "folder")
    import_parquet(tmp_path / "folder", tmp_path / "back.mcap")
    assert as_it_lies(tmp_path / "back.mcap") == as_it_lies(there)


def untimed(path: Path) -> tuple[list[tuple[str, int, int, bytes]], dict[str, dict[str, str]]]:
    """What lies in ``path``, without timing: the samples are older than that."""
    messages, metadata = as_it_lies(path)
    stats = {name: text for name, text in metadata["sdt.stats"].items() if not name.startswith("timing.")}
    return messages, metadata | {"sdt.stats": stats}


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda path: path.stem)
def test_the_samples_come_back_as_they_went(tmp_path: Path, sample: Path) -> None:
    export_ros2(sample, tmp_path / "bag")
    import_ros2(tmp_path / "bag", tmp_path / "ros2.mcap", *DEFAULT)
    export_parquet(sample, tmp_path / "folder")
    import_parquet(tmp_path / "folder", tmp_path / "parquet.mcap")
    assert untimed(tmp_path / "ros2.mcap") == untimed(sample)
    assert untimed(tmp_path / "parquet.mcap") == untimed(sample)
    with Recording.open(sample) as there, Recording.open(tmp_path / "ros2.mcap") as back:
        assert back.recording_id == there.recording_id
        assert back.config_toml == there.config_toml


@settings(max_examples=15, deadline=None)
@given(
    some=st.lists(st.floats(0, 60), min_size=1, max_size=20),
    linear=st.floats(-1e6, 1e6),
    stamp_ns=st.integers(1, 2**31 * 10**9 - 1),
    delay_ns=st.integers(0, 10**18),
)
def test_parquet_keeps_the_bits_of_any_number_and_ros2_those_of_float32(
    tmp_path_factory: pytest.TempPathFactory, some: list[float], linear: float, stamp_ns: int, delay_ns: int
) -> None:
    folder = tmp_path_factory.mktemp("bits")
    scan = LidarScan(stamp_ns, np.resize(np.array(some), 541))
    command = MotionCommand(stamp_ns, MotionClass.STAY, Twist(linear, -linear / 3), "keyboard")
    there = write(folder / "r.mcap", [Received(stamp_ns + delay_ns, scan), Received(stamp_ns + delay_ns, command)])
    export_parquet(there, folder / "p")
    import_parquet(folder / "p", folder / "p.mcap")
    assert as_it_lies(folder / "p.mcap") == as_it_lies(there)

    export_ros2(there, folder / "b")
    import_ros2(folder / "b", folder / "b.mcap", *DEFAULT)
    assert as_it_lies(folder / "b.mcap")[0][1:] == as_it_lies(there)[0][1:]
    with Recording.open(folder / "b.mcap") as back:
        series = back.scans()
    assert (series.stamps_ns[0], series.received_ns[0]) == (stamp_ns, stamp_ns + delay_ns)
    assert np.array_equal(series.ranges_m[0].astype(np.float32), scan.ranges_m.astype(np.float32))


def test_every_millimetre_comes_back_from_ros2(tmp_path: Path) -> None:
    millimetres = np.arange(541 * 120)  # up to 64.9 m
    rows = (millimetres / 1000).reshape(120, 541)
    write(tmp_path / "r.mcap", [Received(T0 + n, LidarScan(T0 + n, row)) for n, row in enumerate(rows)])
    export_ros2(tmp_path / "r.mcap", tmp_path / "bag")
    import_ros2(tmp_path / "bag", tmp_path / "back.mcap", *DEFAULT)
    with Recording.open(tmp_path / "back.mcap") as back:
        assert back.scans().ranges_m.tobytes() == rows.tobytes()


def test_rosbags_reads_our_export_with_equal_contents(tmp_path: Path) -> None:
    there = full_recording(tmp_path / "r.mcap")
    export_ros2(there, tmp_path / "bag")
    with Recording.open(there) as recording, AnyReader([tmp_path / "bag"]) as bag:
        ours = recording.scans()
        images = [received.message for received in recording.messages(["/camera/image"])]
        types = {connection.topic: connection.msgtype for connection in bag.connections}
        found = {
            topic: [
                (received_ns, bag.deserialize(data, connection.msgtype))
                for connection, received_ns, data in bag.messages(
                    [connection for connection in bag.connections if connection.topic == topic]
                )
            ]
            for topic in types
        }
    assert types["/lidar/scan"] == "sensor_msgs/msg/LaserScan"
    scans = [message for _, message in found["/lidar/scan"]]
    assert [received_ns for received_ns, _ in found["/lidar/scan"]] == list(ours.received_ns)
    assert [s.header.stamp.sec * 10**9 + s.header.stamp.nanosec for s in scans] == list(ours.stamps_ns)
    assert np.array_equal(np.stack([s.ranges for s in scans]), ours.ranges_m.astype(np.float32))
    assert scans[0].angle_min + 540 * scans[0].angle_increment == pytest.approx(np.deg2rad(135), abs=1e-5)
    assert [bytes(message.data) for _, message in found["/camera/image/compressed"]] == [i.data for i in images]
    (_, command), (_, decision) = found["/robot/command"][0], found["/robot/decision"][0]
    assert (command.twist.linear.x, command.twist.angular.z) == (-0.25, 0.9)
    assert (decision.motion, decision.driver, decision.expert) == (MotionClass.LEFT_BACKWARD, "expert", 0)
    (_, log) = found["/session/log"][0]
    assert (log.level, log.msg) == (30, "a gap")
    (_, placed) = found["/tf_static"][0]
    assert placed.transforms[0].transform.translation.x == 0.197


def test_the_mcap_package_sees_a_bag_of_ros2(tmp_path: Path) -> None:
    export_ros2(full_recording(tmp_path / "r.mcap"), tmp_path / "bag")
    assert sorted(path.name for path in (tmp_path / "bag").iterdir()) == ["bag.mcap", "metadata.yaml"]
    messages = read_by_mcap(tmp_path / "bag" / "bag.mcap")
    assert {(schema.encoding, channel.message_encoding) for schema, channel, _ in messages} == {("ros2msg", "cdr")}
    with (tmp_path / "bag" / "bag.mcap").open("rb") as file:
        assert b"ros2" in file.read(40)


def test_the_bags_metadata_are_what_rosbag2_reads(tmp_path: Path) -> None:
    """Fields of version 8, as rosbag2's own ``yaml.hpp`` asks for them."""
    export_ros2(full_recording(tmp_path / "r.mcap"), tmp_path / "bag")
    (document,) = YAML(typ="safe").load((tmp_path / "bag/metadata.yaml").read_text()).values()
    written = list(read_by_mcap(tmp_path / "bag/bag.mcap"))
    times = [message.log_time for _, _, message in written]
    about_time = {
        "starting_time": {"nanoseconds_since_epoch": min(times)},
        "duration": {"nanoseconds": max(times) - min(times)},
        "message_count": len(written),
    }
    assert document | about_time == document
    assert (document["version"], document["storage_identifier"]) == (8, "mcap")
    assert document["relative_file_paths"] == ["bag.mcap"]
    assert document["files"] == [{"path": "bag.mcap", **about_time}]
    assert (document["compression_format"], document["compression_mode"]) == ("", "")
    assert all(isinstance(text, str) for text in [document["ros_distro"], *document["custom_data"].values()])
    found = {topic["topic_metadata"]["name"]: topic for topic in document["topics_with_message_count"]}
    for _, channel, _ in written:
        topic = found[channel.topic]["topic_metadata"]
        assert topic["serialization_format"] == channel.message_encoding == "cdr"
        assert topic["type_description_hash"].startswith("RIHS01_")
        assert topic["offered_qos_profiles"] == channel.metadata["offered_qos_profiles"]
    counts = Counter(channel.topic for _, channel, _ in written)
    assert counts == {name: topic["message_count"] for name, topic in found.items()}
    (latched,) = YAML(typ="safe").load(found["/tf_static"]["topic_metadata"]["offered_qos_profiles"])
    assert (latched["durability"], latched["reliability"], latched["depth"]) == (1, 1, 1)  # rmw's transient, reliable


def test_a_scan_of_the_bag_is_plain_cdr(tmp_path: Path) -> None:
    """Read by its definition alone: four bytes of encapsulation, then fields aligned to their size."""
    export_ros2(full_recording(tmp_path / "r.mcap"), tmp_path / "bag.mcap")
    schema, _, message = next(found for found in read_by_mcap(tmp_path / "bag.mcap") if found[1].topic == "/lidar/scan")
    assert schema.name == "sensor_msgs/msg/LaserScan"
    fields = [line.split() for line in schema.data.decode().split("=====")[0].splitlines() if line]
    assert fields == [
        ["std_msgs/Header", "header"],
        *(["float32", f"angle_{name}"] for name in ("min", "max", "increment")),
        *(["float32", name] for name in ("time_increment", "scan_time", "range_min", "range_max")),
        *(["float32[]", name] for name in ("ranges", "intensities")),
    ]
    assert message.data[:4] == b"\x00\x01\x00\x00"
    body = message.data[4:]
    seconds, nanoseconds, length = struct.unpack_from("<iII", body)
    assert body[12 : 12 + length] == b"lidar\0"
    at = (12 + length + 3) // 4 * 4
    angles = struct.unpack_from("<fff", body, at)
    assert angles == pytest.approx((-0.75 * np.pi, 0.75 * np.pi, np.pi / 360), abs=1e-6)
    (rays,) = struct.unpack_from("<I", body, at + 28)
    with Recording.open(tmp_path / "r.mcap") as recording:
        first = next(m.message for m in recording.messages(["/lidar/scan"]))
    assert isinstance(first, LidarScan)
    assert seconds * 10**9 + nanoseconds == first.stamp_ns
    assert np.array_equal(np.frombuffer(body, "<f4", rays, at + 32), first.ranges_m.astype(np.float32))
    assert len(body) == at + 32 + 4 * rays + 4


def test_polars_reads_our_parquet(tmp_path: Path) -> None:
    there = full_recording(tmp_path / "r.mcap")
    export_parquet(there, tmp_path / "folder")
    frame = pl.read_parquet(tmp_path / "folder" / "lidar_scan.parquet")
    with Recording.open(there) as recording:
        ours = recording.scans()
    assert frame.schema["ranges"] == pl.Array(pl.Float64, 541)
    assert frame["ranges"].to_numpy().tobytes() == ours.ranges_m.tobytes()
    assert frame["stamp_ns"].to_list() == list(ours.stamps_ns)
    assert frame["received_ns"].to_list() == list(ours.received_ns)
    commands = pl.read_parquet(tmp_path / "folder" / "robot_command.parquet")
    assert commands["motion"].to_list() == ["MOTION_LEFT_BACKWARD"]


def test_rows_dropped_and_columns_added_by_polars_come_back(tmp_path: Path) -> None:
    export_parquet(full_recording(tmp_path / "r.mcap"), tmp_path / "folder")
    path = tmp_path / "folder" / "lidar_scan.parquet"
    frame = pl.read_parquet(path).tail(7).with_columns(quality=pl.lit(1.0)).reverse()
    frame.write_parquet(path)
    summary = import_parquet(tmp_path / "folder", tmp_path / "back.mcap")
    with Recording.open(tmp_path / "back.mcap") as recording:
        assert list(recording.scans().stamps_ns) == sorted(frame["stamp_ns"])
    assert summary.left_out == ("lidar_scan.parquet: quality",)


def test_topics_of_others_stay_behind_and_are_counted(tmp_path: Path) -> None:
    file = McapFile(tmp_path / "mixed.mcap", "test")
    ours = read_by_mcap(full_recording(tmp_path / "r.mcap"))
    schema, channel, message = next(found for found in ours if found[1].topic == "/lidar/scan")
    number = file.add_channel(channel.topic, schema.name, schema.data)
    file.add_message(number, message.log_time, message.publish_time, message.data)
    other = file.add_channel("/weather", "", b"", encoding="json")
    for n in range(3):
        file.add_message(other, n, n, b"{}")
    file.finish()
    file.close()
    assert export_ros2(tmp_path / "mixed.mcap", tmp_path / "bag").left_out == {"/weather": 3}
    assert export_parquet(tmp_path / "mixed.mcap", tmp_path / "folder").left_out == {"/weather": 3}


def test_a_recording_that_was_cut_off_goes_out_as_far_as_it_reads(tmp_path: Path) -> None:
    whole = full_recording(tmp_path / "r.mcap")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[:-2000])
    summary = export_ros2(cut, tmp_path / "bag")
    assert summary.truncated
    assert summary.messages["/lidar/scan"] > 0


@pytest.mark.parametrize("export", [export_ros2, export_parquet])
def test_what_exists_or_is_empty_is_refused_and_nothing_is_left(tmp_path: Path, export) -> None:
    there = full_recording(tmp_path / "r.mcap")
    (tmp_path / "mine").mkdir()
    with pytest.raises(OutputExistsError):
        export(there, tmp_path / "mine")
    empty = write(tmp_path / "empty.mcap", [])
    with pytest.raises(RecordingError, match=r"empty\.mcap: holds no messages; there is nothing to export"):
        export(empty, tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty.mcap", "mine", "r.mcap"]


def test_a_stamp_beyond_ros2_is_refused_and_kept_by_parquet(tmp_path: Path) -> None:
    late_ns = 2**31 * 10**9
    entry = LogEntry(late_ns, LogLevel.INFO, "the year 2038")
    there = write(tmp_path / "r.mcap", [Received(late_ns, entry)])
    with pytest.raises(RecordingError, match="ROS 2 stamps end in 2038"):
        export_ros2(there, tmp_path / "bag")
    export_parquet(there, tmp_path / "folder")
    import_parquet(tmp_path / "folder", tmp_path / "back.mcap")
    assert as_it_lies(tmp_path / "back.mcap") == as_it_lies(there)


def test_memory_stays_small_however_large_the_recording(tmp_path: Path) -> None:
    there = write(tmp_path / "r.mcap", (image(n, 1 << 20) for n in range(40)))
    tracemalloc.start()
    try:
        export_ros2(there, tmp_path / "bag")
        export_parquet(there, tmp_path / "folder")
        import_ros2(tmp_path / "bag", tmp_path / "b.mcap", Wanted(scans="none"), Taking())
        import_parquet(tmp_path / "folder", tmp_path / "p.mcap")
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak_bytes < 20 << 20


def test_a_manifest_that_is_none_and_files_that_are_damaged_are_named(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    with pytest.raises(RecordingError, match=r"folder: no such folder"):
        import_parquet(folder, tmp_path / "x.mcap")
    export_parquet(
        write(tmp_path / "r.mcap", [Received(T0, FrameTransform(T0, "a", "b", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))]),
        folder,
    )
    path, manifest = folder / "tf.parquet", folder / "manifest.json"
    good, said = path.read_bytes(), manifest.read_text()

    def refused(message: str) -> None:
        with pytest.raises(RecordingError, match=message) as error:
            import_parquet(folder, tmp_path / "x.mcap")
        assert "\n" not in str(error.value)
        assert not (tmp_path / "x.mcap").exists()

    path.write_bytes(good[: len(good) // 2])
    refused(r"tf\.parquet: not a Parquet file that can be read")
    pl.read_parquet(good).drop("rotation").write_parquet(path)
    refused(r"tf\.parquet: has no column rotation; /tf needs it")
    pl.read_parquet(good).with_columns(child_frame_id=pl.lit(5)).write_parquet(path)
    refused(r"tf\.parquet: row 0: ")
    pl.read_parquet(good).clear().write_parquet(path)
    refused(r"folder: holds no messages")
    path.unlink()
    refused(r"tf\.parquet: no such file, but the manifest names it")
    manifest.write_text(said.replace("tf.parquet", "../tf.parquet"))
    refused(r"outside of the folder")
    manifest.write_text("[]")
    refused(r"manifest\.json: not a manifest of a recording")
    manifest.unlink()
    refused(r"folder: has no manifest\.json; name a folder that `sdt export parquet` wrote")
