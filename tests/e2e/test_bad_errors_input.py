"""Error analyses of what does not suffice: one line and exit 2, or a report that says so."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from sdt_tools.cli.app import main
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig

ROOT = Path(__file__).parents[2]
RECORDING = ROOT / "recordings" / "sample_practice.mcap"
Sdt = Callable[..., tuple[int, str, str]]


@pytest.fixture
def sdt(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Sdt:
    """Runs a command in an empty folder; returns exit code, stdout and stderr."""

    def call(*words: object) -> tuple[int, str, str]:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["sdt", *map(str, words)])
        with pytest.raises(SystemExit) as stop:
            main()
        said = capsys.readouterr()
        return int(stop.value.code or 0), said.out, said.err

    return call


@pytest.fixture(scope="module")
def predictions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sample recording, labelled, answered by a network that has not learnt."""
    folder = tmp_path_factory.mktemp("replayed")
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 0)
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    save_checkpoint(folder / "model", network, card)
    words = ["replay", folder / "model", RECORDING, "--labels", ROOT / "labels", "--out", folder / "p.parquet"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["sdt", *map(str, words)])
        with pytest.raises(SystemExit):
            main()
    return folder / "p.parquet"


def altered(predictions: Path, out: Path, **columns: pl.Expr) -> Path:
    pl.read_parquet(predictions).with_columns(**columns).write_parquet(out)
    return out


def refusal(sdt: Sdt, predictions: Path, *options: object) -> str:
    """The one line that an analysis is refused with."""
    code, out, said = sdt("errors", predictions, "--recordings", RECORDING, "--out", "e", *options)
    assert (code, out, Path("e").exists()) == (2, "", False)
    (line,) = said.strip().splitlines()
    assert line.startswith("sdt: ")
    return line


def report(sdt: Sdt, predictions: Path, *options: object) -> tuple[dict[str, Any], str]:
    """The document of an analysis that goes through, and its page."""
    code, out, said = sdt("errors", predictions, "--recordings", RECORDING, "--out", "e", "--json", *options)
    assert code == 0, said
    return json.loads(out), Path("e/report.html").read_text("utf-8")


def loss(value: float) -> pl.Expr:
    return pl.when(pl.col("label").is_not_null()).then(pl.lit(value, pl.Float32))


def test_predictions_without_labels(sdt: Sdt, predictions: Path, tmp_path: Path) -> None:
    bare = altered(predictions, tmp_path / "bare.parquet", label=pl.lit(None, pl.String))
    assert "bare.parquet: none of its frames has a label" in refusal(sdt, bare)


def test_one_recording_only(sdt: Sdt, predictions: Path) -> None:
    document, page = report(sdt, predictions)
    assert document["recordings"] == 1
    assert document["conditions"] == []
    assert "no condition can be confirmed with fewer than 8" in document["condition_note"]
    assert "no condition can be confirmed with fewer than 8" in page


def test_no_errors(sdt: Sdt, predictions: Path, tmp_path: Path) -> None:
    document, page = report(sdt, altered(predictions, tmp_path / "right.parquet", loss_01=loss(0.0)))
    assert document["errors"] == 0
    assert document["tags"]["correct"] == document["frames"]
    assert "No frame is wrong" in page


def test_all_errors(sdt: Sdt, predictions: Path, tmp_path: Path) -> None:
    document, page = report(sdt, altered(predictions, tmp_path / "wrong.parquet", loss_01=loss(1.0)))
    assert document["tags"]["systematic"] == document["errors"] == document["frames"]
    assert "Every frame is wrong" in page


def test_features_that_no_frame_has(sdt: Sdt, predictions: Path, tmp_path: Path) -> None:
    unknown = {name: pl.lit(None, pl.Float32) for name in ("operator_range_m", "operator_bearing_rad", "speed_mps")}
    document, page = report(sdt, altered(predictions, tmp_path / "blind.parquet", **unknown))
    assert {"operator_range_m", "operator_bearing_rad", "speed_mps"} <= set(document["features_unavailable"])
    assert "Not known of any frame, or the same in all: " in page


def test_a_feature_column_that_is_missing(sdt: Sdt, predictions: Path, tmp_path: Path) -> None:
    less = tmp_path / "less.parquet"
    pl.read_parquet(predictions).drop("front_range_m").write_parquet(less)
    assert "less.parquet: not a predictions file: it lacks the column 'front_range_m'" in refusal(sdt, less)


def test_a_feature_asked_for_that_does_not_exist(sdt: Sdt, predictions: Path, tmp_path: Path) -> None:
    (tmp_path / "o.toml").write_text('[conditions]\nfeatures = ["wind_mps"]\n')
    assert "no feature 'wind_mps'" in refusal(sdt, predictions, "--config", tmp_path / "o.toml")


def test_an_epsilon_without_neighbours(sdt: Sdt, predictions: Path, tmp_path: Path) -> None:
    (tmp_path / "o.toml").write_text("epsilon_m = 1e-7\n")
    document, page = report(sdt, predictions, "--config", tmp_path / "o.toml")
    assert document["tags"]["transient"] == 0
    assert any("no error frame has a neighbour within ε" in warning for warning in document["warnings"])
    assert "no error frame has a neighbour within ε" in page


def test_every_option_is_recorded(sdt: Sdt, predictions: Path) -> None:
    document, _ = report(sdt, predictions)
    required = {"frames", "errors", "tags", "definition1_transient", "conditions", "options"}
    assert required <= set(document)
    tags = json.loads(pl.read_parquet_metadata("e/tags.parquet")["sdt.error_tags"])
    assert tags["options"] == document["options"]
    assert json.loads(Path("e/errors.json").read_text())["options"] == document["options"]
