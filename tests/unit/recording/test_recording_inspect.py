from pathlib import Path

import cv2
import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from recording_samples import CONFIG, INFO, T0, image, one_of_each, scan, write
from timing_samples import MS_NS, Stream, together

from sdt_tools.errors import DiskRefusedError, OutputExistsError, RecordingError
from sdt_tools.frames import Odometry, Pose2D, Received
from sdt_tools.recording.inspect import InspectReport, draw_timing, inspect_recording
from sdt_tools.recording.live.drivers import ExpertDriver
from sdt_tools.recording.live.scene_session import SceneRecordingConfig, record_scene
from sdt_tools.recording.messages.schemas import schema_data
from sdt_tools.recording.repair import repair_recording
from sdt_tools.recording.writer import RecordingWriter


def test_a_recording_at_a_glance(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [scan(n) for n in range(101)] + [image(n) for n in range(31)])
    report = inspect_recording(path)
    assert report.duration_s == 2.0
    assert report.messages == 132
    assert not report.truncated
    assert report.size_bytes == path.stat().st_size
    assert report.config_toml == CONFIG
    assert {name: (t.count, round(t.hz or 0, 3)) for name, t in report.topics.items()} == {
        "/camera/image": (31, 30.0),
        "/lidar/scan": (101, 50.0),
    }


def test_the_document_has_what_machines_ask_for(tmp_path: Path) -> None:
    document = inspect_recording(write(tmp_path / "r.mcap", one_of_each())).document()
    assert {"duration_s", "truncated", "topics", "messages", "session", "stats", "config"} <= set(document)
    topics = document["topics"]
    assert isinstance(topics, dict)
    assert topics["/tf"].items() >= {"schema": "foxglove.FrameTransform", "count": 1, "hz": None, "drops": 0}.items()
    assert all({"count", "hz", "gaps", "max_gap_ms", "drops"} <= set(topic) for topic in topics.values())
    pairs = document["pairs"]
    assert isinstance(pairs, dict)
    assert {"count", "skew_ms_p50", "skew_ms_p99", "unpaired"} <= set(pairs)
    assert document["health"] in ("good", "fair", "poor")


