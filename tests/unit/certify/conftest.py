"""Networks whose margins are known by hand, and three domains to ask them about.

All of them see one ray, 270, straight ahead: two hidden neurons both hold its nearness, 1 - range / 4 m, which is 0.95
to 1 below 0.2 m and 0 from 4 m on.
"""

from collections.abc import Callable, Mapping

import numpy as np
import pytest
import torch

from sdt_tools.frames import MotionClass
from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import NOT_FORWARD, SafetyLevel, domains

AHEAD = 270
Votes = Mapping[MotionClass, tuple[float, float, float]]
"""For a class, the weights of the two nearnesses, and the bias; classes left out have logit 0."""


@pytest.fixture
def watching() -> Callable[[Votes], LoadedModel]:
    """Builds a network that watches ray 270."""

    def build(votes: Votes) -> LoadedModel:
        shape = FollowNetConfig(kernels=(1,), widths=(1,), strides=(1,), hidden=2, dropout=0.0)
        network = FollowNet(shape, PreprocessConfig(clip_m=4.0))
        layers = network.layers
        with torch.no_grad():
            for parameter in network.parameters():
                parameter.zero_()
            layers.conv1.weight.fill_(-0.5)
            layers.conv1.bias.fill_(0.5)
            layers.full1.weight[:, AHEAD] = 1.0
            for motion, (first, second, bias) in votes.items():
                layers.full2.weight[motion] = torch.tensor([first, second])
                layers.full2.bias[motion] = bias
        metrics = {"val_accuracy": 0.5, "val_forward_recall": 0.25}
        card = ModelCard(kind=network.kind, seed=0, architecture=shape, preprocess=network.preprocess, metrics=metrics)
        return LoadedModel("watching", network.eval(), card)

    return build


@pytest.fixture
def careful(watching: Callable[[Votes], LoadedModel]) -> LoadedModel:
    """Stays by up to 10 logits when ray 270 is near, and wants to drive forward by 2 always."""
    return watching({MotionClass.STAY: (10.0, 0.0, 0.0), MotionClass.FORWARD: (0.0, 0.0, 2.0)})


@pytest.fixture
def boxes() -> DomainSet:
    """The domains of rays 150, 270 and 389 of level 4."""
    four = domains(SafetyLevel.FOUR)
    chosen = np.array([0, AHEAD - 150, 239])
    return DomainSet("three of level 4", four.lower_m[chosen], four.upper_m[chosen], four.rays[chosen], NOT_FORWARD)
