import json
from pathlib import Path

import pytest
from nearest_object import write_dataset
from typer.testing import CliRunner

from sdt_tools.cli.train import app
from sdt_tools.errors import ConfigError, DatasetError, OutputExistsError, UsageError

SMALL = """
[architecture]
kernels = [9, 3]
widths = [4, 8]
strides = [8, 4]
hidden = 8

[loop]
epochs = 3
"""


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    return write_dataset(tmp_path / "nearest", train=140, val=70)


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "train.toml"
    path.write_text(SMALL)
    return path


def run(*arguments: object) -> str:
    result = CliRunner().invoke(app, ["follow", *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def test_json_is_one_document_and_options_go_before_the_file(dataset: Path, config: Path, tmp_path: Path) -> None:
    out = tmp_path / "model"
    document = json.loads(run(dataset, "--out", out, "--config", config, "--epochs", 1, "--seed", 5, "--json"))
    assert document["checkpoint"] == str(out)
    assert (document["epochs"], document["satisfied"], document["bound"]) == (1, None, None)
    assert document["train_frames"], document["val_frames"] == (140, 70)
    assert 0.0 <= document["val_accuracy"] <= 1.0
    assert "seed = 5" in (out / "model.toml").read_text()


def test_people_get_a_table_on_stderr(dataset: Path, config: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["follow", str(dataset), "--out", str(tmp_path / "m"), "--config", str(config)])
    assert result.stdout == ""
    assert "trained 3 epochs" in result.stderr
    assert "forward recall" in result.stderr


def test_bad_input_is_refused_by_its_name(dataset: Path, config: Path, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="nowhere"):
        run(tmp_path / "nowhere", "--out", tmp_path / "model")
    with pytest.raises(OutputExistsError, match="nearest exists already"):
        run(dataset, "--out", dataset)
    with pytest.raises(ConfigError, match="--epochs: input should be greater than or equal to 1"):
        run(dataset, "--out", tmp_path / "model", "--epochs", 0)


@pytest.mark.parametrize("options", [("--inner", "pgd"), ("--level", "0", "--lambda", "5"), ("--delta", "0.1")])
def test_options_about_domains_want_domains(dataset: Path, tmp_path: Path, options: tuple[str, ...]) -> None:
    with pytest.raises(UsageError, match="nothing without safety domains; add --level or --domains"):
        run(dataset, "--out", tmp_path / "model", *options)
