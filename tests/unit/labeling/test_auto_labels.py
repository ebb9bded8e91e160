from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from sdt_tools.errors import LabelError, RecordingError
from sdt_tools.frames import (
    RAYS,
    CameraImage,
    Gesture,
    LidarScan,
    Message,
    Mode,
    MotionClass,
    MotionCommand,
    OperatorState,
    Received,
    Twist,
)
from sdt_tools.labeling.auto import AutoSource, label_automatically
from sdt_tools.labeling.journal import Journal, read_journal
from sdt_tools.labeling.resolve import read_labels
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter

START_NS = 1_735_689_600_000_000_000
MS = 1_000_000


def record(path: Path, messages: Sequence[Message], seed: int = 0) -> Path:
    with RecordingWriter(path, SourceInfo("scene", "plain", seed), "") as writer:
        for message in messages:
            writer.write(Received(message.stamp_ns, message))
    return path


def scan(ms: int) -> LidarScan:
    return LidarScan(START_NS + ms * MS, np.full(RAYS, 2.0))


def command(
    ms: int, motion: MotionClass, expert: MotionClass | None = None, mode: Mode = Mode.ACTIVE, driver: str = "keyboard"
) -> MotionCommand:
    return MotionCommand(START_NS + ms * MS, motion, Twist(0.0, 0.0), driver, mode, expert=expert)


