import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

from sdt_tools.errors import LabelError
from sdt_tools.labeling.acts import HEADER, fault_in, parse_acts
from sdt_tools.labeling.journal import Journal, Label, read_journal
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource

RECORDING = "6f1c0a52-0000-4000-8000-000000000001"


def say(journal: Journal, stamp_ns: int, label: str, labeler: str = "anna") -> Label:
    return journal.append(stamp_ns=stamp_ns, label=label, labeler=labeler, source=LabelSource.HUMAN, created_ns=7)


def journal_with(tmp_path: Path, *rows: str, name: str = "x.motion.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(HEADER + "".join(f"{row}\n" for row in rows).encode())
    return path


def row(
    act_id: object = 1, recording: str = RECORDING, stamp: object = 5, label: str = "stay", rest: str = "anna,human,7"
) -> str:
    return f"{act_id},{recording},{stamp},{label},{rest}"


def test_an_act_is_one_line_under_the_header(tmp_path: Path) -> None:
    path = tmp_path / "labels" / "x.motion.csv"
    with Journal(path, RECORDING) as journal:
        first = say(journal, 1_735_689_600_000_000_000, "left_forward")
    assert first == Label(1, RECORDING, 1_735_689_600_000_000_000, "left_forward", "anna", LabelSource.HUMAN, 7)
    assert path.read_text() == (
        "act_id,recording_id,stamp_ns,label,labeler,source,created_ns\n"
        f"1,{RECORDING},1735689600000000000,left_forward,anna,human,7\n"
    )


def test_numbering_goes_on_after_reopening(tmp_path: Path) -> None:
    path = tmp_path / "x.motion.csv"
    for stamp_ns in (1, 2, 3):
        with Journal(path, RECORDING) as journal:
            say(journal, stamp_ns, "stay")
    assert read_journal(path, RECORDING).table["act_id"].to_list() == [1, 2, 3]


def test_many_acts_at_once_are_the_same_as_one_by_one(tmp_path: Path) -> None:
    acts = pl.DataFrame(
        {
            "stamp_ns": [4, 5],
            "label": ["stay", ""],
            "labeler": ["a", "b"],
            "source": ["truth", "human"],
            "created_ns": [4, 5],
        }
    )
    with Journal(tmp_path / "x.motion.csv", RECORDING) as journal:
        assert journal.append_table(acts) == 2
        assert journal.append_table(acts.clear()) == 0
    with Journal(tmp_path / "y.motion.csv", RECORDING) as journal:
        for stamp_ns, label, labeler, source, created_ns in acts.iter_rows():
            journal.append(
                stamp_ns=stamp_ns, label=label, labeler=labeler, source=LabelSource(source), created_ns=created_ns
            )
    assert (tmp_path / "x.motion.csv").read_bytes() == (tmp_path / "y.motion.csv").read_bytes()


def test_each_append_waits_for_the_disk_and_a_table_waits_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x.motion.csv"
    on_disk: list[int] = []
    sync = os.fsync

    def remember(file: int) -> None:
        sync(file)
        on_disk.append(path.stat().st_size)

    table = pl.DataFrame(
        {"stamp_ns": [*range(500)], "label": "stay", "labeler": "a", "source": "truth", "created_ns": 1}
    )
    with Journal(path, RECORDING) as journal:
        monkeypatch.setattr(os, "fsync", remember)
        for stamp_ns in range(3):
            say(journal, stamp_ns, "stay")
            assert on_disk[-1] == path.stat().st_size
        assert len(on_disk) == 3
        journal.append_table(table)
    assert len(on_disk) == 4


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (
            [row(), row(2, label="foward")],
            r"x\.motion\.csv:3: unknown label 'foward'; a motion is one of stay, forward",
        ),
        ([row(label="enable")], r"x\.motion\.csv:2: unknown label 'enable'"),
        ([row(), row(2, recording="other")], rf":3: the label belongs to recording 'other', not '{RECORDING}'"),
        ([row(1), row(1)], ":3: act 1 stands after act 1; acts are numbered in order"),
        ([row(0)], ":2: act 0 stands after act 0"),
        ([row(stamp="5.0")], r":2: stamp_ns '5\.0' is not a whole number"),
        ([row(stamp=-5)], ":2: stamp_ns '-5' is not a whole number"),
        ([row(stamp=10**20)], ":2: the line is not UTF-8 text, or a number in it is too large"),
        ([row(rest="anna,robot,7")], ":2: unknown source 'robot'; it is one of human, import, truth, command, model"),
        ([row(rest=",human,7")], ":2: no labeler is named"),
        ([row(rest="anna,human")], r":2: 6 fields where 7 belong \(act_id, recording_id"),
        ([row(rest="anna,b,human,7")], ":2: 8 fields where 7 belong"),
        (["", row()], ":2: 1 fields where 7 belong"),
    ],
)
def test_a_wrong_line_is_named_with_what_is_wrong(tmp_path: Path, rows: list[str], message: str) -> None:
    path = journal_with(tmp_path, *rows)
    with pytest.raises(LabelError, match=message) as caught:
        read_journal(path, RECORDING)
    assert "\n" not in str(caught.value)


