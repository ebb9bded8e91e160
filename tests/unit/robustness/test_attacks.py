import numpy as np
import pytest
import torch
from torch import nn

from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.attacks import AttackConfig, attack
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import NOT_FORWARD, SafetyLevel, domains


def few(boxes: DomainSet, count: int) -> DomainSet:
    return DomainSet(boxes.name, boxes.lower_m[:count], boxes.upper_m[:count], boxes.rays[:count], boxes.allowed)


def box_set(lower_m: np.ndarray, upper_m: np.ndarray) -> DomainSet:
    return DomainSet("drawn", lower_m, upper_m, np.arange(len(lower_m)), NOT_FORWARD)


def linear(seed: int, rays: int) -> nn.Linear:
    """Only stay and forward compete."""
    torch.manual_seed(seed)
    layer = nn.Linear(rays, 7)
    with torch.no_grad():
        layer.weight[2:] = 0.0
        layer.bias[2:] = -1e4
    return layer


@pytest.fixture
def follow_net() -> FollowNet:
    return new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=3).eval()


@pytest.mark.parametrize("seed", range(5))
def test_the_optimum_of_a_linear_network_is_found_exactly(seed: int) -> None:
    """The violation is linear, so the corner that its signs choose is the only best scan."""
    layer = linear(seed, 12)
    rng = np.random.default_rng(seed)
    lower, upper = rng.uniform(0.0, 1.0, (3, 12)), rng.uniform(1.5, 20.0, (3, 12))
    result = attack(layer, box_set(lower, upper), AttackConfig(restarts=1, steps=30))
    weight, bias = layer.weight.detach().double().numpy(), layer.bias.detach().double().numpy()
    slope = weight[1] - weight[0]
    corner = np.where(slope > 0, upper, lower)
    np.testing.assert_allclose(result.scans_m, corner, rtol=1e-6)
    np.testing.assert_allclose(result.violation, corner @ slope + bias[1] - bias[0], rtol=1e-5, atol=1e-5)


def test_a_box_is_violated_when_its_worst_scan_is_answered_with_a_forbidden_class() -> None:
    """Forward wins beyond 2 m of the only ray."""
    layer = nn.Linear(1, 7)
    with torch.no_grad():
        layer.weight.zero_()
        layer.bias.fill_(-100.0)
        layer.weight[MotionClass.FORWARD] = 1.0
        layer.bias[MotionClass.FORWARD] = -2.0
        layer.bias[MotionClass.STAY] = 0.0
    result = attack(layer, box_set(np.zeros((3, 1)), np.array([[1.5], [2.0], [2.5]])), AttackConfig(restarts=2))
    assert result.violated.tolist() == [False, False, True]
    assert result.answer.tolist() == [MotionClass.STAY, MotionClass.STAY, MotionClass.FORWARD]
    np.testing.assert_allclose(result.violation, [-0.5, 0.0, 0.5], atol=1e-6)


def test_scans_never_leave_their_boxes(follow_net: FollowNet) -> None:
    """In float64, too, where 0.2 m is less than it is in float32."""
    for level in (SafetyLevel.ONE, SafetyLevel.FOUR):
        boxes = few(domains(level), 8)
        result = attack(follow_net, boxes, AttackConfig(restarts=2, steps=5, step_share=1.0))
        assert ((result.scans_m >= boxes.lower_m) & (result.scans_m <= boxes.upper_m)).all()


def test_what_is_said_of_a_scan_is_what_float64_says(follow_net: FollowNet) -> None:
    boxes = few(domains(SafetyLevel.THREE), 8)
    result = attack(follow_net, boxes, AttackConfig(restarts=2, steps=10))
    with torch.inference_mode():
        logits = follow_net.double()(torch.from_numpy(result.scans_m)).numpy()
    np.testing.assert_array_equal(result.answer, logits.argmax(axis=1))
    np.testing.assert_array_equal(result.violated, np.isin(logits.argmax(axis=1), [1, 2, 3]))
    np.testing.assert_allclose(
        result.violation, logits[:, [1, 2, 3]].max(axis=1) - logits[:, [0, 4, 5, 6]].max(axis=1), atol=1e-12
    )


