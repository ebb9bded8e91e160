"""Suspect labels, held against labels that were made wrong on purpose."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from nearest_object import draw_frames, write_dataset
from replay_samples import NearestAhead, label, write_drive

from sdt_tools.cli import app
from sdt_tools.error_analysis.suspects.find import SuspectReport, find_suspects
from sdt_tools.error_analysis.suspects.held_out import folds_of, judge_held_out
from sdt_tools.error_analysis.suspects.options import SuspectOptions
from sdt_tools.error_analysis.suspects.run import LabelSource, write_suspect_labels
from sdt_tools.error_analysis.suspects.sources import Judged, LabelledScans, judged_by_predictions, softmax
from sdt_tools.errors import OutputExistsError, UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.labeling.suspects import read_suspects
from sdt_tools.models.follow_net import FollowNetConfig
from sdt_tools.replay.replay import replay
from sdt_tools.training.follow import FollowTrainingConfig
from sdt_tools.training.loop import LoopConfig
from sdt_tools.training.schedule import LearningRateConfig

SMALL = FollowNetConfig(kernels=(9, 5, 3), widths=(8, 16, 16), strides=(4, 4, 2), hidden=24, dropout=0.1)
LOOP = LoopConfig(epochs=12, learning_rate=LearningRateConfig(peak=1e-2))
OPTIONS = SuspectOptions(folds=2, training=FollowTrainingConfig(architecture=SMALL, batch_size=32, loop=LOOP))


def scans(frames: int, recordings: int) -> LabelledScans:
    """A problem with a known answer, its frames dealt out to recordings."""
    ranges_m, labels = draw_frames(0, frames)
    names = [f"drive_{number % recordings}" for number in range(frames)]
    keys = pl.DataFrame({"recording": names, "recording_id": names, "stamp_ns": np.arange(frames) * 10**8})
    return LabelledScans(keys, ranges_m, labels)


def flipped(labels: np.ndarray, share: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Labels of which a share was made wrong, and the rows of those."""
    rng = np.random.default_rng(seed)
    rows = rng.permutation(len(labels))[: round(share * len(labels))]
    wrong = labels.copy()
    wrong[rows] = (wrong[rows] + rng.integers(1, len(MotionClass), len(rows))) % len(MotionClass)
    return wrong, rows


def rows_of(report: SuspectReport, keys: pl.DataFrame) -> np.ndarray:
    """Which frames are suspect, worst first."""
    numbered = keys.with_row_index("row")
    return report.suspects.join(numbered, on=keys.columns, maintain_order="left")["row"].to_numpy()


def test_labels_made_wrong_are_found_and_put_right() -> None:
    true = scans(1000, 10)
    labels, planted = flipped(true.labels, 0.05, seed=1)
    judged = judge_held_out(dataclasses.replace(true, labels=labels), OPTIONS)
    report = find_suspects(judged, OPTIONS)
    found = rows_of(report, true.keys)
    hits = np.isin(found, planted)
    assert hits.sum() / len(planted) > 0.85  # recall
    assert hits.mean() > 0.6  # precision
    assert hits[: len(planted)].mean() > 0.85  # the worst are wrong
    right = [MotionClass(label).label for label in true.labels[found[hits]].tolist()]
    assert np.mean(report.suspects["suggested"].to_numpy()[hits] == right) > 0.9


def test_nobody_is_asked_about_a_recording_that_he_learnt_from() -> None:
    keys = scans(700, 7).keys
    fold = folds_of(keys, SuspectOptions(folds=3))
    spread = keys.with_columns(fold=fold).group_by("recording_id").agg(pl.col("fold").n_unique())
    assert spread["fold"].to_list() == [1] * 7
    assert sorted(np.bincount(fold).tolist()) == [200, 200, 300]


def test_folds_need_recordings() -> None:
    with pytest.raises(UsageError, match=r"2 recordings for 5 folds.*give more recordings, or fewer folds"):
        folds_of(scans(10, 2).keys, SuspectOptions())


def certain(labels: np.ndarray, answers: np.ndarray) -> Judged:
    """Networks that are sure of ``answers``."""
    keys = pl.DataFrame({"recording": "a", "recording_id": "a", "stamp_ns": np.arange(len(labels))})
    return Judged(keys, labels, softmax(8.0 * np.eye(len(MotionClass))[answers]))