def test_without_a_recording_all_lines_must_agree_with_the_first(tmp_path: Path) -> None:
    path = journal_with(tmp_path, row(1, "one"), row(2, "two"))
    with pytest.raises(LabelError, match=":3: the label belongs to recording 'two', not 'one'"):
        read_journal(path)


def test_gesture_journals_hold_gestures(tmp_path: Path) -> None:
    path = journal_with(tmp_path, row(label="enable"), name="x.gesture.csv")
    assert read_journal(path).table["label"].to_list() == ["enable"]


@pytest.mark.parametrize("text", [b"stamp_ns,label\n", b"\x89MCAP0\r\n", HEADER.replace(b"\n", b"\r\n")])
def test_another_header_is_refused(tmp_path: Path, text: bytes) -> None:
    path = tmp_path / "x.motion.csv"
    path.write_bytes(text)
    with pytest.raises(LabelError, match=r"x\.motion\.csv:1: the header is not 'act_id,recording_id"):
        read_journal(path)


def test_a_missing_journal_says_how_to_get_one(tmp_path: Path) -> None:
    with pytest.raises(LabelError, match=r"x\.motion\.csv: no such journal; label the recording first"):
        read_journal(tmp_path / "x.motion.csv")


def test_a_file_of_another_name_is_no_journal(tmp_path: Path) -> None:
    with pytest.raises(LabelError, match=r"x\.csv: not a journal's name"):
        Journal(tmp_path / "x.csv", RECORDING)


def test_a_journal_of_another_recording_is_not_added_to(tmp_path: Path) -> None:
    path = journal_with(tmp_path, row())
    with pytest.raises(LabelError, match=":2: the label belongs to recording"):
        Journal(path, "other")
    assert path.read_bytes() == HEADER + f"{row()}\n".encode()


def test_a_path_that_cannot_be_a_file_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LabelError, match="cannot be opened for writing"):
        Journal(tmp_path / "file" / "x.motion.csv", RECORDING)


@pytest.mark.parametrize(
    ("label", "labeler", "message"),
    [
        ("sideways", "anna", ":3: unknown label 'sideways'"),
        ("stay", "", ":3: no labeler is named"),
        ("stay", "anna,b", ":3: 8 fields where 7 belong"),
        ("stay", "anna\nb", ":3: 5 fields where 7 belong"),
    ],
)
def test_a_wrong_act_is_refused_and_nothing_written(tmp_path: Path, label: str, labeler: str, message: str) -> None:
    path = journal_with(tmp_path, row())
    before = path.read_bytes()
    with Journal(path, RECORDING) as journal:
        with pytest.raises(LabelError, match=message):
            say(journal, 9, label, labeler)
        assert path.read_bytes() == before
        assert say(journal, 9, "stay").act_id == 2


