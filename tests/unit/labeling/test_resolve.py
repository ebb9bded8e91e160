from pathlib import Path

import polars as pl

from sdt_tools.labeling.acts import COLUMNS, Acts
from sdt_tools.labeling.journal import Journal
from sdt_tools.labeling.resolve import disagreements, read_labels, resolve
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, journal_path


def acts(*said: tuple[int, str, str, str]) -> Acts:
    rows = [
        (number, "r", stamp, label, labeler, source, 0)
        for number, (stamp, label, labeler, source) in enumerate(said, 1)
    ]
    return Acts(Path("x.motion.csv"), LabelKind.MOTION, pl.DataFrame(rows, schema=dict(COLUMNS), orient="row"))


def resolved(*said: tuple[int, str, str, str]) -> list[tuple[object, ...]]:
    return resolve(acts(*said)).rows()


def test_the_last_word_of_a_labeler_stands() -> None:
    assert resolved((5, "stay", "anna", "human"), (5, "forward", "anna", "human")) == [(5, "forward", "human", "anna")]


def test_the_most_trusted_source_decides_whoever_spoke_last() -> None:
    said = [(5, label, "x", source) for label, source in zip(LabelKind.MOTION.classes, LabelSource, strict=False)]
    for first in range(len(said)):
        assert resolved(*said[first:]) == [(5, said[first][1], said[first][3], "x")]


def test_an_empty_label_withdraws_and_the_next_source_decides() -> None:
    said = [(5, "stay", "scene", "truth"), (5, "forward", "anna", "human"), (5, "", "anna", "human")]
    assert resolved(*said) == [(5, "stay", "truth", "scene")]
    assert resolved(*said[1:]) == []


def test_humans_who_disagree_leave_the_stamp_open_until_they_agree() -> None:
    quarrel = [(5, "backward", "scene", "truth"), (5, "stay", "anna", "human"), (5, "forward", "ben", "human")]
    assert resolved(*quarrel) == []
    assert disagreements(acts(*quarrel)).rows() == [(5, "anna", "stay"), (5, "ben", "forward")]
    settled = [*quarrel, (5, "stay", "ben", "human")]
    assert resolved(*settled) == [(5, "stay", "human", "ben")]
    assert disagreements(acts(*settled)).is_empty()
    assert resolved(*quarrel, (5, "", "anna", "human")) == [(5, "forward", "human", "ben")]


def test_what_somebody_settles_stands_above_those_who_disagree_until_it_is_withdrawn() -> None:
    quarrel = [(5, "backward", "scene", "truth"), (5, "stay", "anna", "human"), (5, "forward", "ben", "human")]
    settled = [*quarrel, (5, "left_forward", "settled:carol", "human")]
    assert resolved(*settled) == [(5, "left_forward", "human", "settled:carol")]
    assert disagreements(acts(*settled)).is_empty()
    assert resolved(*settled, (5, "stay", "settled:dora", "human"))[0][1] == "stay"
    assert resolved(*settled, (5, "", "settled:carol", "human")) == []


def test_of_other_sources_that_disagree_the_latest_stands() -> None:
    assert resolved((5, "stay", "a", "model"), (5, "forward", "b", "model")) == [(5, "forward", "model", "b")]


def test_stamps_ascend() -> None:
    assert [stamp for stamp, *_ in resolved((9, "stay", "a", "human"), (2, "stay", "a", "human"))] == [2, 9]


def test_an_empty_journal_resolves_to_an_empty_table_of_the_same_columns() -> None:
    assert resolve(acts()).schema == resolve(acts((5, "stay", "a", "human"))).schema


def test_labels_are_found_by_the_recordings_name(tmp_path: Path) -> None:
    with Journal(journal_path(tmp_path, "drive.1", LabelKind.GESTURE), "r") as journal:
        journal.append(stamp_ns=3, label="enable", labeler="a", source=LabelSource.IMPORT, created_ns=0)
    assert read_labels(tmp_path, "drive.1", LabelKind.GESTURE, "r").rows() == [(3, "enable", "import", "a")]
