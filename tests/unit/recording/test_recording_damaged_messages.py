"""A message that is damaged where no checksum tells it costs itself: the rest is read, and the account names it."""

import logging
from pathlib import Path

import mcap_bytes as by_hand
import numpy as np
import pytest
from mcap_bytes import channel, chunk, header, message, schema
from recording_samples import T0, read_by_mcap, scan

from sdt_tools.errors import RecordingError
from sdt_tools.frames import LidarScan, Odometry, Pose2D
from sdt_tools.recording.container.reader import Damage
from sdt_tools.recording.exchange.carried import outgoing
from sdt_tools.recording.messages.codec import encode
from sdt_tools.recording.messages.schemas import schema_data
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.repair import repair_recording

HEAD = header() + b"".join(
    schema(number, name, "protobuf", schema_data(name)) + channel(number, number, topic, "protobuf")
    for number, (topic, name) in enumerate(
        [("/lidar/scan", "foxglove.LaserScan"), ("/robot/odometry", "foxglove.PoseInFrame")], 1
    )
)
SCANS = [encode(scan(number).message) for number in range(12)]
POSE = encode(Odometry(T0, Pose2D(1.0, 2.0, 0.5)))
CUT = SCANS[3][:-100]
OTHER_RAYS = encode(LidarScan(T0, np.ones(540)))
NOT_A_SCAN = "messages on /lidar/scan that are not a valid foxglove.LaserScan"
IN_CHUNKS = [("", False), ("lz4", False), ("", True)]


def put(folder: Path, messages: list[bytes], compression: str = "", loose: bool = False, crc: int | None = 0) -> Path:
    """Two chunks without a checksum, or the same loose; a summary or not makes no difference to the messages."""
    half = len(messages) // 2
    parts = [b"".join(messages[:half]), b"".join(messages[half:])]
    times = [(T0, T0 + half - 1), (T0 + half, T0 + len(messages) - 1)]
    body = [part if loose else chunk(part, at, compression, crc=crc) for part, at in zip(parts, times, strict=True)]
    path = folder / "r.mcap"
    path.write_bytes(by_hand.file(HEAD + b"".join(body)))
    return path


def drive(damaged: dict[int, bytes]) -> list[bytes]:
    return [message(1, T0 + n, damaged.get(n, data)) for n, data in enumerate(SCANS)]


@pytest.mark.parametrize(("compression", "loose"), IN_CHUNKS)
def test_a_damaged_message_costs_itself(
    tmp_path: Path, compression: str, loose: bool, caplog: pytest.LogCaptureFixture
) -> None:
    path = put(tmp_path, drive({3: CUT, 5: b"\xff" * 40}), compression, loose)
    with Recording.open(path) as recording, caplog.at_level(logging.WARNING):
        read = [received.received_ns - T0 for received in recording.messages()]
        damage = recording.damage
        list(recording.messages())
        assert recording.damage == damage  # read again it counts once
    assert read == [0, 1, 2, 4, *range(6, 12)]
    assert damage == (Damage(T0 + 3, T0 + 5, f"2 {NOT_A_SCAN}"),)
    assert caplog.text.count("r.mcap: damaged at byte") == 1
    assert f"{NOT_A_SCAN}; the first at {T0 + 3} ns" in caplog.text


@pytest.mark.parametrize(("compression", "loose"), IN_CHUNKS)
def test_a_damaged_scan_costs_itself_in_arrays_too(tmp_path: Path, compression: str, loose: bool) -> None:
    with Recording.open(put(tmp_path, drive({3: CUT, 8: CUT}), compression, loose)) as recording:
        series = recording.scans()
        reasons = [damage.reason for damage in recording.damage]
    kept = [0, 1, 2, 4, 5, 6, 7, 9, 10, 11]
    assert list(series.received_ns - T0) == kept
    assert np.array_equal(series.ranges_m, [scan(n).message.ranges_m for n in kept])  # type: ignore[union-attr]
    assert reasons == ([f"2 {NOT_A_SCAN}"] if loose else [f"1 {NOT_A_SCAN}"] * 2)


def test_a_damaged_scan_costs_itself_where_chunks_overlap(tmp_path: Path) -> None:
    early, late = drive({3: CUT})[:8], drive({})[8:]
    body = chunk(b"".join(early[::2]), (T0, T0 + 6), crc=0) + chunk(b"".join(early[1::2]), (T0 + 1, T0 + 7), crc=0)
    path = tmp_path / "r.mcap"
    path.write_bytes(by_hand.file(HEAD + body + b"".join(late)))
    with Recording.open(path) as recording:
        assert list(recording.scans().received_ns - T0) == [0, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11]
        assert recording.damage == (Damage(T0 + 3, T0 + 3, f"1 {NOT_A_SCAN}"),)


def test_a_scan_that_lost_rays_among_others_is_damaged(tmp_path: Path) -> None:
    with Recording.open(put(tmp_path, drive({0: OTHER_RAYS, 7: OTHER_RAYS}))) as recording:
        assert len(recording.scans()) == 10
        reasons = [damage.reason for damage in recording.damage]
    assert reasons == ["1 messages on /lidar/scan whose number of rays is not 541"] * 2


def test_a_sensor_of_other_rays_is_refused_checksum_or_not(tmp_path: Path) -> None:
    messages = [message(1, T0 + n, OTHER_RAYS) for n in range(4)]
    for crc in (0, None):
        with (
            Recording.open(put(tmp_path, messages, crc=crc)) as recording,
            pytest.raises(RecordingError, match="has 540 rays, 541 expected"),
        ):
            recording.scans()


def test_a_time_that_is_none_costs_its_scan(tmp_path: Path) -> None:
    messages = drive({})
    messages[4] = message(1, T0 + 4, SCANS[4], publish_ns=2**63)
    with Recording.open(put(tmp_path, messages)) as recording:
        assert list(recording.scans().received_ns - T0) == [0, 1, 2, 3, *range(5, 12)]
        (damage,) = recording.damage
    assert damage == Damage(T0 + 4, T0 + 4, "1 messages on /lidar/scan that are stamped after the year 2262")


def test_each_topic_has_its_own_account(tmp_path: Path) -> None:
    messages = [*drive({2: CUT})[:6], *(message(2, T0 + n, POSE[:-3] if n == 9 else POSE) for n in range(6, 12))]
    with Recording.open(put(tmp_path, messages)) as recording:
        assert sum(1 for _ in recording.messages(["/robot/odometry"])) == 5
        assert [damage.reason for damage in recording.damage] == [
            "1 messages on /robot/odometry that are not a valid foxglove.PoseInFrame"
        ]
        assert sum(1 for _ in recording.messages()) == 10
        assert len(recording.damage) == 2


def test_what_is_carried_elsewhere_leaves_it_behind(tmp_path: Path) -> None:
    with Recording.open(put(tmp_path, drive({3: CUT}))) as recording:
        assert sum(1 for _ in outgoing(recording)) == 11
        assert [damage.reason for damage in recording.damage] == [f"1 {NOT_A_SCAN}"]


def test_repair_leaves_it_out_and_counts_it(tmp_path: Path) -> None:
    path, out = put(tmp_path, drive({3: CUT})), tmp_path / "new.mcap"
    report = repair_recording(path, out)
    assert report.messages == {"/lidar/scan": 11, "/robot/odometry": 0}
    assert [damage.reason for damage in report.damage] == [f"1 {NOT_A_SCAN}"]
    assert not report.sound
    assert len(read_by_mcap(out)) == 11
    with Recording.open(out) as recording:
        assert len(recording.scans()) == 11
        assert recording.damage == ()