def test_the_seed_decides_everything(follow_net: FollowNet) -> None:
    boxes = few(domains(SafetyLevel.THREE), 4)
    torch.manual_seed(1)
    first = attack(follow_net, boxes, AttackConfig(restarts=2, steps=5, seed=7))
    torch.manual_seed(2)
    again = attack(follow_net, boxes, AttackConfig(restarts=2, steps=5, seed=7))
    other = attack(follow_net, boxes, AttackConfig(restarts=2, steps=5, seed=8))
    np.testing.assert_array_equal(first.scans_m, again.scans_m)
    np.testing.assert_array_equal(first.violation, again.violation)
    assert not np.array_equal(first.scans_m, other.scans_m)


@pytest.mark.parametrize("batch", [1, 3, 7, 100])
def test_the_batch_bounds_what_the_network_sees_at_once_and_changes_nothing(batch: int) -> None:
    class Watched(nn.Module):
        largest = 0

        def __init__(self) -> None:
            super().__init__()
            self.inner = linear(0, 6)

        def forward(self, ranges_m: torch.Tensor) -> torch.Tensor:
            Watched.largest = max(Watched.largest, len(ranges_m))
            logits: torch.Tensor = self.inner(torch.sin(3.0 * ranges_m))
            return logits

    boxes = box_set(np.zeros((5, 6)), np.full((5, 6), 4.0))
    whole = attack(Watched(), boxes, AttackConfig(restarts=4, steps=20, batch=1000))
    Watched.largest = 0
    parts = attack(Watched(), boxes, AttackConfig(restarts=4, steps=20, batch=batch))
    assert Watched.largest == min(batch, 20)
    np.testing.assert_allclose(parts.violation, whole.violation, atol=1e-4)


def test_more_restarts_find_no_less_and_sometimes_more() -> None:
    """One ray with many hills: a restart climbs its own."""

    class Hills(nn.Module):
        def forward(self, ranges_m: torch.Tensor) -> torch.Tensor:
            forward = torch.sin(6.0 * ranges_m[:, 0]) - ranges_m[:, 0]
            return torch.stack([torch.zeros_like(forward), forward, *[torch.full_like(forward, -99.0)] * 5], dim=1)

    boxes = box_set(np.zeros((20, 1)), np.full((20, 1), 10.0))
    one = attack(Hills(), boxes, AttackConfig(restarts=1, step_share=0.02))
    many = attack(Hills(), boxes, AttackConfig(restarts=30, step_share=0.02))
    assert (many.violation >= one.violation).all()
    heights = np.linspace(0.0, 10.0, 100_001)
    highest = (np.sin(6.0 * heights) - heights).max()
    assert many.violation.max() == pytest.approx(highest, abs=0.01)
    assert one.violation.mean() < many.violation.mean() - 1.0


def test_ranges_that_a_network_clips_do_not_hide_the_way_up(follow_net: FollowNet) -> None:
    """To a network that clips at 4 m, level 4 is level 3; a start beyond 4 m would have no slope."""
    config = AttackConfig(restarts=1, steps=20)
    three = attack(follow_net, few(domains(SafetyLevel.THREE), 4), config)
    four = attack(follow_net, few(domains(SafetyLevel.FOUR), 4), config)
    np.testing.assert_array_equal(three.violation, four.violation)


def test_a_box_beyond_the_clip_keeps_its_scans(follow_net: FollowNet) -> None:
    boxes = box_set(np.full((1, 541), 10.0), np.full((1, 541), 12.0))
    result = attack(follow_net, boxes, AttackConfig(restarts=1, steps=3))
    assert ((result.scans_m >= 10.0) & (result.scans_m <= 12.0)).all()


def test_the_network_is_left_as_it_is(follow_net: FollowNet) -> None:
    follow_net.train()
    attack(follow_net, few(domains(SafetyLevel.ONE), 2), AttackConfig(restarts=1, steps=2))
    assert follow_net.training
    assert all(parameter.requires_grad and parameter.grad is None for parameter in follow_net.parameters())
    assert {parameter.dtype for parameter in follow_net.parameters()} == {torch.float32}


def test_no_boxes_no_scans(follow_net: FollowNet) -> None:
    result = attack(follow_net, domains(SafetyLevel.NONE), AttackConfig())
    assert result.scans_m.shape == (0, 541)
    assert len(result.violated) == 0
