import errno
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from replay_samples import NearestAhead, label, write_drive

from sdt_tools.cli import app
from sdt_tools.error_analysis.analyse import analyse_errors
from sdt_tools.error_analysis.definitions import ErrorOptions, Tag
from sdt_tools.error_analysis.explain import explain
from sdt_tools.error_analysis.labelled import load_labelled
from sdt_tools.error_analysis.recorded import find_recordings, read_situations
from sdt_tools.error_analysis.report.document import ErrorReport, summarise
from sdt_tools.error_analysis.spaces import scan_space
from sdt_tools.errors import ConfigError, OutputExistsError, RecordingError, SdtError, UsageError
from sdt_tools.replay.replay import replay

sys.path.append(str(Path(__file__).parents[1] / "replay"))


OPTIONS = ErrorOptions()


@dataclass(frozen=True)
class Material:
    """Labelled drives, and predictions of a model that never stops."""

    recordings: Path
    labels: Path
    predictions: Path


@pytest.fixture(scope="module")
def material(tmp_path_factory: pytest.TempPathFactory) -> Material:
    folder = tmp_path_factory.mktemp("analysed")
    drives = [write_drive(folder / "recordings", f"drive_{seed}", seed=seed) for seed in range(10)]
    for drive in drives:
        label(drive, folder / "labels")
    replay(NearestAhead(stops_at_m=0.0), drives, folder / "labels", folder / "predictions.parquet")
    return Material(folder / "recordings", folder / "labels", folder / "predictions.parquet")


def altered(material: Material, tmp_path: Path, **changes: pl.Expr) -> Path:
    """The predictions with some columns changed."""
    path = tmp_path / "altered.parquet"
    pl.read_parquet(material.predictions).with_columns(**changes).write_parquet(path)
    return path


def report_of(predictions: Path, material: Material, options: ErrorOptions = OPTIONS) -> ErrorReport:
    """The analysis without its files."""
    frames = load_labelled(predictions, options)
    scans, _ = read_situations(frames, find_recordings(frames, [material.recordings]), options)
    return summarise(frames, explain(frames, scan_space(scans), options), options)


@pytest.fixture(scope="module")
def analysed(material: Material, tmp_path_factory: pytest.TempPathFactory) -> tuple[ErrorReport, Path]:
    out = tmp_path_factory.mktemp("analysis") / "errors"
    return analyse_errors(material.predictions, [material.recordings], OPTIONS, out), out


def test_a_model_that_never_stops_fails_where_something_is_near(analysed: tuple[ErrorReport, Path]) -> None:
    document = analysed[0].document()
    assert (document["frames"], document["errors"], document["tags"]["conditional"]) == (200, 70, 70)
    (condition,) = document["conditions"]
    assert condition["text"] == "motion = stay"
    assert condition["recordings"] == 5
    assert condition["effect"] == pytest.approx(1.0)
    assert condition["frames"] == condition["errors"] == 70


def test_the_folder_holds_tags_report_and_figures(analysed: tuple[ErrorReport, Path], material: Material) -> None:
    _, out = analysed
    files = ["epsilon.png", "errors.json", "report.html", "tags.parquet", "tags.png"]
    assert sorted(path.name for path in out.iterdir()) == files
    document = json.loads((out / "errors.json").read_text())
    assert document["options"] == ErrorOptions(neighbourhood="scan").model_dump(mode="json")
    assert len(document["inputs"]["recordings"]) == 10
    tags = pl.read_parquet(out / "tags.parquet")
    assert dict(tags.group_by("tag").len().rows()) == {"conditional": 70, "correct": 130}
    assert tags.filter(pl.col("error"))["condition_1"].all()
    assert tags.filter(~pl.col("error"))["neighbours"].null_count() == 130
    keys = pl.read_parquet(material.predictions).filter(pl.col("label").is_not_null())
    assert tags.select("recording", "stamp_ns", "label").equals(keys.select("recording", "stamp_ns", "label"))


def test_cross_entropy_gives_the_same_errors_under_a_fitting_eta(material: Material) -> None:
    options = ErrorOptions(loss="cross_entropy", eta=1.5)
    report = report_of(material.predictions, material, options)
    assert [condition.verdict.condition.text for condition in report.conditions] == ["motion = stay"]