def test_a_class_that_no_label_names_is_not_suggested() -> None:
    labels = np.repeat([1, 4], 50)
    answers = labels.copy()
    answers[[3, 70]] = [4, 6]
    report = find_suspects(certain(labels, answers), SuspectOptions())
    assert report.suspects.select("stamp_ns", "label", "suggested").rows() == [(3, "forward", "backward")]
    assert report.agreement == pytest.approx(0.98, abs=0.011)


def test_labels_that_are_all_the_same_say_nothing() -> None:
    with pytest.raises(UsageError, match="all frames have the same label"):
        find_suspects(certain(np.ones(20, np.int64), np.ones(20, np.int64)), SuspectOptions())


def quiet(_stage: str, _done: int, _total: int) -> None:
    """Nobody looks."""


@pytest.fixture(scope="module")
def predictions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Predictions of a model that stops where it should, over drives of which one frame is labelled wrongly."""
    folder = tmp_path_factory.mktemp("suspected")
    drives = [write_drive(folder, f"drive_{seed}", seed=seed) for seed in range(4)]
    for drive in drives:
        label(drive, folder / "labels")
    out = folder / "predictions.parquet"
    replay(NearestAhead(), drives, folder / "labels", out)
    table = pl.read_parquet(out)
    wrong = (pl.col("recording") == "drive_2") & (pl.col("stamp_ns") == pl.col("stamp_ns").min())
    table.with_columns(label=pl.when(wrong).then(pl.lit("stay")).otherwise("label")).write_parquet(out)
    return out


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_the_file_is_one_that_the_labelling_reads(predictions: Path, tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"suspects.{ending}"
    report = write_suspect_labels(LabelSource(predictions=[predictions]), SuspectOptions(), out, quiet)
    rows = pl.read_parquet(predictions).filter(pl.col("recording") == "drive_2").sort("stamp_ns")
    suspects = read_suspects(out, rows["recording_id"][0])
    (suspect,) = suspects.iter_rows(named=True)
    assert (suspect["stamp_ns"], suspect["label"], suspect["suggested"]) == (rows["stamp_ns"][0], "stay", "forward")
    assert 0.5 < suspect["score"] <= 1.0
    assert len(report.suspects) == 1
    account = json.loads(out.with_suffix(".json").read_text())
    assert account["options"] == SuspectOptions().model_dump(mode="json")
    assert list(account["inputs"]) == [str(predictions)]


def test_predictions_without_labels_are_refused(predictions: Path, tmp_path: Path) -> None:
    bare = tmp_path / "bare.parquet"
    pl.read_parquet(predictions).with_columns(label=pl.lit(None, pl.String)).write_parquet(bare)
    with pytest.raises(UsageError, match="none of the frames has a label; replay with --labels"):
        judged_by_predictions([bare])


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["sdt", "errors", "suspects", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        app.main()
    return int(stop.value.code or 0)


def test_the_verb_questions_a_data_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    dataset, out = write_dataset(tmp_path / "data", train=80, val=60), tmp_path / "s.csv"
    assert run(monkeypatch, dataset, "--out", out, "--folds", 2, "--epochs", 1, "--json") == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["frames"], document["recordings"]) == (140, 2)
    assert document["options"]["training"]["loop"]["epochs"] == 1
    assert len(pl.read_csv(out)) == document["suspects"]


def test_bad_calls_are_one_line(
    predictions: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "s.csv"
    for words, said in (
        (["--out", out], "name one source of labels"),
        ([tmp_path, "--predictions", predictions, "--out", out], "name one source of labels"),
        (["--predictions", predictions, "--out", tmp_path / "s.txt"], "ends in .csv or .parquet"),
        (["--predictions", tmp_path / "none", "--out", out], "no such file"),
    ):
        assert run(monkeypatch, *words) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert said in line
    out.write_text("mine")
    with pytest.raises(OutputExistsError):
        write_suspect_labels(LabelSource(predictions=[predictions]), SuspectOptions(), out, quiet)