def labelled(path: Path, kind: LabelKind = LabelKind.MOTION) -> list[tuple[int, str, str, str]]:
    table = read_labels(path.parent / "labels", path.stem, kind)
    stamps = ((table["stamp_ns"] - START_NS) // MS).to_list()
    return list(zip(stamps, table["label"], table["source"], table["labeler"], strict=True))


def label(path: Path, source: AutoSource, kind: LabelKind = LabelKind.MOTION) -> int:
    return label_automatically(path, kind, source, path.parent / "labels").appended


def test_motions_that_were_forced_on_the_driver_are_no_labels(tmp_path: Path) -> None:
    forced = command(200, MotionClass.BACKWARD, driver="perturbation")
    path = record(tmp_path / "a.mcap", [scan(100), command(100, MotionClass.FORWARD), scan(200), forced])
    assert label(path, LabelSource.COMMAND) == 1
    assert labelled(path) == [(100, "forward", "command", "keyboard")]


def test_commands_given_in_active_mode_become_labels_of_their_scans(tmp_path: Path) -> None:
    path = record(
        tmp_path / "drive.mcap",
        [
            scan(0),
            command(0, MotionClass.FORWARD),
            command(100, MotionClass.STAY, mode=Mode.IDLE),
            command(200, MotionClass.LEFT_BACKWARD, driver="policy:follow-0"),
        ],
    )
    summary = label_automatically(path, LabelKind.MOTION, LabelSource.COMMAND, tmp_path / "labels")
    assert labelled(path) == [
        (0, "forward", "command", "keyboard"),
        (200, "left_backward", "command", "policy:follow-0"),
    ]
    assert summary.journal == tmp_path / "labels" / "drive.motion.csv"
    assert (summary.labels, summary.appended, summary.skipped) == (2, 2, 1)
    assert {name for name, count in summary.counts.items() if count} == {"forward", "left_backward"}


def test_truth_is_what_the_expert_would_have_done(tmp_path: Path) -> None:
    path = record(
        tmp_path / "drive.mcap",
        [command(0, MotionClass.FORWARD, MotionClass.STAY), command(100, MotionClass.FORWARD)],
    )
    assert label(path, LabelSource.TRUTH) == 1
    assert labelled(path) == [(0, "stay", "truth", "scene")]


def test_images_get_the_state_that_the_operator_was_in(tmp_path: Path) -> None:
    def state(ms: int, gesture: Gesture) -> OperatorState:
        return OperatorState(START_NS + ms * MS, gesture, Mode.IDLE)

    def image(ms: int) -> CameraImage:
        return CameraImage(START_NS + ms * MS, b"\xff\xd8")

    path = record(
        tmp_path / "drive.mcap",
        [
            image(0),
            state(10, Gesture.IDLE),
            image(33),
            state(60, Gesture.ENABLE),
            image(60),
            image(1060),
            image(1061),
        ],
    )
    summary = label_automatically(path, LabelKind.GESTURE, LabelSource.TRUTH, tmp_path / "labels")
    assert labelled(path, LabelKind.GESTURE) == [
        (33, "idle", "truth", "scene"),
        (60, "enable", "truth", "scene"),
        (1060, "enable", "truth", "scene"),
    ]
    assert summary.skipped == 2  # one before any state, one more than a second after the last


def test_labeling_again_appends_nothing(tmp_path: Path) -> None:
    path = record(tmp_path / "drive.mcap", [command(ms, MotionClass.FORWARD) for ms in (0, 100)])
    assert label(path, LabelSource.COMMAND) == 2
    journal = tmp_path / "labels" / "drive.motion.csv"
    before = journal.read_bytes()
    assert label(path, LabelSource.COMMAND) == 0
    assert journal.read_bytes() == before


def test_a_label_that_was_withdrawn_or_changed_is_given_again(tmp_path: Path) -> None:
    path = record(tmp_path / "drive.mcap", [command(ms, MotionClass.FORWARD) for ms in (0, 100, 200)])
    label(path, LabelSource.COMMAND)
    journal_path = tmp_path / "labels" / "drive.motion.csv"
    with Journal(journal_path, str(read_journal(journal_path).table["recording_id"][0])) as journal:
        acts = {"stamp_ns": [START_NS, START_NS + 100 * MS], "label": ["", "stay"]}
        journal.append_table(pl.DataFrame({**acts, "labeler": "keyboard", "source": "command", "created_ns": 0}))
    assert label(path, LabelSource.COMMAND) == 2
    assert [name for _, name, *_ in labelled(path)] == ["forward"] * 3


def test_equal_recordings_get_equal_journals(tmp_path: Path) -> None:
    for name in ("a", "b"):
        path = record(tmp_path / f"{name}.mcap", [command(ms, MotionClass.STAY) for ms in (0, 100)])
        label(path, LabelSource.COMMAND)
    one, other = ((tmp_path / "labels" / f"{name}.motion.csv").read_bytes() for name in ("a", "b"))
    assert one == other


def test_of_two_decisions_on_one_scan_the_later_counts(tmp_path: Path) -> None:
    path = record(tmp_path / "drive.mcap", [command(0, MotionClass.STAY), command(0, MotionClass.FORWARD)])
    label(path, LabelSource.COMMAND)
    assert [name for _, name, *_ in labelled(path)] == ["forward"]


@pytest.mark.parametrize(
    ("messages", "kind", "source", "message"),
    [
        (
            [scan(0)],
            LabelKind.MOTION,
            LabelSource.COMMAND,
            r"no /robot/command in it.*record with a driver",
        ),
        ([scan(0)], LabelKind.MOTION, LabelSource.TRUTH, "no /robot/command in it"),
        (
            [command(0, MotionClass.STAY)],
            LabelKind.MOTION,
            LabelSource.TRUTH,
            "/robot/command does not say what the expert would do; label from the commands",
        ),
        (
            [command(0, MotionClass.STAY, mode=Mode.IDLE)],
            LabelKind.MOTION,
            LabelSource.COMMAND,
            "no command in /robot/command was given in active mode",
        ),
        ([scan(0)], LabelKind.GESTURE, LabelSource.TRUTH, "no /operator/state in it.*only the scene knows"),
        ([scan(0)], LabelKind.GESTURE, LabelSource.COMMAND, "commands carry no gestures; label them from the truth"),
    ],
)
def test_a_recording_without_such_labels_says_so_and_gets_no_journal(
    tmp_path: Path, messages: list[Message], kind: LabelKind, source: AutoSource, message: str
) -> None:
    path = record(tmp_path / "drive.mcap", messages)
    with pytest.raises(LabelError, match=rf"drive\.mcap: {message}"):
        label(path, source, kind)
    assert not (tmp_path / "labels").exists()


def test_a_journal_of_another_recording_is_not_mixed_with(tmp_path: Path) -> None:
    label(record(tmp_path / "drive.mcap", [command(0, MotionClass.STAY)]), LabelSource.COMMAND)
    (tmp_path / "drive.mcap").unlink()
    path = record(tmp_path / "drive.mcap", [command(0, MotionClass.STAY)], seed=1)
    with pytest.raises(LabelError, match=r"drive\.motion\.csv:2: the label belongs to recording"):
        label(path, LabelSource.COMMAND)


def test_a_missing_recording_is_a_recording_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"no\.mcap"):
        label(tmp_path / "no.mcap", LabelSource.COMMAND)
