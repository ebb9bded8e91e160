from pathlib import Path

import numpy as np
import pytest
from recording_samples import CONFIG, T0, image, one_of_each, scan, write

from sdt_tools.errors import RecordingError
from sdt_tools.frames import Odometry, Pose2D, Received
from sdt_tools.recording.inspect import inspect_recording


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
    assert topics["/tf"] == {"schema": "foxglove.FrameTransform", "count": 1, "hz": None}


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
