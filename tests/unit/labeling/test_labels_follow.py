from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import LabelError, OutputExistsError
from sdt_tools.frames import RAYS, CameraImage, LidarScan, Received
from sdt_tools.labeling.follow import discard_with_labels, edit_with_labels
from sdt_tools.labeling.journal import Journal, read_journal
from sdt_tools.labeling.resolve import resolve
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, journal_path
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.editing.plan import plan_drop_topics, plan_merge, plan_split, plan_trim
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.trash import restore, trashed
from sdt_tools.recording.writer import RecordingWriter

T0 = 1_735_689_600_000_000_000
LATE_NS = 5_000_000
Told = list[tuple[int, str, str, str, int]]


def stamp(number: int) -> int:
    """When scan, or image, ``number`` was taken; the host received it 5 ms later."""
    return T0 + number * SECOND_NS // 10


def recorded(path: Path, numbers: Sequence[int], recording_id: str) -> Path:
    with RecordingWriter(path, SourceInfo("scene", "plain", 0), "", recording_id=recording_id) as writer:
        for number in numbers:
            writer.write(Received(stamp(number) + LATE_NS, LidarScan(stamp(number), np.ones(RAYS))))
            writer.write(Received(stamp(number) + LATE_NS, CameraImage(stamp(number), b"picture")))
    return path


def labelled(path: Path, recording_id: str, acts: Sequence[tuple[int, str, str]]) -> Path:
    """Acts of people: the scan's number, the label, who."""
    with Journal(path, recording_id) as journal:
        for place, (number, label, labeler) in enumerate(acts):
            journal.append(
                stamp_ns=stamp(number), label=label, labeler=labeler, source=LabelSource.HUMAN, created_ns=7000 + place
            )
    return path