def test_a_full_disk_leaves_the_journal_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = journal_with(tmp_path, row())
    before = path.read_bytes()
    write = os.write

    def half(file: int, data: memoryview) -> int:
        if len(data) < 20:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data[: len(data) // 2])

    with Journal(path, RECORDING) as journal:
        with monkeypatch.context() as patch:
            patch.setattr(os, "write", half)
            with pytest.raises(LabelError, match=r"x\.motion\.csv: the label could not be written \(No space left"):
                say(journal, 9, "forward")
        assert path.read_bytes() == before
        assert say(journal, 9, "forward").act_id == 2


def test_two_who_append_in_turn_lose_nothing(tmp_path: Path) -> None:
    path = tmp_path / "x.motion.csv"
    with Journal(path, RECORDING) as one, Journal(path, RECORDING) as other:
        numbers = [
            say(journal, stamp_ns, "stay", labeler).act_id
            for stamp_ns, (journal, labeler) in enumerate([(one, "a"), (other, "b"), (other, "b"), (one, "a")])
        ]
    assert numbers == [1, 2, 3, 4]
    assert read_journal(path).table["labeler"].to_list() == ["a", "b", "b", "a"]


def test_a_line_that_the_other_broke_off_is_closed_by_the_next_act(tmp_path: Path) -> None:
    path = tmp_path / "x.motion.csv"
    with Journal(path, RECORDING) as journal:
        say(journal, 1, "stay")
        with path.open("ab") as stream:
            stream.write(f"2,{RECORDING},2,for".encode())
        say(journal, 3, "stay")
        say(journal, 4, "stay")
    lines = path.read_text().splitlines()[1:]
    assert lines == [row(1, stamp=1), f"2,{RECORDING},2,for#broken", row(2, stamp=3), row(3, stamp=4)]
    acts = read_journal(path)
    assert acts.broken_lines == (3,)
    assert acts.table["stamp_ns"].to_list() == [1, 3, 4]


def test_a_last_line_without_its_end_is_reported_and_does_not_count(tmp_path: Path) -> None:
    path = journal_with(tmp_path, row(1))
    with path.open("ab") as stream:
        stream.write(row(2, stamp=6).encode())
    acts = read_journal(path)
    assert acts.broken_lines == (3,)
    assert acts.table["act_id"].to_list() == [1]


@pytest.mark.parametrize("change", ["replaced", "shortened", "removed"])
def test_a_journal_that_is_rewritten_under_ones_hands_is_not_written_to(tmp_path: Path, change: str) -> None:
    path = tmp_path / "x.motion.csv"
    with Journal(path, RECORDING) as journal:
        say(journal, 1, "stay")
        if change == "replaced":
            journal_with(tmp_path, row(), name="y.motion.csv").rename(path)
        elif change == "shortened":
            path.write_bytes(HEADER)
        else:
            path.unlink()
        with pytest.raises(LabelError, match="moved or rewritten while it was open; open it again"):
            say(journal, 2, "stay")


def test_a_closed_journal_takes_no_acts(tmp_path: Path) -> None:
    with Journal(tmp_path / "x.motion.csv", RECORDING) as journal:
        pass
    with pytest.raises(LabelError, match="the journal is closed"):
        say(journal, 1, "stay")


LABELER_PROGRAM = """
import sys
from pathlib import Path
from sdt_tools.labeling.journal import Journal
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource
_, path, recording, labeler, count = sys.argv
with Journal(Path(path), recording) as journal:
    for stamp_ns in range(int(count)):
        act = journal.append(
            stamp_ns=stamp_ns, label="stay", labeler=labeler, source=LabelSource.HUMAN, created_ns=0
        )
        sys.stdout.write(f"{act.act_id}\\n")
        sys.stdout.flush()
"""


def start_labeler(path: Path, labeler: str, count: int) -> "subprocess.Popen[str]":
    command = [sys.executable, "-c", LABELER_PROGRAM, str(path), RECORDING, labeler, str(count)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def test_two_programs_at_once_lose_nothing_and_a_killed_one_keeps_what_it_said(tmp_path: Path) -> None:
    path = tmp_path / "x.motion.csv"
    with start_labeler(path, "killed", 1_000_000) as killed, start_labeler(path, "whole", 60) as whole:
        shown_by_whole = [int(line) for line in whole.communicate()[0].split()]
        assert killed.stdout is not None
        shown = [int(killed.stdout.readline()) for _ in range(20)]
        killed.send_signal(signal.SIGKILL)
        shown += [int(line) for line in killed.stdout.read().split("\n")[:-1]]
    table = read_journal(path, RECORDING).table
    on_disk = dict(table.group_by("labeler").agg(pl.col("act_id")).iter_rows())
    assert on_disk["whole"] == shown_by_whole
    assert len(shown_by_whole) == 60
    assert on_disk["killed"][: len(shown)] == shown
    assert len(on_disk["killed"]) <= len(shown) + 1
    assert table["act_id"].to_list() == list(range(1, len(table) + 1))


def test_news_are_what_others_have_appended_once(tmp_path: Path) -> None:
    with Journal(tmp_path / "x.motion.csv", "r") as mine, Journal(tmp_path / "x.motion.csv", "r") as other:
        say(mine, 1, "stay")
        assert mine.news().is_empty()
        say(other, 2, "stay")
        say(other, 3, "stay")
        say(mine, 4, "stay")  # continues after theirs, and does not lose them
        assert mine.news()["stamp_ns"].to_list() == [2, 3]
        assert mine.news().is_empty()
        assert mine.last_act == 4
        say(other, 5, "stay")
        assert mine.news()["act_id"].to_list() == [5]


def test_what_was_there_before_is_no_news(tmp_path: Path) -> None:
    with Journal(tmp_path / "x.motion.csv", "r") as before:
        say(before, 1, "stay")
    with Journal(tmp_path / "x.motion.csv", "r") as after:
        assert after.opened.table["stamp_ns"].to_list() == [1]
        assert after.news().is_empty()
    with pytest.raises(LabelError, match="closed"):
        after.news()


FIELDS = ["1", "r", "5", "stay", "anna", "human", "0"]
WRONG = [
    "",
    "x",
    "-1",
    "1.5",
    "٣",
    "9" * 18,
    "9" * 19,
    "9" * 30,
    "r",
    "stay",
    "fly",
    " ",
    "anna",
    "truth",
    "a,b",
    "\ufffd",
]


@pytest.mark.parametrize("place", range(7))
@pytest.mark.parametrize("value", WRONG)
def test_a_line_of_its_own_is_judged_as_in_a_table(place: int, value: str) -> None:
    text = ",".join([*FIELDS[:place], value, *FIELDS[place + 1 :]])
    path = Path("x.motion.csv")
    try:
        alone = fault_in(text, LabelKind.MOTION, "r", 0) is None and text.isprintable() and "\ufffd" not in text
        parse_acts(f"{text}\n".encode(), path, "r", 1, 0)
    except LabelError:
        assert not alone
    else:
        assert alone
