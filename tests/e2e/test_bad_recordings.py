"""Verbs over recordings, given what they cannot use: one line, exit 2, nothing made and nothing changed."""

import hashlib
import shutil
from pathlib import Path

import numpy as np
import pytest
from refusals import Sdt, assert_refused
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

SAMPLE = Path(__file__).parents[2] / "recordings/sample_practice.mcap"
STORE = get_typestore(Stores.ROS2_HUMBLE)
LASER_SCAN, TWIST = "sensor_msgs/msg/LaserScan", "geometry_msgs/msg/Twist"

TAKES_A_RECORDING = {
    "inspect": ["inspect", "{}"],
    "inspect full": ["inspect", "{}", "--full"],
    "repair": ["repair", "{}", "--out", "new.mcap"],
    "trim": ["edit", "trim", "{}", "--from", "1", "--out", "new.mcap"],
    "split": ["edit", "split", "{}", "--every", "2", "--out-dir", "parts"],
    "drop": ["edit", "drop", "{}", "--topic", "/tf", "--out", "new.mcap"],
    "merge": ["edit", "merge", "r.mcap", "{}", "--out", "new.mcap"],
    "export ros2": ["export", "ros2", "{}", "--out", "new"],
    "export parquet": ["export", "parquet", "{}", "--out", "new"],
}
MAKES_A_FILE = {
    "inspect": ["inspect", "r.mcap", "--plot"],
    "repair": ["repair", "r.mcap", "--out"],
    "trim": ["edit", "trim", "r.mcap", "--from", "1", "--out"],
    "drop": ["edit", "drop", "r.mcap", "--topic", "/tf", "--out"],
    "merge": ["edit", "merge", "r.mcap", "other.mcap", "--out"],
    "export ros2": ["export", "ros2", "r.mcap", "--out"],
    "export parquet": ["export", "parquet", "r.mcap", "--out"],
    "import lidar-csv": ["import", "lidar-csv", "drive.csv", "--hz", "25", "--out"],
    "import ros2": ["import", "ros2", "bag", "--out"],
    "import parquet": ["import", "parquet", "folder", "--out"],
}


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a recording and with much that is none."""
    shutil.copy(SAMPLE, tmp_path / "r.mcap")
    (tmp_path / "text.mcap").write_text("no recording, however long it goes on " * 9)
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "dir").mkdir()
    (tmp_path / "file").touch()
    return tmp_path


def everything(folder: Path) -> dict[str, str]:
    """What lies in ``folder``, hidden files too."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "folder"
        for path in sorted(folder.rglob("*"))
    }


def write_bag(path: Path, rays: int = 541, step_deg: float = 0.5, topics: tuple[str, ...] = ("/scan",)) -> Path:
    """A ROS 2 bag with a scan on each of ``topics`` and a twist."""
    half_rad = np.radians((rays - 1) * step_deg / 2)
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](sec=1_700_000_000, nanosec=5)
    scan = types[LASER_SCAN](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="laser"),
        angle_min=-half_rad,
        angle_max=half_rad,
        angle_increment=np.radians(step_deg),
        time_increment=0.0,
        scan_time=0.02,
        range_min=0.05,
        range_max=20.0,
        ranges=np.full(rays, 2.5, np.float32),
        intensities=np.zeros(0, np.float32),
    )
    still = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic in topics:
            connection = writer.add_connection(topic, LASER_SCAN, typestore=STORE)
            writer.write(connection, 1_700_000_000 * 10**9 + 9, STORE.serialize_cdr(scan, LASER_SCAN))
        connection = writer.add_connection("/cmd_vel", TWIST, typestore=STORE)
        twist = STORE.serialize_cdr(types[TWIST](linear=still, angular=still), TWIST)
        writer.write(connection, 1_700_000_000 * 10**9 + 7, twist)
    return path


