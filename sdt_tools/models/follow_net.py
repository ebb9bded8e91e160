"""The paper's follow network: nine layers of one-dimensional convolution and full connection, 541 ranges to 7 logits.

Seven convolutions and two full connections with ReLU between them, and no batch norm, which interval bounds do not
survive in training. The layers stand in ``FollowNet.layers``, in order and by name, so that bounds can be propagated
through them one by one.
"""

from collections import OrderedDict
from typing import ClassVar

import torch
from jaxtyping import Float
from pydantic import Field, model_validator
from torch import Tensor, nn

from sdt_tools.config import Config
from sdt_tools.frames import RAYS, MotionClass
from sdt_tools.models.preprocess import ClipScale, PreprocessConfig


class FollowNetConfig(Config):
    """Shape of the network: one entry of ``kernels``, ``widths`` and ``strides`` a convolution.

    ``hidden`` neurons stand before the logits. Kernels are odd and padded by half, so that the scan's ends are seen.
    ``dropout`` is the share of the inputs of each full connection that is dropped in training, and in training alone.
    """

    kernels: tuple[int, ...] = (7, 5, 5, 3, 3, 3, 3)
    widths: tuple[int, ...] = (12, 16, 24, 32, 32, 32, 32)
    strides: tuple[int, ...] = (2, 2, 2, 2, 2, 2, 1)
    hidden: int = Field(default=48, ge=1)
    dropout: float = Field(default=0.5, ge=0.0, lt=1.0)

    @model_validator(mode="after")
    def _fits(self) -> "FollowNetConfig":
        if not len(self.kernels) == len(self.widths) == len(self.strides) > 0:
            raise ValueError("kernels, widths and strides need one entry a convolution each")
        if min(self.kernels) < 1 or min(self.widths) < 1 or min(self.strides) < 1:
            raise ValueError("kernels, widths and strides must be positive")
        if any(kernel % 2 == 0 for kernel in self.kernels):
            raise ValueError("kernels must be odd")
        return self


class FollowNet(nn.Module):
    """Code-resolved ranges in metres, [batch, 541] float32, to logits over the seven motion classes.

    ``layers`` is a Sequential of ClipScale, Unflatten, seven times Conv1d and ReLU, Flatten, and Linear, ReLU, Linear
    with Dropout before each Linear.
    """

    kind: ClassVar[str] = "follow_plain"
    architecture: Config
    preprocess: PreprocessConfig
    layers: nn.Sequential

    def __init__(self, architecture: FollowNetConfig, preprocess: PreprocessConfig) -> None:
        super().__init__()
        self.architecture = architecture
        self.preprocess = preprocess
        with torch.random.fork_rng(devices=[]):  # torch draws weights for each layer; nobody else's numbers shall move
            self.layers = nn.Sequential(follow_layers(architecture, preprocess))

    def forward(self, ranges_m: Float[Tensor, "batch rays"]) -> Float[Tensor, "batch classes"]:
        """The logits, in the order of ``MotionClass``."""
        logits: Tensor = self.layers(ranges_m)
        return logits


def new_follow_net(architecture: FollowNetConfig, preprocess: PreprocessConfig, seed: int) -> FollowNet:
    """A network with random weights that depend on ``seed`` alone."""
    network = FollowNet(architecture, preprocess)
    draw_weights(network, seed)
    return network


def draw_weights(network: FollowNet, seed: int) -> None:
    """Give ``network`` new random weights that depend on ``seed`` alone.

    Weights and biases are uniform within ±1/√(inputs of a neuron). That is less than what keeps the signal's size from
    layer to layer (He's initialisation), and it generalises better from a few thousand scans.
    """
    generator = torch.Generator().manual_seed(seed)
    for layer in network.layers.modules():
        if isinstance(layer, nn.Conv1d | nn.Linear):
            bound = layer.weight[0].numel() ** -0.5
            for parameter in layer.parameters():
                nn.init.uniform_(parameter, -bound, bound, generator=generator)


def follow_layers(architecture: FollowNetConfig, preprocess: PreprocessConfig) -> "OrderedDict[str, nn.Module]":
    """The layers of a plain network by name, in order."""
    layers: OrderedDict[str, nn.Module] = OrderedDict(
        clip_scale=ClipScale(preprocess.clip_m, preprocess.scale_m), channel=nn.Unflatten(1, (1, RAYS))
    )
    channels, length = 1, RAYS
    shapes = zip(architecture.kernels, architecture.widths, architecture.strides, strict=True)
    for number, (kernel, width, stride) in enumerate(shapes, start=1):
        layers[f"conv{number}"] = nn.Conv1d(channels, width, kernel, stride, padding=kernel // 2)
        layers[f"conv{number}_relu"] = nn.ReLU()
        channels, length = width, (length - 1) // stride + 1
    layers["flatten"] = nn.Flatten()
    layers["dropout1"] = nn.Dropout(architecture.dropout)
    layers["full1"] = nn.Linear(channels * length, architecture.hidden)
    layers["full1_relu"] = nn.ReLU()
    layers["dropout2"] = nn.Dropout(architecture.dropout)
    layers["full2"] = nn.Linear(architecture.hidden, len(MotionClass))
    return layers
