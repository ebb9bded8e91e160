"""An attack on a small vision network, from the command to the pictures."""

import json
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest
import torch
from corner_gestures import TINY_CONFIG, draw_data, draw_images, write_dataset
from rerun.chunk import RrdReader
from typer.testing import CliRunner

from sdt_tools.cli.attack import app
from sdt_tools.errors import CheckpointError, DatasetError, OutputExistsError
from sdt_tools.evaluation.attack_vision import attack_vision
from sdt_tools.frames import Gesture
from sdt_tools.models.vision.checkpoint import load_vision_checkpoint
from sdt_tools.models.vision.loaded import ready_to_answer
from sdt_tools.robustness.image_attacks import ImageAttackConfig
from sdt_tools.robustness.image_figure import magnified_mask, probabilities
from sdt_tools.training.schedule import LearningRateConfig
from sdt_tools.training.vision.train import train_vision


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A network that sees the gestures of a picture by a hair, so that few steps of colour turn it."""
    folder = tmp_path_factory.mktemp("attack") / "net"
    rate = LearningRateConfig(peak=5e-3, warm_up_share=0.1, decay_share=0.6)
    config = TINY_CONFIG.model_copy(update={"epochs": 8, "learning_rate": rate})
    train_vision(draw_data(), config, folder)
    return folder


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("data") / "gestures")


def run(*arguments: object) -> dict:
    result = CliRunner().invoke(app, ["vision", *map(str, arguments), "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    return dict(json.loads(result.stdout))


def test_the_document_counts_each_attack_with_its_interval(model: Path, dataset: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    document = run(model, dataset, "--out", out, "--images", 12, "--steps", 4, "--epsilon", 1, "--epsilon", 9)
    assert document["images"] == 12
    rates = document["rates"]
    assert [(one["method"], one["epsilon"], one["target"]) for one in rates] == [
        (method, epsilon, target)
        for epsilon in (1, 9)
        for method in ("fgsm", "pgd")
        for target in ("any other", "enable")
    ]
    for one in rates:
        assert one["wilson"][0] <= one["succeeded"] / one["images"] <= one["wilson"][1]
    table = pl.read_parquet(out / "images.parquet")
    for one in rates:
        target = "" if one["target"] == "any other" else one["target"]
        rows = table.filter(method=one["method"], epsilon=one["epsilon"], target=target)
        assert (len(rows), int(rows["succeeded"].sum())) == (one["images"], one["succeeded"])
        assert (rows["succeeded"] == (rows["answer"] != rows["label"])).all() or target
    assert json.loads((out / "attack.json").read_text())["epsilons"] == [1, 9]


def test_the_picture_and_the_recording_show_the_attack(model: Path, dataset: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    document = run(model, dataset, "--out", out, "--images", 6, "--steps", 2)
    assert document["exhibit"].startswith("net: disable, moved by at most ±2 steps")
    picture = cv2.imread(str(out / "attack.png"))
    assert picture is not None
    assert picture.shape[1] > 1000
    paths = {str(chunk.entity_path) for chunk in RrdReader(str(out / "attack.rrd")).stream()}
    assert {"/seen", "/original", "/mask", "/answer", "/logits"} <= paths


def test_existing_output_and_the_wrong_network_are_refused(model: Path, dataset: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputExistsError):
        run(model, dataset, "--out", tmp_path)
    with pytest.raises(CheckpointError, match="no such checkpoint"):
        run(tmp_path / "none", dataset)
    with pytest.raises(DatasetError, match="no such folder"):
        run(model, tmp_path / "none")


def test_a_network_that_is_always_wrong_has_nothing_to_count(model: Path, tmp_path: Path) -> None:
    """The pictures are bright below, as for disable, and labelled so; the network is made to say idle to everything."""
    loaded = load_vision_checkpoint(model)
    loaded.network.classifier.weight.zero_()
    loaded.network.classifier.bias.copy_(torch.tensor([5.0, 0.0, 0.0]))
    wrong = ready_to_answer("wrong", loaded.network, loaded.card)
    images = draw_images(2, 12)
    disable = images.labels == Gesture.DISABLE
    shown = (images.images_u8[disable], images.labels[disable])
    summary, exhibit = attack_vision(wrong, *shown, [1], ImageAttackConfig(steps=1), 3, tmp_path / "out")
    assert summary.answered_rightly == 0
    assert {(rate.images, rate.wilson) for rate in summary.rates} == {(0, (0.0, 1.0))}
    assert not exhibit.succeeded
    assert "the attack failed" in exhibit.title


def test_without_images_of_disable_there_is_nothing_to_show(model: Path, dataset: Path, tmp_path: Path) -> None:
    loaded = load_vision_checkpoint(model)
    images_u8, labels = np.zeros((4, 24, 32, 3), np.uint8), np.full(4, 0)
    with pytest.raises(DatasetError, match="no image of disable"):
        attack_vision(loaded, images_u8, labels, [1], ImageAttackConfig(), 3, tmp_path / "out")


def test_the_mask_is_grey_where_nothing_moved_and_full_at_epsilon() -> None:
    image = np.full((1, 3, 3), 100, np.uint8)
    moved = image.copy()
    moved[0, 1] = 102
    moved[0, 2] = 98
    assert magnified_mask(image, moved, 2)[0, :, 0].tolist() == [128, 255, 1]


def test_probabilities_are_the_softmax() -> None:
    shares = probabilities(np.array([0.0, np.log(2.0), 0.0], np.float32))
    np.testing.assert_allclose(shares, [0.25, 0.5, 0.25], rtol=1e-6)
