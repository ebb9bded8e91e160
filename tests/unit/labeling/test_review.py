from pathlib import Path

import numpy as np
import polars as pl
import pytest

from sdt_tools.errors import LabelError
from sdt_tools.labeling.acts import COLUMNS
from sdt_tools.labeling.frame_labels import FrameLabels, labels_of
from sdt_tools.labeling.predicted import read_predicted
from sdt_tools.labeling.review import Doubt, review_queue, suspects_in
from sdt_tools.labeling.suspects import read_suspects, write_suspects
from sdt_tools.labeling.vocabulary import LabelKind

STAMPS_NS = np.arange(20) * 10


def labels(**said: dict[int, str]) -> FrameLabels:
    """What people, and ``scene`` as the truth, say of frames by number."""
    rows = [(row, label, who) for who, words in said.items() for row, label in words.items()]
    acts = [
        (act, "r", row * 10, label, who, "truth" if who == "scene" else "human", 0)
        for act, (row, label, who) in enumerate(rows, 1)
    ]
    return labels_of(LabelKind.MOTION, STAMPS_NS, pl.DataFrame(acts, schema=dict(COLUMNS), orient="row"))


def over(rows: range, label: str) -> dict[int, str]:
    return dict.fromkeys(rows, label)


def test_conflicts_come_first_the_evenest_split_before_the_longest() -> None:
    found = labels(
        anna=over(range(10), "stay") | over(range(12, 14), "forward"),
        ben=over(range(5), "forward") | over(range(12, 14), "stay"),
        carol=over(range(5), "forward"),
        scene=over(range(5, 8), "backward"),
    )
    items = review_queue(found, found.prelabels, ())
    assert [(item.doubt, item.first, item.last) for item in items] == [
        (Doubt.CONFLICT, 12, 13),  # one against one
        (Doubt.CONFLICT, 0, 4),  # one against two, though longer
        (Doubt.PRELABEL, 5, 7),
    ]
    assert items[0].words == "anna: forward · ben: stay"
    assert items[2].words == "stay, pre-label backward"
    assert items[2].frames == 3


def test_neighbours_are_one_item_only_where_the_same_is_said() -> None:
    found = labels(anna=over(range(6), "stay"), ben=over(range(3), "forward") | over(range(3, 6), "backward"))
    assert [(item.first, item.last) for item in review_queue(found, found.prelabels, ())] == [(0, 2), (3, 5)]


def suspects(*rows: tuple[int, str, str, float]) -> pl.DataFrame:
    table = [("drive", "r", row * 10, label, suggested, score) for row, label, suggested, score in rows]
    return pl.DataFrame(
        table, schema=["recording", "recording_id", "stamp_ns", "label", "suggested", "score"], orient="row"
    )


def test_suspects_come_by_their_score_while_their_label_stands() -> None:
    found = labels(anna=over(range(4), "stay"))
    table = suspects((1, "stay", "forward", 0.4), (2, "stay", "backward", 0.9), (3, "forward", "stay", 0.99))
    items = review_queue(found, found.prelabels, suspects_in(found, table))
    assert [(item.first, item.words) for item in items] == [(2, "stay, rather backward"), (1, "stay, rather forward")]


def test_suspects_of_frames_that_are_not_there_are_left_out() -> None:
    assert suspects_in(labels(), suspects((500, "stay", "forward", 0.4))) == ()


@pytest.mark.parametrize("name", ["s.csv", "s.parquet"])
def test_a_file_of_suspects_holds_several_recordings(tmp_path: Path, name: str) -> None:
    table = suspects((1, "stay", "forward", 0.4), (2, "stay", "backward", 0.9))
    other = table.with_columns(pl.lit("other").alias("recording_id"))
    write_suspects(pl.concat([other, table]), tmp_path / name)
    assert read_suspects(tmp_path / name, "r")["stamp_ns"].to_list() == [20, 10]
    with pytest.raises(LabelError, match="no such file of suspects"):
        read_suspects(tmp_path / "missing.csv", "r")
    (tmp_path / "x.csv").write_text("a,b\n1,2\n")
    with pytest.raises(LabelError, match="it lacks recording, recording_id"):
        read_suspects(tmp_path / "x.csv", "r")


def predictions(path: Path, *rows: tuple[str, int, str, str]) -> Path:
    pl.DataFrame(rows, schema=["recording_id", "stamp_ns", "model", "predicted"], orient="row").write_parquet(path)
    return path


def test_predictions_of_one_model_are_prelabels(tmp_path: Path) -> None:
    path = predictions(tmp_path / "p.parquet", ("r", 20, "a", "stay"), ("r", 10, "a", "forward"), ("x", 0, "a", "stay"))
    assert read_predicted(path, "r", LabelKind.MOTION).rows() == [(10, "forward", "a"), (20, "stay", "a")]


def test_predictions_that_do_not_serve_say_why(tmp_path: Path) -> None:
    two = predictions(tmp_path / "two.parquet", ("r", 1, "a", "stay"), ("r", 1, "b", "stay"))
    with pytest.raises(LabelError, match="answers of a, b; choose one with --model"):
        read_predicted(two, "r", LabelKind.MOTION)
    assert len(read_predicted(two, "r", LabelKind.MOTION, "b")) == 1
    with pytest.raises(LabelError, match="no answers of 'c', but of a, b"):
        read_predicted(two, "r", LabelKind.MOTION, "c")
    with pytest.raises(LabelError, match="no predictions for this recording"):
        read_predicted(two, "other", LabelKind.MOTION)
    with pytest.raises(LabelError, match="predicts stay; a gesture is one of idle"):
        read_predicted(two, "r", LabelKind.GESTURE, "a")
    (tmp_path / "x.parquet").write_text("x")
    with pytest.raises(LabelError, match="is no predictions file"):
        read_predicted(tmp_path / "x.parquet", "r", LabelKind.MOTION)
    with pytest.raises(LabelError, match="no such file"):
        read_predicted(tmp_path / "y.parquet", "r", LabelKind.MOTION)
