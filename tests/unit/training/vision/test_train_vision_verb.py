import json
from pathlib import Path

import pytest
from corner_gestures import TINY_CONFIG, write_dataset
from typer.testing import CliRunner

from sdt_tools.cli.train import app
from sdt_tools.config import dump_config
from sdt_tools.errors import CheckpointError, ConfigError, DatasetError, UsageError


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    return write_dataset(tmp_path / "gestures")


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "train.toml"
    path.write_text(dump_config(TINY_CONFIG))
    return path


def run(*arguments: object) -> str:
    result = CliRunner().invoke(app, ["vision", *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def test_json_is_one_document_and_options_go_before_the_file(dataset: Path, config: Path, tmp_path: Path) -> None:
    out = tmp_path / "model"
    document = json.loads(
        run(dataset, "--out", out, "--config", config, "--epochs", 1, "--epsilon", 2, "--seed", 5, "--json")
    )
    assert (document["checkpoint"], document["epochs"], document["epsilon"]) == (str(out), 1, 2)
    assert 0.0 <= document["adversarial_train_accuracy"] <= document["train_accuracy"] <= 1.0
    assert 0.0 <= document["val_accuracy"] <= 1.0
    assert document["seconds"] >= 0.0
    assert (document["train_frames"], document["val_frames"]) == (48, 24)
    assert "seed = 5" in (out / "model.toml").read_text()


def test_people_get_a_table_on_stderr(dataset: Path, config: Path, tmp_path: Path) -> None:
    words = ["vision", str(dataset), "--out", str(tmp_path / "m"), "--config", str(config)]
    result = CliRunner().invoke(app, words)
    assert result.stdout == ""
    assert "trained 3 epochs" in result.stderr
    assert "recall of enable" in result.stderr


@pytest.mark.parametrize(
    ("words", "error", "said"),
    [
        (["--backbone", "vgg"], UsageError, "--backbone vgg: no such backbone; choose lite0 or resnet50"),
        (["--last-blocks", "17"], ConfigError, "last_blocks is 17, but the network has 16"),
        (["--weights", "nowhere.pth"], CheckpointError, "nowhere.pth: no such file"),
        (["--epochs", "0"], ConfigError, "--epochs"),
        (["--width", "3"], ConfigError, "--width"),
    ],
)
def test_wrong_options_are_refused_in_one_line(
    dataset: Path, tmp_path: Path, words: list[str], error: type[Exception], said: str
) -> None:
    with pytest.raises(error) as caught:
        run(dataset, "--out", tmp_path / "model", *words)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_backbone_beside_a_file_that_has_one_is_refused(dataset: Path, config: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="says already what the network is"):
        run(dataset, "--out", tmp_path / "m", "--config", config, "--backbone", "lite0")


def test_bad_data_are_named(dataset: Path, config: Path, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="nowhere"):
        run(tmp_path / "nowhere", "--out", tmp_path / "m", "--config", config)
