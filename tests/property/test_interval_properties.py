"""Bounds over drawn networks and boxes: no scan, random or attacked, ever falls below them."""

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import nn

from sdt_tools.frames import MotionClass
from sdt_tools.models.preprocess import ClipScale
from sdt_tools.robustness.attacks import AttackConfig, attack
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.intervals import certified, difference_bounds, worst_case_loss, worst_margins

RAYS = 9
SEEDS = st.integers(0, 2**31)
ALLOWED = st.frozensets(st.sampled_from(list(MotionClass)), min_size=1, max_size=6)


@st.composite
def networks(draw: st.DrawFn) -> nn.Sequential:
    """Networks of the follow network's layers, of drawn shape and weights."""
    torch.manual_seed(draw(SEEDS))
    layers: list[nn.Module] = [ClipScale(draw(st.sampled_from([1.0, 4.0, 20.0]))), nn.Unflatten(1, (1, RAYS))]
    channels, length = 1, RAYS
    for _ in range(draw(st.integers(0, 3))):
        width, kernel, stride = draw(st.integers(1, 4)), draw(st.sampled_from([1, 3, 5])), draw(st.integers(1, 2))
        layers += [nn.Conv1d(channels, width, kernel, stride, padding=kernel // 2), nn.ReLU()]
        channels, length = width, (length - 1) // stride + 1
    layers += [nn.Flatten(), nn.Dropout(0.5), nn.Linear(channels * length, 6), nn.ReLU(), nn.Linear(6, 7)]
    scale = draw(st.sampled_from([1.0, 5.0]))
    network = nn.Sequential(*layers).double().eval()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter *= scale
    return network


def drawn_box(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    one, other = rng.uniform(0.0, 6.0, (2, 1, RAYS))
    other = np.where(rng.random(one.shape) < 0.2, one, other)  # some rays are known exactly
    return np.minimum(one, other), np.maximum(one, other)


def pairs(logits: torch.Tensor, allowed: frozenset[MotionClass]) -> torch.Tensor:
    kept, rest = sorted(allowed), sorted(set(MotionClass) - allowed)
    return torch.stack([torch.stack([logits[:, k] - logits[:, f] for f in rest], 1) for k in kept], 1)


def tolerance(differences: torch.Tensor) -> float:
    return 1e-12 * (1.0 + differences.abs().max().item())


@given(networks(), SEEDS, ALLOWED)
@settings(deadline=None)
def test_random_scans_and_corners_stay_above_the_bounds(
    network: nn.Sequential, seed: int, allowed: frozenset[MotionClass]
) -> None:
    lower, upper = drawn_box(seed)
    rng = np.random.default_rng(seed)
    share = np.concatenate([rng.random((100, RAYS)), rng.integers(0, 2, (100, RAYS))])
    scans = torch.from_numpy(np.clip(lower + share * (upper - lower), lower, upper))
    bound = difference_bounds(network, torch.from_numpy(lower), torch.from_numpy(upper), allowed)
    with torch.inference_mode():
        reached = pairs(network(scans), allowed)
        loss = -torch.log_softmax(network(scans), dim=1)[:, sorted(allowed)].logsumexp(dim=1)
    assert (reached >= bound - tolerance(bound)).all()
    assert (loss <= worst_case_loss(bound) + tolerance(bound)).all()


@given(networks(), SEEDS, ALLOWED)
@settings(deadline=None, max_examples=50)
def test_attacks_stay_below_what_is_proved(network: nn.Sequential, seed: int, allowed: frozenset[MotionClass]) -> None:
    lower, upper = drawn_box(seed)
    boxes = DomainSet("drawn", lower, upper, np.zeros(1, np.int64), allowed)
    result = attack(network, boxes, AttackConfig(restarts=3, steps=15, seed=seed))
    bound = difference_bounds(network, torch.from_numpy(lower), torch.from_numpy(upper), allowed)
    assert ((result.scans_m >= lower) & (result.scans_m <= upper)).all()
    assert result.violation[0] <= -worst_margins(bound).item() + tolerance(bound)
    assert not (certified(bound, 0.0).numpy() & result.violated).any()


@given(networks(), SEEDS)
@settings(deadline=None)
def test_a_smaller_box_has_no_looser_bounds(network: nn.Sequential, seed: int) -> None:
    lower, upper = drawn_box(seed)
    rng = np.random.default_rng(seed)
    cut = np.sort(rng.random((2, 1, RAYS)), axis=0)
    inner_lower, inner_upper = (torch.from_numpy(lower + part * (upper - lower)) for part in cut)
    allowed = frozenset({MotionClass.STAY, MotionClass.BACKWARD})
    outer = difference_bounds(network, torch.from_numpy(lower), torch.from_numpy(upper), allowed)
    inner = difference_bounds(network, inner_lower, inner_upper, allowed)
    assert (inner >= outer - tolerance(outer)).all()


@given(networks(), SEEDS, ALLOWED)
@settings(deadline=None)
def test_a_box_of_one_scan_has_the_bounds_of_its_logits(
    network: nn.Sequential, seed: int, allowed: frozenset[MotionClass]
) -> None:
    scan = torch.from_numpy(drawn_box(seed)[0])
    bound = difference_bounds(network, scan, scan, allowed)
    torch.testing.assert_close(bound, pairs(network(scan), allowed), rtol=0, atol=10 * tolerance(network(scan)))


@given(networks(), SEEDS)
@settings(deadline=None)
def test_float32_is_float64_but_for_rounding(network: nn.Sequential, seed: int) -> None:
    lower, upper = (torch.from_numpy(side) for side in drawn_box(seed))
    allowed = frozenset({MotionClass.STAY})
    double = difference_bounds(network, lower, upper, allowed)
    single = difference_bounds(network.float(), lower.float(), upper.float(), allowed)
    assert (single.double() - double).abs().max() <= 1e-4 * (1.0 + double.abs().max())
