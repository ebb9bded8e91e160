"""The gated follow network: a bounded trunk that sees the whole scan, and a gate that watches each front ray by itself.

A domain of the safety specification says something about one ray and nothing about the others. Interval bounds lose
that ray among 540 free ones in a network that mixes them from its first layer on; the gate keeps it apart, and the
trunk, the paper's network, is bounded so that the gate can outvote it:

    logits = limit · tanh(trunk / limit) + W · max over front rays of g(range)

with g a small network that is the same for each ray. All weights are learned together. Three things are given, not
learned: which rays are watched, that the trunk is bounded, and that the gate forgets what is farther than ``near_m``.
"""

from collections import OrderedDict
from typing import ClassVar, Final

import torch
from pydantic import Field, model_validator
from torch import nn

from sdt_tools.config import Config
from sdt_tools.frames import RAYS, MotionClass
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, draw_weights, follow_layers
from sdt_tools.models.layers import MaxOverRays, Rays, SoftClip, SumOfBranches
from sdt_tools.models.preprocess import FIRST_FRONT_RAY, LAST_FRONT_RAY, ClipScale, PreprocessConfig

GATE: Final = "gate"
TRUNK: Final = "trunk"


class GateConfig(Config):
    """The gate, and how it goes with the trunk.

    ``widths``: channels of the layers that see one ray each. ``near_m``: ranges beyond it look alike to the gate.
    ``limit``: bound of the trunk's logits. ``first_ray`` and ``last_ray``, both watched, are those of the paper's
    domains.
    """

    widths: tuple[int, ...] = (8, 8)
    near_m: float = Field(default=0.6, gt=0.0)
    limit: float = Field(default=8.0, gt=0.0)
    first_ray: int = Field(default=FIRST_FRONT_RAY, ge=0, lt=RAYS)
    last_ray: int = Field(default=LAST_FRONT_RAY, ge=0, lt=RAYS)

    @model_validator(mode="after")
    def _fits(self) -> "GateConfig":
        if not self.widths or min(self.widths) < 1:
            raise ValueError("widths must be one or more positive numbers")
        if self.first_ray > self.last_ray:
            raise ValueError(f"first_ray {self.first_ray} comes after last_ray {self.last_ray}")
        return self


class GatedNetConfig(Config):
    """Shape of a gated network: its trunk is a plain one."""

    trunk: FollowNetConfig = FollowNetConfig()
    gate: GateConfig = GateConfig()


class GatedFollowNet(FollowNet):
    """Code-resolved ranges in metres, [batch, 541] float32, to logits over the seven motion classes.

    ``layers`` is a Sequential of one ``SumOfBranches``, whose branches ``trunk`` and ``gate`` are Sequentials.
    """

    kind: ClassVar[str] = "follow_gate"

    def __init__(self, architecture: GatedNetConfig, preprocess: PreprocessConfig) -> None:
        nn.Module.__init__(self)
        self.architecture = architecture
        self.preprocess = preprocess
        with torch.random.fork_rng(devices=[]):  # torch draws weights for each layer; nobody else's numbers shall move
            trunk = follow_layers(architecture.trunk, preprocess)
            trunk["limited"] = SoftClip(architecture.gate.limit)
            branches = {TRUNK: nn.Sequential(trunk), GATE: nn.Sequential(_gate_layers(architecture.gate))}
            self.layers = nn.Sequential(OrderedDict(sum=SumOfBranches(branches)))


def new_gated_net(architecture: GatedNetConfig, preprocess: PreprocessConfig, seed: int) -> GatedFollowNet:
    """A network with random weights that depend on ``seed`` alone; its trunk begins as a plain network of that seed."""
    network = GatedFollowNet(architecture, preprocess)
    draw_weights(network, seed)
    return network


def _gate_layers(config: GateConfig) -> "OrderedDict[str, nn.Module]":
    rays = config.last_ray - config.first_ray + 1
    layers: OrderedDict[str, nn.Module] = OrderedDict(
        front=Rays(config.first_ray, config.last_ray), near=ClipScale(config.near_m), channel=nn.Unflatten(1, (1, rays))
    )
    channels = 1
    for number, width in enumerate(config.widths, start=1):
        layers[f"ray{number}"] = nn.Conv1d(channels, width, 1)
        layers[f"ray{number}_relu"] = nn.ReLU()
        channels = width
    layers["max"] = MaxOverRays()
    layers["vote"] = nn.Linear(channels, len(MotionClass))
    return layers