def part_of(sdt: Sdt, recording: str, out: str) -> None:
    """A second of ``recording``."""
    assert sdt("edit", "trim", recording, "--from", 1, "--to", 2, "--out", out)[0] == 0


def assert_refused_and_harmless(sdt: Sdt, place: Path, command: list[object], *words: str) -> None:
    before = everything(place)
    assert_refused(sdt(*command), *words)
    assert everything(place) == before


@pytest.mark.parametrize("verb", TAKES_A_RECORDING)
def test_what_is_no_recording(sdt: Sdt, place: Path, verb: str) -> None:
    for given, words in (
        ("none.mcap", ["none.mcap: no such recording"]),
        ("dir", ["dir: is a folder", ".mcap"]),
        ("text.mcap", ["text.mcap: not an MCAP file", "sdt import"]),
        ("empty.mcap", ["empty.mcap: is empty"]),
    ):
        command = [word.format(given) for word in TAKES_A_RECORDING[verb]]
        assert_refused_and_harmless(sdt, place, command, *words)


@pytest.mark.parametrize("verb", MAKES_A_FILE)
def test_an_output_that_cannot_be_made(sdt: Sdt, place: Path, verb: str) -> None:
    """It exists, as a file or a folder; a file lies where its folder would be; its folder cannot be written."""
    np.savetxt(place / "drive.csv", np.full((3, 545), 2.5), fmt="%g", delimiter=",")
    if "other.mcap" in MAKES_A_FILE[verb]:
        part_of(sdt, "r.mcap", "other.mcap")
    if "bag" in MAKES_A_FILE[verb]:
        write_bag(place / "bag")
    if "folder" in MAKES_A_FILE[verb]:
        assert sdt("export", "parquet", "r.mcap", "--out", "folder")[0] == 0
    suffix = ".png" if verb == "inspect" else ".mcap"
    for name in (f"mine{suffix}", f"own{suffix}/it"):
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_text("mine")
    option = MAKES_A_FILE[verb][-1]
    for out, words in (
        (f"mine{suffix}", [f"mine{suffix} exists already; choose another {option}"]),
        (f"own{suffix}", [f"own{suffix} exists already; choose another {option}"]),
        (f"file/new{suffix}", [f"file/new{suffix}: ", "cannot be", f"choose another {option}"]),
        (f"/proc/new{suffix}", [f"/proc/new{suffix}: ", "cannot be", f"choose another {option}"]),
    ):
        assert_refused_and_harmless(sdt, place, [*MAKES_A_FILE[verb], out], *words)


def test_folders_on_the_way_to_an_output_are_made(sdt: Sdt, place: Path) -> None:
    assert sdt("repair", "r.mcap", "--out", "a/b/new.mcap")[0] == 0
    assert (place / "a/b/new.mcap").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--from", "100"], ["from 100 to the end lies outside the recording", "11.980 s"]),
        (["--to", "0"], ["lies outside the recording"]),
        (["--from", "3", "--to", "2"], ["--from 3 is not before --to 2"]),
        (["--from", "2", "--to", "2"], ["--from 2 is not before --to 2"]),
        (["--from", "soon"], ["'soon' is no moment; write seconds"]),
        (["--from", "-1"], ["'-1' is no moment"]),
        ([], ["say --from, --to or both"]),
    ],
)
def test_intervals_that_are_none(sdt: Sdt, place: Path, options: list[str], words: list[str]) -> None:
    assert_refused_and_harmless(sdt, place, ["edit", "trim", "r.mcap", *options, "--out", "new.mcap"], *words)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--at", "100"], ["--at 100 does not lie within the recording"]),
        (["--at", "3", "--at", "2"], ["--at 2 comes after --at 3"]),
        (["--every", "0"], ["--every 0: no time that a part can last"]),
        (["--every", "nan"], ["--every nan: no time that a part can last"]),
        (["--every", "inf"], ["--every inf: no time that a part can last"]),
        (["--every", "0.001"], ["more than 9999 parts"]),
        (["--every", "2", "--at", "2"], ["--at or --every, one of them"]),
        ([], ["--at or --every, one of them"]),
    ],
)
def test_parts_that_are_none(sdt: Sdt, place: Path, options: list[str], words: list[str]) -> None:
    assert_refused_and_harmless(sdt, place, ["edit", "split", "r.mcap", *options, "--out-dir", "parts"], *words)