def told(path: Path) -> Told:
    table = read_journal(path).table
    return list(table.select("stamp_ns", "label", "labeler", "source", "created_ns").iter_rows())


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Ten scans and images, labelled by two people who changed their minds."""
    acts = [(2, "stay", "ada"), (5, "stay", "ada"), (9, "forward", "ada"), (5, "", "ada"), (5, "backward", "bob")]
    labelled(tmp_path / "labels/drive.motion.csv", "drive-id", acts)
    labelled(tmp_path / "labels/drive.gesture.csv", "drive-id", [(1, "enable", "ada"), (6, "idle", "ada")])
    return recorded(tmp_path / "drive.mcap", range(10), "drive-id")


def test_a_part_has_the_acts_about_its_frames_in_their_order(tmp_path: Path, drive: Path) -> None:
    before = [path.read_bytes() for path in sorted((tmp_path / "labels").iterdir())]
    plan = plan_trim(drive, "0.3", "0.8", tmp_path / "new.mcap")
    (edited,), journals = edit_with_labels(plan, tmp_path / "labels")
    assert told(tmp_path / "labels/new.motion.csv") == [
        (stamp(5), "stay", "ada", "human", 7001),
        (stamp(5), "", "ada", "human", 7003),
        (stamp(5), "backward", "bob", "human", 7004),
    ]
    assert told(tmp_path / "labels/new.gesture.csv") == [(stamp(6), "idle", "ada", "human", 7001)]
    assert set(read_journal(tmp_path / "labels/new.motion.csv").table["recording_id"]) == {edited.recording_id}
    assert [(j.path.name, j.acts, j.given) for j in journals] == [("new.motion.csv", 3, 5), ("new.gesture.csv", 1, 2)]
    names = [tmp_path / "labels" / f"drive.{kind}.csv" for kind in ("gesture", "motion")]
    assert [path.read_bytes() for path in names] == before
    with Recording.open(tmp_path / "new.mcap") as new:
        assert new.recording_id == edited.recording_id


def test_labels_may_lie_beside_the_recordings(tmp_path: Path) -> None:
    drive = recorded(tmp_path / "drive.mcap", range(4), "drive-id")
    labelled(tmp_path / "drive.motion.csv", "drive-id", [(1, "stay", "ada")])
    edit_with_labels(plan_trim(drive, "0", "0.3", tmp_path / "new.mcap"), tmp_path)
    names = ["drive.mcap", "drive.motion.csv", "new.mcap", "new.motion.csv"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names


def test_a_split_and_merge_says_the_same_of_every_frame(tmp_path: Path, drive: Path) -> None:
    labels = tmp_path / "labels"
    parts, journals = edit_with_labels(plan_split(drive, ["0.35", "0.7"], tmp_path / "parts"), labels)
    assert {journal.path.name for journal in journals} == {
        *(f"drive_0{part}.motion.csv" for part in (1, 2, 3)),
        *(f"drive_0{part}.gesture.csv" for part in (1, 2)),
    }
    edit_with_labels(plan_merge([part.out for part in parts], tmp_path / "new.mcap"), labels)
    for kind in LabelKind:
        whole, merged = (read_journal(journal_path(labels, stem, kind)) for stem in ("drive", "new"))
        assert resolve(merged).equals(resolve(whole))
        assert len(merged.table) == len(whole.table)


def test_frames_that_are_dropped_take_their_labels_along(tmp_path: Path, drive: Path) -> None:
    plan = plan_drop_topics(drive, ["/camera/image"], tmp_path / "new.mcap")
    edit_with_labels(plan, tmp_path / "labels")
    assert told(tmp_path / "labels/new.motion.csv") == told(tmp_path / "labels/drive.motion.csv")
    assert not (tmp_path / "labels/new.gesture.csv").exists()


def test_without_labels_no_folder_is_made(tmp_path: Path) -> None:
    drive = recorded(tmp_path / "drive.mcap", range(4), "drive-id")
    _, journals = edit_with_labels(plan_trim(drive, "0", "0.3", tmp_path / "new.mcap"), tmp_path / "labels")
    assert journals == ()
    assert not (tmp_path / "labels").exists()


def test_a_journal_that_exists_is_refused_before_anything_is_written(tmp_path: Path, drive: Path) -> None:
    labelled(tmp_path / "labels/drive_02.gesture.csv", "other", [(1, "enable", "ada")])
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(OutputExistsError, match=r"drive_02\.gesture\.csv exists already"):
        edit_with_labels(plan_split(drive, ["0.5"], tmp_path), tmp_path / "labels")
    assert sorted(tmp_path.rglob("*")) == before


def test_a_journal_of_another_recording_is_refused_before_anything_is_written(tmp_path: Path, drive: Path) -> None:
    (tmp_path / "labels/drive.motion.csv").unlink()
    labelled(tmp_path / "labels/drive.motion.csv", "another", [(1, "stay", "ada")])
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(LabelError, match=r"drive\.motion\.csv:2: the label belongs to recording 'another'"):
        edit_with_labels(plan_trim(drive, "0", "0.3", tmp_path / "new.mcap"), tmp_path / "labels")
    assert sorted(tmp_path.rglob("*")) == before


def test_recordings_that_overlap_must_not_call_one_frame_differently(tmp_path: Path, drive: Path) -> None:
    recorded(tmp_path / "other.mcap", [5, 6], "other-id")
    labelled(tmp_path / "labels/other.motion.csv", "other-id", [(5, "forward", "bob")])
    plan = plan_merge([drive, tmp_path / "other.mcap"], tmp_path / "new.mcap")
    said = rf"other\.motion\.csv: bob \(human\) calls the frame at {stamp(5)} 'forward', but 'backward' in .*drive"
    with pytest.raises(LabelError, match=said):
        edit_with_labels(plan, tmp_path / "labels")
    assert not (tmp_path / "new.mcap").exists()
    edit_with_labels(plan, tmp_path / "elsewhere")
    assert (tmp_path / "new.mcap").exists()


def test_where_the_journals_cannot_be_written_there_is_no_recording_either(
    tmp_path: Path, drive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(journal: Journal, _acts: object) -> int:
        raise LabelError(f"{journal.path}: cannot be opened for writing")

    plan = plan_trim(drive, "0", "0.9", tmp_path / "new.mcap")
    monkeypatch.setattr(Journal, "append_table", refuse)
    with pytest.raises(LabelError, match="cannot be opened for writing"):
        edit_with_labels(plan, tmp_path / "labels")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["drive.mcap", "labels"]


def test_labels_go_to_the_trash_and_come_back(tmp_path: Path, drive: Path) -> None:
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    discard_with_labels([drive], tmp_path / "labels", "wrong room", T0)
    assert list((tmp_path / "labels").iterdir()) == []
    (entry,) = trashed(tmp_path)
    assert entry.reason == "wrong room"
    restore(tmp_path, "drive")
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_labels_of_a_namesake_stay(tmp_path: Path, drive: Path) -> None:
    (tmp_path / "other").mkdir()
    namesake = recorded(tmp_path / "other/drive.mcap", range(3), "other-id")
    discard_with_labels([namesake], tmp_path / "labels", "", T0)
    assert len(list((tmp_path / "labels").iterdir())) == 2