def test_summary_and_counting_agree(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    messages = [m for n in range(80) for m in (scan(n), image(n))]
    shuffled = [messages[place] for place in rng.permutation(len(messages))]
    path = write(tmp_path / "r.mcap", shuffled, chunk_bytes=25_000)
    indexed = inspect_recording(path)
    path.write_bytes(path.read_bytes()[:-20])  # without its summary the file has to be counted
    counted = inspect_recording(path)
    assert counted.truncated
    assert counted.topics == indexed.topics
    assert indexed.topics["/lidar/scan"].first_ns == T0
    assert counted.session == indexed.session


def test_the_first_message_is_found_where_chunks_overlap(tmp_path: Path) -> None:
    def odometry(received_ns: int) -> Received:
        return Received(T0 + received_ns, Odometry(T0, Pose2D(0.0, 0.0, 0.0)))

    def late(received_ns: int) -> Received:
        return Received(T0 + received_ns, scan(0).message)

    path = write(tmp_path / "r.mcap", [odometry(0), late(10), odometry(1), late(5), odometry(7)], chunk_bytes=4000)
    topic = inspect_recording(path).topics["/lidar/scan"]
    assert (topic.count, topic.first_ns, topic.last_ns) == (2, T0 + 5, T0 + 10)


def test_damage_shows_where_it_is_met(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [image(n) for n in range(40)], chunk_bytes=20_000)
    data = bytearray(path.read_bytes()[:-20])
    data[data.index(np.random.default_rng(15).bytes(3000)) + 100] ^= 1
    path.write_bytes(data)
    report = inspect_recording(path)
    assert len(report.damage) == 1
    assert report.topics["/camera/image"].count < 40


def test_an_empty_recording_is_one(tmp_path: Path) -> None:
    report = inspect_recording(write(tmp_path / "r.mcap", []))
    assert (report.duration_s, report.messages, dict(report.topics)) == (0.0, 0, {})


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such recording"):
        inspect_recording(tmp_path / "missing.mcap")


def scene(path: Path) -> Path:
    """A second of the scene, with its camera."""
    config = SceneRecordingConfig(scenario="plain", seed=5, seconds=1.0)
    record_scene(config, path, lambda _, source: ExpertDriver(source.expert))
    return path


ROUGH = together(
    Stream(20e6, 12 * MS_NS, 300_000, 2 * MS_NS, 60.0, missing={50, 51, 52, *range(200, 230)}).scans(12),
    Stream(1e9 / 30, 30 * MS_NS, MS_NS, 4 * MS_NS, -20.0, missing={100, 170}, seed=1).images(12),
)


def numbers(report: InspectReport) -> dict[str, object]:
    """All that is said of messages."""
    said = report.document()
    return {key: said[key] for key in ("duration_s", "messages", "topics", "pairs", "health", "health_reasons")}


def test_counting_a_scene_again_agrees_with_its_stats(tmp_path: Path) -> None:
    path = scene(tmp_path / "r.mcap")
    noted, counted = inspect_recording(path), inspect_recording(path, full=True)
    assert (noted.counted, counted.counted) == (False, True)
    assert counted.disagreements == ()
    assert numbers(counted) == numbers(noted)
    assert noted.health == "good"
    pairs = noted.document()["pairs"]
    assert isinstance(pairs, dict)
    assert (pairs["count"], pairs["unpaired"], round(pairs["skew_ms_p50"], 2)) == (30, 0, 6.67)


@pytest.mark.parametrize("chunk_bytes", [20_000, 1 << 20])
def test_counting_rough_timing_again_agrees_with_its_stats(tmp_path: Path, chunk_bytes: int) -> None:
    path = write(tmp_path / "r.mcap", ROUGH, chunk_bytes=chunk_bytes)
    noted, counted = inspect_recording(path), inspect_recording(path, full=True)
    assert counted.disagreements == ()
    assert numbers(counted) == numbers(noted)
    scans = noted.topic_document("/lidar/scan")
    assert (scans["gaps"], scans["missing"], scans["drops"], scans["dropped"]) == (2, 33, 33, 0)


def test_a_closed_file_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "r.mcap", ROUGH)
    counted = inspect_recording(path, full=True)

    def refuse(*_: object) -> None:
        raise AssertionError("a chunk was read")

    monkeypatch.setattr("sdt_tools.recording.container.reader.read_segment", refuse)
    assert numbers(inspect_recording(path)) == numbers(counted)


