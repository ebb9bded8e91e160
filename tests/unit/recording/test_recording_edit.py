import json
import resource
import signal
import tracemalloc
from dataclasses import replace
from pathlib import Path

import pytest
from edit_samples import calibration, drive, foreign, metadata, recorded, tf, told, within
from mcap.reader import make_reader
from recording_samples import CONFIG, INFO, T0, image, scan, write

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import DiskRefusedError, OutputExistsError, RecordingError, UsageError
from sdt_tools.frames import Received
from sdt_tools.recording.editing.edit import edit_recordings, edit_under_way
from sdt_tools.recording.editing.plan import (
    plan_drop_interval,
    plan_drop_topics,
    plan_merge,
    plan_split,
    plan_split_every,
    plan_trim,
)
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter


def test_a_trimmed_part_holds_what_was_received_in_its_interval_to_the_bit(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    before = path.read_bytes()
    (edited,) = edit_recordings(plan_trim(path, "0.25", f"{T0 + SECOND_NS * 3 // 4}ns", tmp_path / "new.mcap"))
    own = [m for m in told(tmp_path / "new.mcap") if m[1] > T0 + SECOND_NS // 4]
    assert own == within(told(path), 0.25, 0.75)
    assert len(own) + len(edited.carried) == sum(edited.messages.values())
    assert path.read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["drive.mcap", "new.mcap"]


def test_the_end_of_an_interval_is_out_and_its_start_is_in(tmp_path: Path) -> None:
    path = write(tmp_path / "drive.mcap", [scan(number) for number in range(10)])
    edit_recordings(plan_trim(path, "0.04", "0.08", tmp_path / "new.mcap"))
    assert [log_ns - T0 for _, log_ns, _, _ in told(tmp_path / "new.mcap")] == [40_000_000, 60_000_000]


def test_what_held_before_a_part_is_carried_to_its_beginning_with_its_own_stamp(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    start_ns = T0 + SECOND_NS * 5 // 4
    edit_recordings(plan_trim(path, "1.25", None, tmp_path / "new.mcap"))
    with Recording.open(tmp_path / "new.mcap") as new:
        found = list(new.messages(["/tf", "/camera/calibration"], end_ns=start_ns + 1))
    assert {m.received_ns for m in found} == {start_ns}
    expected = [tf(T0, "camera", 9.0), tf(T0 + SECOND_NS // 2, "lidar", 0.2), calibration(T0 + SECOND_NS, 510.0)]
    assert [m.message for m in found] == [m.message for m in expected]


def test_a_dropped_interval_leaves_what_changed_in_it_after_it(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    edit_recordings(plan_drop_interval(path, "0.4", "1.2", tmp_path / "new.mcap"))
    end_ns = T0 + SECOND_NS * 6 // 5
    left = told(tmp_path / "new.mcap")
    carried = [m for m in left if m[0] in ("/tf", "/camera/calibration") and m[1] == end_ns]
    assert [(topic, publish_ns) for topic, _, publish_ns, _ in carried] == [
        ("/camera/calibration", T0 + SECOND_NS - 3),
        ("/tf", T0 + SECOND_NS // 2 - 7),
    ]
    assert sorted(set(left) - set(carried)) == sorted(within(told(path), 0, 0.4) + within(told(path), 1.2, 3))


def test_dropping_topics_leaves_the_others_untouched(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    edit_recordings(plan_drop_topics(path, ["/camera/image", "/tf"], tmp_path / "new.mcap"))
    assert told(tmp_path / "new.mcap") == [m for m in told(path) if m[0] not in ("/camera/image", "/tf")]
    with Recording.open(tmp_path / "new.mcap") as new:
        assert set(new.topics) == {"/lidar/scan", "/camera/calibration"}


def test_parts_follow_each_other_and_merge_to_the_whole(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    parts = edit_recordings(plan_split_every(path, 0.7, tmp_path / "parts"))
    names = ["drive_01.mcap", "drive_02.mcap", "drive_03.mcap"]
    assert [part.out.name for part in parts] == sorted(p.name for p in (tmp_path / "parts").iterdir()) == names
    assert parts[1].spans[0].start_ns == parts[0].spans[0].end_ns == T0 + SECOND_NS * 7 // 10
    (merged,) = edit_recordings(plan_merge([parts[n].out for n in (2, 0, 1)], tmp_path / "new.mcap"))
    assert told(tmp_path / "new.mcap") == told(path)
    assert [original.path.name for original in merged.originals] == names
    assert not merged.interleaved


def test_parts_that_overlap_hold_what_they_share_once(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    edit_recordings(plan_trim(path, None, "1.3", tmp_path / "a.mcap"))
    edit_recordings(plan_trim(path, "0.9", None, tmp_path / "b.mcap"))
    (merged,) = edit_recordings(plan_merge([tmp_path / "a.mcap", tmp_path / "b.mcap"], tmp_path / "new.mcap"))
    assert told(tmp_path / "new.mcap") == told(path)
    assert merged.shared == len(within(told(path), 0.9, 1.3))
    ((start_ns, end_ns),) = merged.document()["interleaved_ns"]
    assert T0 + SECOND_NS * 9 // 10 == start_ns < end_ns <= T0 + SECOND_NS * 13 // 10


def test_recordings_that_overlap_are_interleaved(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", [scan(number) for number in range(20)], recording_id="a")
    write(tmp_path / "b.mcap", [image(number) for number in range(2, 9)], recording_id="b")
    edit_recordings(plan_merge([tmp_path / "b.mcap", tmp_path / "a.mcap"], tmp_path / "new.mcap"))
    with Recording.open(tmp_path / "new.mcap") as new:
        stamps = [m.received_ns for m in new.messages()]
    assert stamps == sorted(stamps)
    assert told(tmp_path / "new.mcap") == sorted(told(tmp_path / "a.mcap") + told(tmp_path / "b.mcap"))


def test_different_drives_of_the_same_moments_are_not_one(tmp_path: Path) -> None:
    for name, first in (("a", 0), ("b", 1)):
        drive = [Received(T0 + n, replace(scan(n + first).message, stamp_ns=T0 + n)) for n in range(5)]
        write(tmp_path / f"{name}.mcap", drive, recording_id=name)
    with pytest.raises(RecordingError, match="different drives"):
        edit_recordings(plan_merge([tmp_path / "a.mcap", tmp_path / "b.mcap"], tmp_path / "new.mcap"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "b.mcap"]


def test_a_carried_message_stays_where_its_original_is_not(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    edit_recordings(plan_trim(path, "0", "0.3", tmp_path / "a.mcap"))
    edit_recordings(plan_trim(path, "1.2", "1.4", tmp_path / "b.mcap"))
    edit_recordings(plan_merge([tmp_path / "a.mcap", tmp_path / "b.mcap"], tmp_path / "merged.mcap"))
    edit_recordings(plan_trim(path, None, "1.4", tmp_path / "cut.mcap"))
    edit_recordings(plan_drop_interval(tmp_path / "cut.mcap", "0.3", "1.2", tmp_path / "dropped.mcap"))
    assert told(tmp_path / "merged.mcap") == told(tmp_path / "dropped.mcap")


def test_parts_of_parts_know_where_what_they_carry_came_from(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    edit_recordings(plan_trim(path, None, "0.25", tmp_path / "first.mcap"))
    edit_recordings(plan_trim(path, "0.25", None, tmp_path / "rest.mcap"))
    parts = [part.out for part in edit_recordings(plan_split(tmp_path / "rest.mcap", ["0.1", "0.2"], tmp_path))]
    edit_recordings(plan_merge(parts, tmp_path / "rest_again.mcap"))
    assert told(tmp_path / "rest_again.mcap") == told(tmp_path / "rest.mcap")
    edit_recordings(plan_merge([tmp_path / "first.mcap", *parts], tmp_path / "new.mcap"))
    assert told(tmp_path / "new.mcap") == told(path)
    edit_recordings(plan_merge([tmp_path / "first.mcap", *parts[1:]], tmp_path / "gap.mcap"))
    assert told(tmp_path / "gap.mcap") == sorted(within(told(path), 0, 0.25) + within(told(path), 0.35, 2))


def test_a_message_that_equals_the_carried_one_is_kept(tmp_path: Path) -> None:
    again = [tf(T0, "lidar", 0.1), Received(T0 + 20, tf(T0, "lidar", 0.1).message), scan(1)]
    path = write(tmp_path / "drive.mcap", again)
    parts = edit_recordings(plan_split(path, [f"{T0 + 20}ns"], tmp_path))
    edit_recordings(plan_merge([part.out for part in parts], tmp_path / "new.mcap"))
    assert told(tmp_path / "new.mcap") == told(path)


def test_the_new_recording_says_what_was_done_to_which(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    (edited,) = edit_recordings(plan_trim(path, "0.5", "1", tmp_path / "new.mcap"))
    with Recording.open(path) as old, Recording.open(tmp_path / "new.mcap") as new:
        assert new.config_toml == CONFIG
        assert new.recording_id == edited.recording_id != old.recording_id
        session = dict(old.session) | {"recording_id": new.recording_id}
        assert dict(new.session) == session
        counts = {name: str(topic.count) for name, topic in new.topics.items()}
        said = {name: value for name, value in new.stats.items() if not name.startswith("timing.")}
        assert said == {f"count.{name}": count for name, count in counts.items()} | {"seconds": "0.500"}
        said = metadata(tmp_path / "new.mcap", "sdt.edit")
        assert said["action"] == "trim"
        assert json.loads(said["spans_ns"]) == [[T0 + SECOND_NS // 2, T0 + SECOND_NS]]
        assert [o["recording_id"] for o in json.loads(said["originals"])] == [old.recording_id]


def test_the_same_edit_gives_the_same_bytes_and_another_another_id(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    for name in ("one", "two"):
        edit_recordings(plan_trim(path, "0.5", "1", tmp_path / name))
    (other,) = edit_recordings(plan_trim(path, "0.5", "1.000000001", tmp_path / "other"))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    assert other.recording_id not in (tmp_path / "one").read_bytes().decode(errors="replace")


def test_sessions_that_differ_are_both_told_and_both_configs_kept(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", [scan(1)], recording_id="a")
    with RecordingWriter(tmp_path / "b.mcap", INFO, "answer = 43\n", recording_id="b", operator="Ada") as writer:
        writer.write(scan(2))
    edit_recordings(plan_merge([tmp_path / "a.mcap", tmp_path / "b.mcap"], tmp_path / "new.mcap"))
    session = metadata(tmp_path / "new.mcap", "sdt.session")
    assert (session["scenario"], session["operator"]) == ("plain", "Ada")
    with (tmp_path / "new.mcap").open("rb") as stream:
        attached = {a.name: a.data.decode() for a in make_reader(stream).iter_attachments()}
    assert attached == {"config.toml": CONFIG, "b.config.toml": "answer = 43\n"}


def test_files_of_others_are_edited_too(tmp_path: Path) -> None:
    path = foreign(tmp_path / "theirs.mcap")
    edit_recordings(plan_trim(path, "0.5", "1", tmp_path / "new.mcap"))
    with path.open("rb") as stream:
        expected = [
            (s.name if s else "", c.topic, c.metadata, m.log_time, m.publish_time, m.data)
            for s, c, m in make_reader(stream).iter_messages()
            if T0 + SECOND_NS // 2 <= m.log_time < T0 + SECOND_NS
        ]
    with (tmp_path / "new.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        found = [
            (s.name if s else "", c.topic, c.metadata, m.log_time, m.publish_time, m.data)
            for s, c, m in reader.iter_messages()
        ]
        assert [(a.name, a.data) for a in reader.iter_attachments()] == [("notes.txt", b"hello")]
        assert {m.name for m in reader.iter_metadata()} == {"theirs", "sdt.session", "sdt.stats", "sdt.edit"}
        assert [(a.create_time, a.log_time) for a in reader.iter_attachments()] == [(1, 2)]
        assert reader.get_header().profile == "ros2"
    assert found == expected
    assert len(found) == 50


def test_a_recording_that_was_cut_off_is_edited_as_far_as_it_goes(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
    (edited,) = edit_recordings(plan_trim(path, "0.5", None, tmp_path / "new.mcap"))
    assert edited.originals[0].truncated
    with Recording.open(path) as cut, Recording.open(tmp_path / "new.mcap") as new:
        kept = [m.received_ns for m in cut.messages(start_ns=T0 + SECOND_NS // 2)]
        own = [m.received_ns for m in new.messages()][len(edited.carried) :]
        assert not new.truncated
    assert own == kept
    assert len(own) > 40


def test_a_damaged_chunk_is_named_by_the_part_that_it_belongs_to(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = recorded(tmp_path)
    with Recording.open(path) as whole:
        (chunk,) = [s for s in whole._file.segments() if s.start_ns <= T0 + SECOND_NS < s.end_ns][:1]
    data = bytearray(path.read_bytes())
    data[chunk.offset + 200] ^= 8
    path.write_bytes(data)
    parts = edit_recordings(plan_split(path, ["0.5", "1.6"], tmp_path / "parts"))
    assert [len(part.originals[0].damage) for part in parts] == [0, 1, 0]
    assert parts[1].originals[0].damage[0].start_ns == chunk.start_ns
    assert json.loads(metadata(parts[1].out, "sdt.edit")["originals"])[0]["damage"][0]["end_ns"] == chunk.end_ns


def test_parts_in_which_nothing_was_received_are_left_out(tmp_path: Path) -> None:
    path = write(tmp_path / "drive.mcap", [tf(T0, "lidar", 0.1), scan(1), scan(200)])
    parts = edit_recordings(plan_split_every(path, 1.0, tmp_path))
    assert [part.out.name for part in parts] == ["drive_01.mcap", "drive_05.mcap"]
    edit_recordings(plan_merge([part.out for part in parts], tmp_path / "new.mcap"))
    assert told(tmp_path / "new.mcap") == told(path)


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (lambda p, out: plan_trim(p, "2.5", "3", out), "lies outside the recording; it has messages from"),
        (lambda p, out: plan_trim(p, "0ns", "5ns", out), "lies outside the recording"),
        (lambda p, out: plan_trim(p, "1", "1", out), "--from 1 is not before --to 1"),
        (lambda p, out: plan_trim(p, "-1", None, out), "'-1' is no moment; write seconds from the start, as 2.5"),
        (lambda p, out: plan_trim(p, "1e99", None, out), "'1e99' is no moment"),
        (lambda p, out: plan_trim(p, "9" * 20, None, out), "beyond what a stamp can hold"),
        (lambda p, out: plan_trim(p, None, None, out), "say --from, --to or both"),
        (lambda p, out: plan_trim(p, "1.0000001", "1.0000002", out), "no message would be left"),
        (lambda p, out: plan_split(p, ["1", "0.5"], out), "--at 0.5 comes after --at 1; give the points in order"),
        (lambda p, out: plan_split(p, ["1", "1.0"], out), "--at 1.0 comes after --at 1"),
        (lambda p, out: plan_split(p, ["1", "5"], out), "--at 5 does not lie within the recording"),
        (lambda p, out: plan_split_every(p, 0.0, out), "no time that a part can last"),
        (lambda p, out: plan_split_every(p, 1e-5, out), "makes more than 9999 parts"),
        (lambda p, out: plan_drop_topics(p, ["/odom"], out), "has no topic /odom; it has /camera/calibration, "),
        (lambda p, out: plan_drop_interval(p, "0", "9", out), "no message would be left"),
        (lambda p, out: plan_merge([p], out), "give two recordings or more"),
        (lambda p, out: plan_merge([p, p.with_name("copy.mcap")], out), "are one recording"),
        (lambda p, out: plan_merge([p, p.with_name("notes.txt")], out), "not an MCAP file"),
        (lambda p, out: plan_trim(p.with_name("none.mcap"), "0", "1", out), "no such recording"),
    ],
)
def test_wrong_input_is_refused_before_anything_is_written(tmp_path: Path, plan, message: str) -> None:
    path = recorded(tmp_path)
    (tmp_path / "copy.mcap").write_bytes(path.read_bytes())
    (tmp_path / "notes.txt").write_text("no recording")
    with pytest.raises((UsageError, RecordingError)) as refused:
        plan(path, tmp_path / "new.mcap")
    assert message in str(refused.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["copy.mcap", "drive.mcap", "notes.txt"]


def test_nothing_is_written_over_even_if_it_comes_late(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    with pytest.raises(OutputExistsError):
        plan_trim(path, "0", "1", path)
    plan = plan_split(path, ["1"], tmp_path)
    with pytest.raises(OutputExistsError), edit_under_way(plan):
        (tmp_path / "drive_02.mcap").write_text("mine")
    assert (tmp_path / "drive_02.mcap").read_text() == "mine"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["drive.mcap", "drive_02.mcap"]


def test_a_disk_that_fills_leaves_nothing_behind(tmp_path: Path) -> None:
    path = write(tmp_path / "drive.mcap", (image(number, 100_000) for number in range(60)))
    plan = plan_split(path, ["1"], tmp_path)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, before[1]))
    try:
        with pytest.raises(DiskRefusedError, match=r"drive_01\.mcap.*cannot be written after .* MB: File too large"):
            edit_recordings(plan)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert [p.name for p in tmp_path.iterdir()] == ["drive.mcap"]


def test_memory_does_not_grow_with_the_recording(tmp_path: Path) -> None:
    path = write(tmp_path / "drive.mcap", (image(number, 100_000) for number in range(300)))
    tracemalloc.start()
    try:
        parts = edit_recordings(plan_split(path, ["1"], tmp_path))
        edit_recordings(plan_merge([part.out for part in parts], tmp_path / "new.mcap"))
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert path.stat().st_size > 30_000_000
    assert peak_bytes < 12_000_000


def test_the_drive_has_what_these_tests_need() -> None:
    topics = {type(received.message).__name__ for received in drive()}
    assert topics == {"LidarScan", "CameraImage", "FrameTransform", "CameraCalibration"}
