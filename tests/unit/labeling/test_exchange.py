import csv
from pathlib import Path

import pytest
from labeling_samples import START_NS, record, say, stamp_ns

from sdt_tools.errors import LabelError, OutputExistsError
from sdt_tools.labeling.exchange import export_labels, import_labels
from sdt_tools.labeling.resolve import read_labels
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource

MOTION = LabelKind.MOTION


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    return record(tmp_path / "drive.mcap", 20, camera=False)


def table(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def test_what_goes_out_is_one_label_a_frame_and_comes_back_equal(drive: Path, tmp_path: Path) -> None:
    say(tmp_path / "labels", drive, "anna", range(3, 7), "forward")
    say(tmp_path / "labels", drive, "scene", range(0, 10, 5), "stay", LabelSource.TRUTH)
    done = export_labels(drive, MOTION, tmp_path / "labels", tmp_path / "out" / "t.csv", every_word=False)
    rows = list(csv.DictReader((tmp_path / "out" / "t.csv").read_text().splitlines()))
    assert done.labels == len(rows) == 5
    assert [(row["time_s"], row["label"], row["source"], row["labeler"]) for row in rows[:2]] == [
        ("0.0", "stay", "truth", "scene"),
        ("0.06", "forward", "human", "anna"),
    ]
    back = import_labels(drive, MOTION, tmp_path / "other", tmp_path / "out" / "t.csv", "tool")
    assert (back.labels, back.new) == (5, 5)
    there, here = (read_labels(tmp_path / folder, "drive", MOTION) for folder in ("labels", "other"))
    assert there.select("stamp_ns", "label").equals(here.select("stamp_ns", "label"))
    assert set(here["source"]) == {"import"}
    assert import_labels(drive, MOTION, tmp_path / "other", tmp_path / "out" / "t.csv", "tool").new == 0


def test_every_word_goes_out_if_asked(drive: Path, tmp_path: Path) -> None:
    for who, label in (("anna", "stay"), ("ben", "forward")):
        say(tmp_path, drive, who, range(2), label)
    assert export_labels(drive, MOTION, tmp_path, tmp_path / "one.csv", every_word=False).labels == 0
    assert export_labels(drive, MOTION, tmp_path, tmp_path / "all.csv", every_word=True).labels == 4


def test_nothing_is_written_over(drive: Path, tmp_path: Path) -> None:
    say(tmp_path, drive, "anna", range(2), "stay")
    (tmp_path / "t.csv").write_text("mine")
    with pytest.raises(OutputExistsError):
        export_labels(drive, MOTION, tmp_path, tmp_path / "t.csv", every_word=False)


def test_times_mean_the_nearest_frame_and_other_columns_are_passed_over(drive: Path, tmp_path: Path) -> None:
    given = table(tmp_path / "t.csv", "note,time_s,label", "x,0.071,stay", ",0.0,forward", ",0.395,backward")
    import_labels(drive, MOTION, tmp_path, given, "tool")
    found = read_labels(tmp_path, "drive", MOTION).select("stamp_ns", "label").rows()
    assert found == [(stamp_ns(0), "forward"), (stamp_ns(4), "stay"), (stamp_ns(19), "backward")]


def test_a_persons_label_goes_before_what_is_imported(drive: Path, tmp_path: Path) -> None:
    say(tmp_path, drive, "anna", range(1), "stay")
    import_labels(drive, MOTION, tmp_path, table(tmp_path / "t.csv", "stamp_ns,label", f"{START_NS},forward"), "tool")
    assert read_labels(tmp_path, "drive", MOTION)["label"].to_list() == ["stay"]


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (("time,label", "0,stay"), ":1: needs the columns label and stamp_ns"),
        (("time_s,label", "0,stay", "0.02,fly"), ":3: unknown label 'fly'; a motion is one of stay"),
        (("time_s,label", "0,"), ":2: unknown label ''"),
        (("time_s,label", "soon,stay"), ":2: time_s 'soon' is not a number"),
        (("time_s,label", "nan,stay"), ":2: time_s 'nan' is not a number"),
        (("time_s,label", ",stay"), ":2: time_s '' is not a number"),
        (("time_s,label", "0,stay", "7.5,stay"), ":3: the recording has no frame at time_s 7.5"),
        (("stamp_ns,label", "12,stay"), ":2: the recording has no frame at stamp_ns 12"),
        (("time_s,label", "0,stay", "0.001,forward"), ":3: the frame has a label on another line already"),
        (("time_s,label",), "holds no labels"),
        (("",), "cannot be read as CSV"),
    ],
)
def test_a_wrong_table_is_told_with_its_line_and_nothing_is_written(
    drive: Path, tmp_path: Path, lines: tuple[str, ...], words: str
) -> None:
    with pytest.raises(LabelError) as told:
        import_labels(drive, MOTION, tmp_path, table(tmp_path / "t.csv", *lines), "tool")
    assert words in str(told.value)
    assert not (tmp_path / "drive.motion.csv").exists()


def test_a_recording_without_frames_of_the_kind_is_refused(tmp_path: Path) -> None:
    drive = record(tmp_path / "drive.mcap", 4, camera=False)
    with pytest.raises(LabelError, match="no pictures in it, so there is no gesture to label; scans are labelled with"):
        import_labels(drive, LabelKind.GESTURE, tmp_path, tmp_path / "t.csv", "tool")