def test_a_cut_off_file_is_counted(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", ROUGH)
    whole = inspect_recording(path)
    path.write_bytes(path.read_bytes()[:-20])
    cut = inspect_recording(path)
    assert (cut.truncated, cut.counted) == (True, True)
    assert cut.timing == whole.timing
    assert "it was cut off; sdt repair finishes it" in [reason.text for reason in cut.reasons]


def test_a_repaired_file_has_the_stats_of_what_was_saved(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", ROUGH, chunk_bytes=20_000)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    repair_recording(path, tmp_path / "new.mcap")
    repaired = inspect_recording(tmp_path / "new.mcap", full=True)
    assert repaired.messages < len(ROUGH)
    assert repaired.disagreements == ()
    assert not inspect_recording(tmp_path / "new.mcap").counted


def test_stats_that_are_wrong_are_named(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", ROUGH)
    data = path.read_bytes()
    path.write_bytes(data.replace(b'"gaps":2,"missing":33', b'"gaps":0,"missing":33'))  # metadata has no checksum
    assert inspect_recording(path).topic_document("/lidar/scan")["gaps"] == 0
    counted = inspect_recording(path, full=True)
    assert counted.disagreements == ("/lidar/scan: gaps is 0 by the stats, 2 by the messages",)
    assert counted.topic_document("/lidar/scan")["gaps"] == 2
    assert counted.health == "poor"


def test_a_damaged_chunk_shows_when_all_is_counted(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", [scan(n) for n in range(400)], chunk_bytes=400_000)
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 0xFF
    path.write_bytes(data)
    assert inspect_recording(path).topics["/lidar/scan"].count == 400
    counted = inspect_recording(path, full=True)
    found = counted.topics["/lidar/scan"].count
    assert found < 400
    assert f"/lidar/scan: the summary counts 400 messages, the file holds {found}" in counted.disagreements
    assert [reason.text for reason in counted.reasons if "damaged" in reason.text] == [
        "a stretch is damaged and unreadable"
    ]


def test_what_the_recorder_dropped_is_told_beside_what_is_missing(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "r.mcap", INFO, CONFIG) as writer:
        for received in Stream(20e6, missing=range(10, 13)).scans(2):
            writer.write(received)
        writer.note({"dropped./lidar/scan": "5", "dropped./camera/image": "none"})
    topic = inspect_recording(tmp_path / "r.mcap").topic_document("/lidar/scan")
    assert (topic["drops"], topic["dropped"], topic["missing"]) == (5, 5, 3)  # two after the last one that was kept


def test_a_pause_is_no_gap(tmp_path: Path) -> None:
    pause = range(T0 + 500 * MS_NS, T0 + 1500 * MS_NS)
    messages = [m for m in Stream(20e6, 5 * MS_NS, missing={20}).scans(3) if m.received_ns not in pause]
    with RecordingWriter(tmp_path / "r.mcap", INFO, CONFIG) as writer:
        for received in messages:
            writer.write(received)
        writer.note({"pauses_ns": f"{pause.start}-{pause.stop}"})
    noted, counted = (inspect_recording(tmp_path / "r.mcap", full) for full in (False, True))
    topic = noted.topic_document("/lidar/scan")
    assert (topic["gaps"], topic["missing"], topic["max_gap_ms"]) == (1, 1, 40.0)
    assert counted.disagreements == ()
    assert counted.timing == noted.timing
    draw_timing(noted, tmp_path / "timing.png")


@pytest.mark.parametrize("chunked", [True, False])
def test_a_recording_by_others_is_counted(tmp_path: Path, chunked: bool) -> None:
    with (tmp_path / "r.mcap").open("wb") as file:
        others = Writer(file, compression=CompressionType.ZSTD, use_chunking=chunked)
        others.start()
        schema = others.register_schema("foxglove.LaserScan", "protobuf", schema_data("foxglove.LaserScan"))
        channel = others.register_channel("/lidar/scan", "protobuf", schema)
        for received_ns, stamp_ns in Stream(20e6, 5 * MS_NS, missing={20, 30, 31}).times(2):
            others.add_message(channel, received_ns, b"not even a scan", stamp_ns)
        others.finish()
    report = inspect_recording(tmp_path / "r.mcap")
    topic = report.topic_document("/lidar/scan")
    assert report.counted
    assert (topic["count"], topic["gaps"], topic["missing"], topic["delay_ms_p50"]) == (97, 2, 3, 5.0)


def test_the_same_messages_give_the_same_bytes(tmp_path: Path) -> None:
    one, two = (write(tmp_path / name, ROUGH).read_bytes() for name in ("one", "two"))
    assert one == two


def test_timing_is_drawn_and_never_over_another_picture(tmp_path: Path) -> None:
    report = inspect_recording(write(tmp_path / "r.mcap", ROUGH))
    draw_timing(report, tmp_path / "timing.png")
    picture = cv2.imread(str(tmp_path / "timing.png"))
    assert picture is not None
    assert picture.std() > 10
    assert sorted(file.name for file in tmp_path.iterdir()) == ["r.mcap", "timing.png"]
    with pytest.raises(OutputExistsError, match="exists already"):
        draw_timing(report, tmp_path / "timing.png")
    draw_timing(report, tmp_path / "new" / "timing.png")
    with pytest.raises(DiskRefusedError, match=r"cannot be written: (Not a directory|File exists)"):
        draw_timing(report, tmp_path / "r.mcap" / "timing.png")


@pytest.mark.parametrize("messages", [[], one_of_each(), [image(n) for n in range(9)]])
def test_there_is_a_picture_of_any_recording(tmp_path: Path, messages: list[Received]) -> None:
    draw_timing(inspect_recording(write(tmp_path / "r.mcap", messages)), tmp_path / "timing.png")
    assert (tmp_path / "timing.png").stat().st_size > 1000
