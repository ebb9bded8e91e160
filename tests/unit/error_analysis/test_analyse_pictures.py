import base64
import json
import re
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest
from picture_samples import BlueTells, label_gestures, stamp_ns, write_pictures

from sdt_tools.error_analysis.analyse import analyse_errors
from sdt_tools.error_analysis.claims.judge import Sources, judge_claims
from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.error_analysis.definitions import ErrorOptions, Tag
from sdt_tools.error_analysis.featured import read_features
from sdt_tools.error_analysis.labelled import load_labelled
from sdt_tools.errors import UsageError
from sdt_tools.models.card import VisionCard
from sdt_tools.models.vision.checkpoint import save_vision_checkpoint
from sdt_tools.models.vision.config import ImagePreprocessConfig, LiteConfig, LiteStage
from sdt_tools.models.vision.net import VisionNet, draw_vision_weights
from sdt_tools.replay.replay import replay
from sdt_tools.view.files import write_rrd_from_files

OPTIONS = ErrorOptions()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten recordings, and predictions of a model that takes disable for enable in the later two thirds of each."""
    folder = tmp_path_factory.mktemp("pictures")
    paths = [write_pictures(folder / "recordings", f"gestures_{seed}", seed=seed) for seed in range(10)]
    for path in paths:
        label_gestures(path, folder / "labels")
    replay(BlueTells(blind_from=12), paths, folder / "labels", folder / "predictions.parquet")
    analyse_errors(folder / "predictions.parquet", [folder / "recordings"], OPTIONS, folder / "errors")
    return folder


def test_wrong_pictures_are_tagged_and_the_condition_is_found(folder: Path) -> None:
    document = json.loads((folder / "errors" / "errors.json").read_text())
    assert (document["kind"], document["frames"], document["errors"]) == ("pictures", 300, 60)
    assert document["epsilon"]["neighbourhood"] == "feature"
    (condition,) = document["conditions"]
    assert (condition["frames"], condition["errors"]) == (60, 60)
    assert document["tags"]["conditional"] == 60


def test_the_page_shows_the_pictures_of_errors(folder: Path) -> None:
    page = (folder / "errors" / "report.html").read_text()
    shown = re.findall(r'<img src="data:image/jpeg;base64,([^"]+)" alt="what the camera saw">', page)
    assert len(shown) == 4
    for text in shown:
        seen = cv2.imdecode(np.frombuffer(base64.b64decode(text), np.uint8), cv2.IMREAD_COLOR)
        assert seen.shape == (48, 64, 3)
        assert seen[..., 0].mean() == pytest.approx(121.5, abs=3)  # the blue of disable
    assert "neighbours in feature space" in page
    assert "scan from above" not in page


def test_neighbours_in_time_are_the_frames_before_and_after(folder: Path, tmp_path: Path) -> None:
    rows = pl.read_parquet(folder / "predictions.parquet")
    lone = (pl.col("stamp_ns") == stamp_ns(4)) & (pl.col("recording") == "gestures_3")
    one_wrong = rows.with_columns(loss_01=pl.when(lone).then(1.0).otherwise(0.0).cast(pl.Float32))
    one_wrong.write_parquet(tmp_path / "p.parquet")
    options = ErrorOptions(neighbourhood="time")
    report = analyse_errors(tmp_path / "p.parquet", [folder / "recordings"], options, tmp_path / "errors")
    assert report.epsilon.value == pytest.approx(200.0)
    assert report.tags[Tag.TRANSIENT].count == 1
    tags = pl.read_parquet(tmp_path / "errors" / "tags.parquet").filter(pl.col("error"))
    assert tags.select("neighbours", "right_neighbours").rows() == [(2, 2)]


def test_features_are_read_to_the_row_of_their_frame(folder: Path, tmp_path: Path) -> None:
    shuffled = pl.read_parquet(folder / "predictions.parquet").sample(fraction=1.0, shuffle=True, seed=1)
    shuffled.write_parquet(tmp_path / "p.parquet")
    frames = load_labelled(tmp_path / "p.parquet", OPTIONS)
    ordered = shuffled.sort("recording", "recording_id", "stamp_ns")
    found = read_features(frames, tmp_path / "p.parquet", tmp_path)
    np.testing.assert_array_equal(found, np.array(ordered["features"].to_list(), np.float32))


def test_frames_without_features_are_refused(folder: Path, tmp_path: Path) -> None:
    rows = pl.read_parquet(folder / "predictions.parquet")
    rows.with_columns(features=pl.lit(None, pl.List(pl.Float16))).write_parquet(tmp_path / "p.parquet")
    with pytest.raises(UsageError, match="features are missing"):
        analyse_errors(tmp_path / "p.parquet", [folder / "recordings"], OPTIONS, tmp_path / "errors")


def test_an_analysis_of_pictures_is_seen_in_rerun(folder: Path, tmp_path: Path) -> None:
    summary = write_rrd_from_files(
        folder / "recordings" / "gestures_0.mcap",
        tmp_path / "seen.rrd",
        labels_dir=folder / "labels",
        predictions=[folder / "predictions.parquet"],
        errors=[folder / "errors"],
    )
    assert {"label/gesture", "model/blue/predicted", "model/blue/tag"} <= set(summary.lanes)
    assert summary.images == 30
    assert {(step.tag, step.label, step.predicted) for step in summary.errors} == {("conditional", "disable", "enable")}


def test_claims_about_vision_networks_take_the_tags(folder: Path, tmp_path: Path) -> None:
    shape = LiteConfig(stem=4, stages=(LiteStage(blocks=1, kernel=3, stride=1, expand=1, width=4),), head=4)
    network = VisionNet(shape, ImagePreprocessConfig(width=8, height=8))
    draw_vision_weights(network, 0)
    training = {"adversarial": {"epsilon": 1}}
    card = VisionCard(kind="vision", seed=0, architecture=shape, preprocess=network.preprocess, training=training)
    save_vision_checkpoint(tmp_path / "blue", network, card)
    sources = Sources((folder / "predictions.parquet",), (tmp_path / "blue",), tags=(folder / "errors",))
    report = judge_claims(sources, ClaimOptions(resamples=100), tmp_path / "claims")
    transient, uniform = report.verdicts
    assert (transient.about, str(transient.finding), transient.frames) == ("blue", "contradicted", 60)
    assert str(uniform.finding) == "undecided"  # of one scenario