def test_a_part_that_exists_and_a_folder_that_is_a_file(sdt: Sdt, place: Path) -> None:
    (place / "dir/r_02.mcap").write_text("mine")
    split = ["edit", "split", "r.mcap", "--every", "5", "--out-dir"]
    assert_refused_and_harmless(sdt, place, [*split, "dir"], "dir/r_02.mcap exists already; choose another --out-dir")
    assert_refused_and_harmless(sdt, place, [*split, "file"], "file/r_01.mcap: cannot be made", "--out-dir")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--topic", "/lidar/scans"], ["has no topic /lidar/scans; it has /lidar/scan,"]),
        (["--from", "100"], ["lies outside the recording"]),
        (["--from", "0"], ["no message would be left"]),
        (["--topic", "/tf", "--from", "1"], ["topics, or an interval"]),
        ([], ["say what to drop"]),
    ],
)
def test_what_cannot_be_dropped(sdt: Sdt, place: Path, options: list[str], words: list[str]) -> None:
    assert_refused_and_harmless(sdt, place, ["edit", "drop", "r.mcap", *options, "--out", "new.mcap"], *words)


def test_merges_of_one_recording(sdt: Sdt, place: Path) -> None:
    shutil.copy(place / "r.mcap", place / "copy.mcap")
    merge = ["edit", "merge", "--out", "new.mcap"]
    assert_refused_and_harmless(sdt, place, [*merge, "r.mcap"], "give two recordings or more")
    assert_refused_and_harmless(sdt, place, [*merge, "r.mcap", "copy.mcap"], "copy.mcap and r.mcap are one recording")


def test_recordings_that_overlap_are_merged_and_that_is_said(sdt: Sdt, place: Path) -> None:
    part_of(sdt, "r.mcap", "other.mcap")
    code, said = sdt("edit", "merge", "r.mcap", "other.mcap", "--out", "new.mcap")
    assert code == 0
    assert "the originals overlap from 1735689601" in said
    assert "stand in several originals and were taken once" in said


def test_the_trash(sdt: Sdt, place: Path) -> None:
    (place / "recordings").mkdir()
    shutil.move(place / "r.mcap", place / "recordings/r.mcap")
    assert sdt("edit", "trash", "put", "recordings/r.mcap", "--reason", "blurred [again]")[0] == 0
    assert "blurred [again]" in sdt("edit", "trash", "list")[1]
    restore = ["edit", "trash", "restore"]
    assert_refused_and_harmless(sdt, place, [*restore, "q"], "q: not in the trash of recordings", "sdt edit trash list")
    assert_refused_and_harmless(sdt, place, [*restore, "r", "--dir", "none"], "none: no such folder of recordings")
    (place / "recordings/r.mcap").write_text("mine")
    assert_refused_and_harmless(sdt, place, [*restore, "r"], "recordings/r.mcap exists already; move it away")
    for given in ("none.mcap", "dir"):
        assert_refused_and_harmless(sdt, place, ["edit", "trash", "put", given], f"{given}: no such recording")


def test_the_list_shows_the_whole_name_that_restore_takes(sdt: Sdt, place: Path) -> None:
    long = "a_recording_with_a_name_that_is_rather_long.mcap"
    shutil.move(place / "r.mcap", place / long)
    sdt("edit", "trash", "put", long)
    name = next((place / ".trash").iterdir()).name
    assert name in sdt("edit", "trash", "list", "--dir", ".")[1]


