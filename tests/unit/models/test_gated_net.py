"""The gated network: its parts worked out by hand, and its bounds against what it answers."""

from pathlib import Path

import pytest
import torch
from pydantic import ValidationError

from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import load_checkpoint, save_checkpoint
from sdt_tools.models.follow_net import FollowNetConfig, new_follow_net
from sdt_tools.models.gated_net import GateConfig, GatedFollowNet, GatedNetConfig, new_gated_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.domains import NOT_FORWARD, SafetyLevel, domains
from sdt_tools.robustness.intervals import difference_bounds

SMALL = GatedNetConfig(trunk=FollowNetConfig(kernels=(9, 5), widths=(4, 6), strides=(6, 4), hidden=8))
KEPT, FORBIDDEN = [0, 4, 5, 6], [1, 2, 3]


@pytest.fixture
def network() -> GatedFollowNet:
    return new_gated_net(SMALL, PreprocessConfig(), seed=3).eval()


def scans(count: int) -> torch.Tensor:
    return 6.0 * torch.rand(count, 541, generator=torch.Generator().manual_seed(1))


def test_logits_are_the_limited_trunk_plus_the_vote_of_the_nearest_rays(network: GatedFollowNet) -> None:
    ranges_m = scans(3)
    weights = network.state_dict()
    plain = new_follow_net(SMALL.trunk, PreprocessConfig(), seed=3).eval()
    prefix = "layers.sum.branches.trunk."
    trunk = {name.removeprefix(prefix): value for name, value in weights.items() if name.startswith(prefix)}
    plain.layers.load_state_dict(trunk)
    gate = {name.rpartition("gate.")[2]: value for name, value in weights.items() if "gate." in name}
    near = ranges_m[:, 150:390].clamp(0.0, 0.6) * (2 / 0.6) - 1
    first = torch.relu(near.unsqueeze(2) * gate["ray1.weight"].flatten() + gate["ray1.bias"])
    second = torch.relu(first @ gate["ray2.weight"].squeeze(2).T + gate["ray2.bias"])
    vote = second.amax(dim=1) @ gate["vote.weight"].T + gate["vote.bias"]
    torch.testing.assert_close(network(ranges_m), 8 * torch.tanh(plain(ranges_m) / 8) + vote)


def test_the_gate_sees_the_front_rays_alone(network: GatedFollowNet) -> None:
    gate = network.layers[0].branches["gate"]
    far = torch.full((1, 541), 3.0)
    for ray, seen in ((149, False), (150, True), (389, True), (390, False)):
        near = far.clone()
        near[0, ray] = 0.1
        assert bool((gate(near) != gate(far)).any()) is seen


def test_the_trunk_cannot_outvote_its_limit(network: GatedFollowNet) -> None:
    with torch.no_grad():
        network.layers[0].branches["trunk"].full2.bias.fill_(1e4)
    assert network.layers[0].branches["trunk"](scans(4)).abs().max() <= 8.0


def test_bounds_hold_for_scans_of_the_domains(network: GatedFollowNet) -> None:
    boxes = domains(SafetyLevel.FOUR)
    lower, upper = (torch.tensor(side[::20], dtype=torch.float64) for side in (boxes.lower_m, boxes.upper_m))
    network.double()
    found = difference_bounds(network.layers, lower, upper, NOT_FORWARD)
    generator = torch.Generator().manual_seed(0)
    for corner in (False, True):
        for _ in range(50):
            share = torch.rand(lower.shape, generator=generator, dtype=torch.float64)
            logits = network(lower + (share.round() if corner else share) * (upper - lower))
            assert (logits[:, KEPT].unsqueeze(2) - logits[:, FORBIDDEN].unsqueeze(1) >= found - 1e-9).all()


def test_the_gate_alone_is_bounded_exactly_by_its_one_near_ray() -> None:
    """A gate that votes 30 · max(0, 1 - range / 0.5 m) against forward, over a silent trunk."""
    config = GatedNetConfig(trunk=SMALL.trunk, gate=GateConfig(widths=(1,), near_m=0.5))
    network = GatedFollowNet(config, PreprocessConfig()).double()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.zero_()
        gate = network.layers[0].branches["gate"]
        gate.ray1.weight.fill_(-0.5)
        gate.ray1.bias.fill_(0.5)
        gate.vote.weight[FORBIDDEN] = -30.0
    boxes = domains(SafetyLevel.FOUR)
    lower, upper = torch.tensor(boxes.lower_m[:3]), torch.tensor(boxes.upper_m[:3])
    found = difference_bounds(network.layers, lower, upper, NOT_FORWARD)
    torch.testing.assert_close(found, torch.full_like(found, 30 * (1 - 0.2 / 0.5)))


def test_a_gated_checkpoint_comes_back(network: GatedFollowNet, tmp_path: Path) -> None:
    card = ModelCard(kind=GatedFollowNet.kind, seed=3, architecture=SMALL, preprocess=network.preprocess)
    save_checkpoint(tmp_path / "gate", network, card)
    loaded = load_checkpoint(tmp_path / "gate")
    assert isinstance(loaded.network, GatedFollowNet)
    assert loaded.card.architecture == SMALL
    torch.testing.assert_close(loaded.network(scans(2)), network(scans(2)))


@pytest.mark.parametrize("wrong", [{"widths": ()}, {"widths": (8, 0)}, {"first_ray": 300, "last_ray": 200}])
def test_impossible_gates_are_refused(wrong: dict) -> None:
    with pytest.raises(ValidationError):
        GateConfig(**wrong)