def test_one_recording_is_analysed_without_conditions(material: Material, tmp_path: Path) -> None:
    drive = material.recordings / "drive_0.mcap"
    predictions = tmp_path / "one.parquet"
    replay(NearestAhead(stops_at_m=0.0), [drive], material.labels, predictions)
    report = report_of(predictions, material)
    assert report.conditions == ()
    assert report.note.startswith("recordings: 1; no condition can be confirmed with fewer than 8")


def test_a_model_without_errors_is_all_correct(material: Material, tmp_path: Path) -> None:
    predictions = altered(material, tmp_path, loss_01=pl.col("loss_01") * 0)
    report = analyse_errors(predictions, [material.recordings], OPTIONS, tmp_path / "errors")
    assert (report.errors, report.tags[Tag.CORRECT].count) == (0, 200)
    assert report.note == "no errors, so no condition"


def test_a_model_without_right_answers_is_systematically_wrong(material: Material, tmp_path: Path) -> None:
    predictions = altered(material, tmp_path, loss_01=pl.col("loss_01") * 0 + 1)
    report = report_of(predictions, material)
    assert report.document()["tags"]["systematic"] == 200


def test_an_epsilon_that_leaves_no_neighbours_is_warned_of(material: Material) -> None:
    report = report_of(material.predictions, material, ErrorOptions(epsilon_m=1e-6))
    assert any("no error frame has a neighbour" in warning for warning in report.warnings)
    assert report.tags[Tag.TRANSIENT].count == 0


def test_only_columns_that_are_needed_are_read(material: Material, tmp_path: Path) -> None:
    predictions = altered(material, tmp_path, wind_mps=pl.lit(1.0), note=pl.lit("dry"))
    options = ErrorOptions(conditions={"features": ["|wind_mps|", "motion"]})
    columns = load_labelled(predictions, options).table.columns
    assert "wind_mps" in columns
    assert not {"note", "logits", "latency_us"} & set(columns)


def test_rows_in_any_order_are_the_same_frames(material: Material, tmp_path: Path) -> None:
    shuffled = tmp_path / "shuffled.parquet"
    pl.read_parquet(material.predictions).sample(fraction=1.0, shuffle=True, seed=0).write_parquet(shuffled)
    sorted_frames, frames = load_labelled(material.predictions, OPTIONS), load_labelled(shuffled, OPTIONS)
    assert frames.table.equals(sorted_frames.table)
    assert frames.recording.tolist() == sorted_frames.recording.tolist()


def test_scans_in_scratch_are_those_in_memory_and_leave_nothing(material: Material, tmp_path: Path) -> None:
    frames = load_labelled(material.predictions, OPTIONS)
    paths = find_recordings(frames, [material.recordings])
    on_disk, _ = read_situations(frames, paths, OPTIONS, scratch=tmp_path / "room")
    in_memory, _ = read_situations(frames, paths, OPTIONS)
    np.testing.assert_array_equal(on_disk, in_memory)
    assert list((tmp_path / "room").iterdir()) == []