@pytest.mark.parametrize(
    ("bag", "options", "words"),
    [
        ("other", [], ["other: /scan at", "360 rays", "1.0000° apart", "--resample"]),
        ("none", [], ["none: no such bag"]),
        ("dir", [], ["dir: has no metadata.yaml"]),
        ("text.mcap", [], ["text.mcap: not a ROS 2 bag"]),
        ("text.db3", [], ["text.db3: not a ROS 2 bag"]),
        ("empty.mcap", [], ["empty.mcap: is empty"]),
        ("r.mcap", [], ["r.mcap: an MCAP, but not of ROS 2", "sdt inspect"]),
        ("scanless", [], ["scanless: holds no scans", "/cmd_vel", "--scan-topic none"]),
        ("two", [], ["two: several topics hold scans: /a", "/b", "--scan-topic"]),
        ("two", ["--scan-topic", "/c"], ["two: --scan-topic /c: no such topic", "/a"]),
        ("cut", [], ["cut/cut.mcap: the bag was cut off", "sdt repair cut/cut.mcap"]),
        ("two", ["--lossless", "--jpeg-quality", "50"], ["--lossless and --jpeg-quality"]),
    ],
)
def test_bags_that_cannot_be_taken(sdt: Sdt, place: Path, bag: str, options: list[str], words: list[str]) -> None:
    write_bag(place / "other", rays=360, step_deg=1.0)
    write_bag(place / "scanless", topics=())
    write_bag(place / "two", topics=("/a", "/b"))
    file = write_bag(place / "cut") / "cut.mcap"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    (place / "text.db3").write_text("no database")
    assert_refused_and_harmless(sdt, place, ["import", "ros2", bag, *options, "--out", "new.mcap"], *words)


def test_a_bag_that_was_cut_off_comes_in_when_it_is_repaired(sdt: Sdt, place: Path) -> None:
    assert sdt("export", "ros2", "r.mcap", "--out", "bag.mcap")[0] == 0
    whole = (place / "bag.mcap").read_bytes()
    (place / "cut.mcap").write_bytes(whole[: len(whole) * 3 // 4])
    assert sdt("repair", "cut.mcap", "--out", "bag_repaired.mcap")[0] == 0
    assert sdt("import", "ros2", "bag_repaired.mcap", "--out", "new.mcap")[0] == 0
    assert_refused(sdt("inspect", "bag.mcap"), "bag.mcap: holds none of our topics", "`sdt import ros2`")


def test_folders_of_parquet_that_cannot_be_taken(sdt: Sdt, place: Path) -> None:
    take = ["import", "parquet", "--out", "new.mcap"]
    for given in ("dir", "r.mcap"):
        assert_refused_and_harmless(sdt, place, [*take, given], f"{given}: has no manifest.json")
    assert_refused_and_harmless(sdt, place, [*take, "none"], "none: no such folder")
    assert sdt("export", "parquet", "r.mcap", "--out", "folder")[0] == 0
    (place / "folder/lidar_scan.parquet").write_bytes(b"")
    assert_refused_and_harmless(sdt, place, [*take, "folder"], "folder/lidar_scan.parquet: not a Parquet file")
    (place / "folder/lidar_scan.parquet").unlink()
    assert_refused_and_harmless(sdt, place, [*take, "folder"], "folder/lidar_scan.parquet: no such file")


def test_drives_that_cannot_be_taken(sdt: Sdt, place: Path) -> None:
    (place / "empty.csv").touch()
    (place / "cut.csv.gz").write_bytes(b"\x1f\x8b\x08\x00")
    for given, words in (
        ("none.csv", "none.csv: no such file"),
        ("dir", "dir: is a folder"),
        ("empty.csv", "empty.csv: holds no scans"),
        ("cut.csv.gz", "cut.csv.gz: the compressed file is cut off"),
        ("r.mcap", "r.mcap: not a text file"),
    ):
        assert_refused_and_harmless(sdt, place, ["import", "lidar-csv", given, "--hz", 25, "--out", "n.mcap"], words)
