import json
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from prediction_samples import frames_table, side_by_side, write_predictions

from sdt_tools.cli import app
from sdt_tools.error_analysis.compare.changed import conditions_of_change
from sdt_tools.error_analysis.compare.compare import compare_models
from sdt_tools.error_analysis.compare.options import CompareOptions
from sdt_tools.error_analysis.compare.paired import changes, measures, worsened
from sdt_tools.error_analysis.resampling import draw_units
from sdt_tools.errors import OutputExistsError, UsageError

TABLE = frames_table(recordings=24, frames=60)
RNG = np.random.default_rng(2)
NEAR = (TABLE["front_range_m"] < 0.8).to_numpy()
BASE = RNG.random(len(TABLE)) < 0.1
WORSE = BASE | (NEAR & (RNG.random(len(TABLE)) < 0.7))
OPTIONS = CompareOptions(resamples=400)


def test_accuracy_is_that_of_the_counts_and_the_difference_is_paired() -> None:
    frames = side_by_side(TABLE, {"a": BASE, "b": WORSE})
    found = measures(frames, 0, 1, draw_units(24, 400, 0))["accuracy"]
    assert (found.base.value, found.other.value) == pytest.approx((1 - BASE.mean(), 1 - WORSE.mean()))
    assert found.difference.value == pytest.approx(BASE.mean() - WORSE.mean())
    assert found.difference.low < found.difference.value < found.difference.high < 0.0


def test_a_model_against_itself_differs_in_nothing() -> None:
    frames = side_by_side(TABLE, {"a": BASE, "b": BASE})
    for measure in measures(frames, 0, 1, draw_units(24, 400, 0)).values():
        assert (measure.difference.low, measure.difference.high) == pytest.approx((0.0, 0.0))


def test_forward_recall_asks_for_any_forward_class() -> None:
    """The answer after ``forward`` is ``left_forward``: wrong, but forward; after ``right_forward`` it is not."""
    frames = side_by_side(TABLE, {"a": np.zeros(len(TABLE), bool), "b": np.ones(len(TABLE), bool)})
    found = measures(frames, 0, 1, draw_units(24, 400, 0))["forward_recall"]
    labels = TABLE["label"]
    forward = labels.is_in(["forward", "left_forward", "right_forward"]).sum()
    assert found.base.value == 1.0
    assert found.other.value == pytest.approx(labels.is_in(["forward", "left_forward"]).sum() / forward)


def test_changes_count_each_direction_by_motion_and_scenario() -> None:
    better = BASE & (TABLE["label"] != "stay").to_numpy()
    frames = side_by_side(TABLE, {"a": BASE, "b": better})
    found = {(change.group, change.value): change for change in changes(frames, 0, 1, draw_units(24, 400, 0))}
    stay = (TABLE["label"] == "stay").to_numpy()
    assert (found["all", ""].worse, found["all", ""].better) == (0, int((BASE & stay).sum()))
    assert found["motion", "stay"].better == found["all", ""].better
    assert found["motion", "forward"].better == 0
    assert {value for group, value in found if group == "scenario"} == {"plain", "around_boxes", "through_gate"}
    assert sum(change.frames for change in found.values() if change.group == "scenario") == len(TABLE)


def test_the_condition_of_the_change_is_found() -> None:
    frames = side_by_side(TABLE, {"a": BASE, "b": WORSE})
    (condition,) = conditions_of_change(frames, worsened(frames, 0, 1), "got worse", OPTIONS).confirmed
    (predicate,) = condition.condition.predicates
    assert predicate.feature == "front_range_m"
    assert predicate.value == pytest.approx(0.8, abs=0.05)


def test_no_condition_where_nothing_changed() -> None:
    frames = side_by_side(TABLE, {"a": BASE, "b": BASE})
    search = conditions_of_change(frames, worsened(frames, 0, 1), "got worse", OPTIONS)
    assert search.confirmed == ()
    assert search.note == "no errors, so no condition"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("compared")
    return (
        write_predictions(folder / "a.parquet", TABLE, "a", BASE),
        write_predictions(folder / "b.parquet", TABLE, "b", WORSE),
    )


def test_the_folder_holds_report_frames_and_picture(files: tuple[Path, Path], tmp_path: Path) -> None:
    report = compare_models(files, (), OPTIONS, tmp_path / "out")
    document = json.loads((tmp_path / "out/compare.json").read_text())
    assert document["models"] == ["a", "b"]
    assert document["comparisons"][0]["worse_conditions"][0]["recordings"] == 12
    changed = pl.read_parquet(tmp_path / "out/changed_frames.parquet")
    assert changed["change"].to_list() == ["worse"] * int((WORSE & ~BASE).sum())
    assert (tmp_path / "out/compare_1.png").stat().st_size > 10_000
    with pytest.raises(OutputExistsError):
        compare_models(files, (), report.options, tmp_path / "out")


@pytest.mark.parametrize("models", [("a",), ("a", "a")])
def test_one_model_is_not_enough(files: tuple[Path, Path], models: tuple[str, ...], tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="name two models or more"):
        compare_models(files, models, OPTIONS, tmp_path / "out")


def test_predictions_of_one_model_are_not_enough(files: tuple[Path, Path], tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="only predictions of 'a' were given"):
        compare_models(files[:1], (), OPTIONS, tmp_path / "out")


def test_the_verb_prints_one_document(
    files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sdt", "errors", "compare", *map(str, files), "--out", str(tmp_path / "out"), "--json"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as ended:
        app.main()
    assert ended.value.code == 0
    document = json.loads(capsys.readouterr().out)
    assert document["comparisons"][0]["measures"]["accuracy"]["difference"]["high"] < 0.0