def test_a_disk_without_room_for_scans_is_named(
    material: Material, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(descriptor: int, offset: int, size: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", refuse)
    with pytest.raises(SdtError, match=r"no room for .* GB to compare frames \(No space left on device\); free some"):
        analyse_errors(material.predictions, [material.recordings], OPTIONS, tmp_path / "errors")
    assert list(tmp_path.iterdir()) == []


def test_unlabelled_predictions_are_refused(material: Material, tmp_path: Path) -> None:
    predictions = tmp_path / "unlabelled.parquet"
    replay(NearestAhead(), [material.recordings / "drive_0.mcap"], None, predictions)
    with pytest.raises(UsageError, match=r"none of its frames has a label.*replay with --labels"):
        analyse_errors(predictions, [material.recordings], OPTIONS, tmp_path / "errors")
    assert not (tmp_path / "errors").exists()


def test_bad_input_is_named(material: Material, tmp_path: Path) -> None:
    out = tmp_path / "errors"
    drives = [material.recordings]
    two = altered(material, tmp_path, model=pl.when(pl.col("stamp_ns") % 2 == 0).then(pl.col("recording")))
    with pytest.raises(UsageError, match=r"predictions of 10 models \(drive_0, .*\); name one"):
        analyse_errors(two, drives, OPTIONS, out)
    with pytest.raises(UsageError, match="no predictions of model 'other'; it holds nearest"):
        analyse_errors(material.predictions, drives, OPTIONS, out, model="other")
    twice = tmp_path / "twice.parquet"
    pl.concat([pl.read_parquet(material.predictions)] * 2).write_parquet(twice)
    with pytest.raises(UsageError, match=r"holds the frame of drive_0 at .* ns twice"):
        analyse_errors(twice, drives, OPTIONS, out)
    infinite = altered(material, tmp_path, loss_ce=pl.lit(float("inf"), pl.Float32))
    with pytest.raises(UsageError, match="200 frames have a loss that is not finite"):
        analyse_errors(infinite, drives, ErrorOptions(loss="cross_entropy", eta=1.0), out)
    with pytest.raises(UsageError, match="no feature 'wind_mps'"):
        analyse_errors(material.predictions, drives, ErrorOptions(conditions={"features": ["wind_mps"]}), out)
    with pytest.raises(RecordingError, match=r"drive_1, drive_2, drive_3 and 6 more: .*add their folder"):
        analyse_errors(material.predictions, [material.recordings / "drive_0.mcap"], OPTIONS, out)
    with pytest.raises(RecordingError, match="no such file or folder"):
        analyse_errors(material.predictions, [tmp_path / "nowhere"], OPTIONS, out)
    stranger = altered(material, tmp_path, recording_id=pl.lit("another"))
    with pytest.raises(RecordingError, match="is another recording than the one replayed"):
        analyse_errors(stranger, drives, OPTIONS, out)
    shifted = altered(material, tmp_path, stamp_ns=pl.col("stamp_ns") + 1)
    with pytest.raises(RecordingError, match=r"drive_0\.mcap: lacks the scans of 20 of 20 frames"):
        analyse_errors(shifted, drives, OPTIONS, out)
    out.mkdir()
    with pytest.raises(OutputExistsError):
        analyse_errors(material.predictions, drives, OPTIONS, out)


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["sdt", *map(str, arguments)])
    try:
        app.main()
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0


def test_the_verb_prints_one_document(
    material: Material, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "options.toml"
    config.write_text("epsilon_m = 0.05\n[conditions]\nalpha = 0.05\n")
    arguments = ("--recordings", material.recordings, "--out", tmp_path / "errors", "--config", config, "--json")
    assert run(monkeypatch, "errors", material.predictions, *arguments) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["epsilon_m"] == 0.05
    assert document["options"]["conditions"]["alpha"] == 0.05
    keys = {"text", "support", "mean_loss_in", "mean_loss_out", "p_adjusted", "effect", "recordings"}
    assert keys <= set(document["conditions"][0])
    kinds = {"systematic", "transient", "conditional", "isolated", "unexplained", "correct"}
    assert set(document["tags"]) == kinds
    assert document["definition1_transient"] == 0


def test_the_verb_shows_tags_and_conditions(
    material: Material, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("--recordings", material.recordings, "--out", tmp_path / "errors")
    assert run(monkeypatch, "errors", material.predictions, *arguments) == 0
    shown = capsys.readouterr().err
    assert "motion = stay" in shown
    assert "conditional" in shown


def test_the_verb_refuses_in_one_line(
    material: Material, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("--recordings", material.recordings, "--out", tmp_path / "errors")
    assert run(monkeypatch, "errors", tmp_path / "none.parquet", *arguments) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith("sdt: ")
    assert "no such file" in line


def test_an_unknown_option_is_refused(tmp_path: Path) -> None:
    from sdt_tools.config import load_config

    config = tmp_path / "options.toml"
    config.write_text("guards = false\n")
    with pytest.raises(ConfigError, match=r"options\.toml: unknown key 'guards'; did you mean 'guard'"):
        load_config(ErrorOptions, config)
