from pathlib import Path

import numpy as np
import polars as pl
import pytest
from prediction_samples import frames_table, with_answers, write_predictions

from sdt_tools.error_analysis.side_by_side import load_side_by_side
from sdt_tools.errors import UsageError

TABLE = frames_table(recordings=4, frames=5)
NEVER = np.zeros(20, bool)
FIRST = np.arange(20) == 0


def test_answers_are_joined_by_recording_and_stamp_whatever_their_order(tmp_path: Path) -> None:
    shuffled = with_answers(TABLE, "b", FIRST).sample(fraction=1.0, shuffle=True, seed=1)
    shuffled.write_parquet(tmp_path / "b.parquet")
    frames = load_side_by_side([write_predictions(tmp_path / "a.parquet", TABLE, "a", NEVER), tmp_path / "b.parquet"])
    assert frames.models == ("a", "b")
    assert frames.wrong.tolist() == [NEVER.tolist(), FIRST.tolist()]
    assert frames.recording.tolist() == np.repeat(np.arange(4), 5).tolist()
    assert [frames.classes[code] for code in frames.predicted[0]] == TABLE["label"].to_list()


def test_models_come_in_the_order_they_are_named(tmp_path: Path) -> None:
    for name in "ab":
        write_predictions(tmp_path / f"{name}.parquet", TABLE, name, NEVER)
    assert load_side_by_side([tmp_path / "a.parquet", tmp_path / "b.parquet"], ("b", "a")).models == ("b", "a")


def test_frames_that_do_not_fit_are_left_out_and_counted(tmp_path: Path) -> None:
    other = with_answers(TABLE, "b", NEVER)[2:].with_columns(
        label=pl.when(pl.int_range(pl.len()) == 0).then(pl.lit("turn")).otherwise("label")
    )
    other.write_parquet(tmp_path / "b.parquet")
    frames = load_side_by_side([write_predictions(tmp_path / "a.parquet", TABLE, "a", NEVER), tmp_path / "b.parquet"])
    assert len(frames.recording) == 17
    a, b = frames.mismatches
    assert (a.frames, a.without_partner, a.other_label) == (20, 2, 1)
    assert (b.frames, b.without_partner, b.other_label) == (18, 0, 1)


def test_models_without_a_common_frame_are_refused(tmp_path: Path) -> None:
    paths = [
        write_predictions(tmp_path / "a.parquet", TABLE[:10], "a", NEVER[:10]),
        write_predictions(tmp_path / "b.parquet", TABLE[10:], "b", NEVER[10:]),
    ]
    with pytest.raises(UsageError, match="no labelled frame was answered by all of a, b"):
        load_side_by_side(paths)


def test_predictions_without_labels_are_refused(tmp_path: Path) -> None:
    unlabelled = TABLE.with_columns(label=pl.lit(None, pl.String))
    path = write_predictions(tmp_path / "a.parquet", unlabelled, "a", NEVER)
    with pytest.raises(UsageError, match="none of the frames of 'a' has a label"):
        load_side_by_side([path])


def test_a_replay_given_twice_is_refused(tmp_path: Path) -> None:
    path = write_predictions(tmp_path / "a.parquet", TABLE, "a", NEVER)
    with pytest.raises(UsageError, match="'a' answered drive_000 at 0 ns twice"):
        load_side_by_side([path, path])


def test_an_unknown_model_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    path = write_predictions(tmp_path / "a.parquet", TABLE, "a", NEVER)
    with pytest.raises(UsageError, match="no predictions of model 'z'; there are a"):
        load_side_by_side([path], ("z",))
