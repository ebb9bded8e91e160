"""Safety-domain training against what can be worked out by hand, and against adversarial training written anew."""

import math

import numpy as np
import pytest
import torch
from nearest_object import draw_frames
from torch.nn import functional

from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.domains import NOT_FORWARD, SafetyLevel, domains
from sdt_tools.training.inner import PGDConfig, bound_losses, found_losses, set_losses
from sdt_tools.training.loop import Batch, LoopConfig, run_loop
from sdt_tools.training.safety import SafetyConfig, SafetyDomains, adversarial_domains, narrowed, ramp, weight
from sdt_tools.training.schedule import LearningRateConfig

SMALL = FollowNetConfig(kernels=(9, 5), widths=(4, 6), strides=(6, 4), hidden=8, dropout=0.0)
EPSILON_M = 0.05
PGD = PGDConfig(steps=3, step_share=0.25)


def small_network(seed: int = 0) -> FollowNet:
    return new_follow_net(SMALL, PreprocessConfig(), seed)


def few_frames() -> tuple[np.ndarray, np.ndarray]:
    scans, labels = draw_frames(seed=5, count=24)
    order = np.argsort(labels, kind="stable")
    return np.maximum(scans[order], 0.2).astype(np.float32), labels[order]


class OneBatch:
    """Clean data that are not to count."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch

    def __len__(self) -> int:
        return 1

    def epoch(self, number: int):
        yield self._batch


def test_the_loss_of_a_set_is_minus_the_logarithm_of_its_share() -> None:
    logits = torch.tensor([[1.0, -2.0, 0.5, 3.0, 0.0, 1.0, -1.0]])
    share = functional.softmax(logits, dim=1)[0, [0, 4, 5, 6]].sum()
    assert set_losses(logits, NOT_FORWARD).item() == pytest.approx(-math.log(share.item()), rel=1e-6)


def test_the_loss_of_one_class_is_the_cross_entropy() -> None:
    logits = torch.randn(5, 7, generator=torch.Generator().manual_seed(0))
    label = MotionClass.LEFT_FORWARD
    expected = functional.cross_entropy(logits, torch.full((5,), int(label)), reduction="none")
    torch.testing.assert_close(set_losses(logits, frozenset({label})), expected)


def test_no_scan_of_a_domain_has_a_larger_loss_than_the_bound() -> None:
    network = small_network()
    boxes = domains(SafetyLevel.THREE)
    lower, upper = (torch.tensor(side[:8], dtype=torch.float32) for side in (boxes.lower_m, boxes.upper_m))
    bound = bound_losses(network, lower, upper, NOT_FORWARD)
    found = found_losses(network, lower, upper, NOT_FORWARD, PGDConfig(steps=20), torch.Generator().manual_seed(1))
    assert (found <= bound).all()
    assert (found > set_losses(network((lower + upper) / 2), NOT_FORWARD)).all()


def test_projected_gradient_stays_in_its_box_and_leaves_the_mode_as_it_was() -> None:
    seen: list[torch.Tensor] = []
    network = small_network().train()
    network.register_forward_pre_hook(lambda _module, arguments: seen.append(arguments[0].detach()))
    lower, upper = torch.full((2, 541), 0.5), torch.full((2, 541), 0.9)
    found_losses(network, lower, upper, NOT_FORWARD, PGDConfig(steps=5, step_share=1.0), torch.Generator())
    assert network.training
    assert len(seen) == 6
    assert all(((scan >= lower) & (scan <= upper)).all() for scan in seen)


@pytest.mark.parametrize(("progress", "strength"), [(0.0, 0.0), (0.1, 0.0), (0.35, 0.5), (0.6, 1.0), (0.9, 1.0)])
def test_strength_rises_on_a_line(progress: float, strength: float) -> None:
    assert ramp(SafetyConfig(start_share=0.1, ramp_share=0.5), progress) == pytest.approx(strength)


def test_far_rays_open_up_while_the_near_one_stands() -> None:
    lower, upper = torch.zeros(1, 4), torch.tensor([[4.0, 0.2, 4.0, 2.0]])
    torch.testing.assert_close(narrowed(lower, upper, 0.5), torch.tensor([[2.0, 0.2, 2.0, 2.0]]))
    torch.testing.assert_close(narrowed(lower, upper, 0.01), torch.full((1, 4), 0.2))
    torch.testing.assert_close(narrowed(lower, upper, 1.0), upper)


def test_nothing_is_added_before_the_start() -> None:
    safety = SafetyDomains((domains(SafetyLevel.ONE),), small_network(), SafetyConfig(start_share=0.3), seed=0)
    safety.begin(1)
    assert safety.loss(0.29).item() == 0.0
    assert safety.loss(0.9).item() > 0.0


def test_the_safety_bound_is_the_largest_loss_of_a_domain() -> None:
    network = small_network()
    boxes = domains(SafetyLevel.TWO)
    record = SafetyDomains((boxes,), network, SafetyConfig(), seed=0).measure()
    lower, upper = (torch.tensor(side, dtype=torch.float32) for side in (boxes.lower_m, boxes.upper_m))
    assert record.bound == pytest.approx(bound_losses(network, lower, upper, NOT_FORWARD).max().item(), rel=1e-5)


def test_only_a_bound_at_most_delta_satisfies() -> None:
    safety = SafetyDomains((domains(SafetyLevel.ONE),), small_network(), SafetyConfig(delta=0.2), seed=0)
    record = safety.measure()
    for bound, expected in ((0.2, True), (0.21, False), (math.nan, False)):
        assert safety.satisfied(type(record)(bound, 1.0, 1.0)) is expected


def test_draws_of_an_epoch_do_not_depend_on_those_before() -> None:
    safety = SafetyDomains((domains(SafetyLevel.ONE),), small_network(), SafetyConfig(), seed=3)
    safety.begin(7)
    first = safety.loss(1.0).item()
    safety.loss(1.0)
    safety.begin(7)
    assert safety.loss(1.0).item() == first


def test_adversarial_training_is_the_special_case_of_balls_around_the_data() -> None:
    """Proposition 1: balls around the samples as domains, their labels allowed, and no other data.

    Beside it adversarial training as Madry et al. write it, min over the weights of the mean of max cross-entropy over
    the ball, in plain torch.
    """
    scans, labels = few_frames()
    network = small_network()
    everything = Batch(torch.from_numpy(scans), torch.from_numpy(labels))
    config = SafetyConfig(
        inner="pgd", clean_weight=0.0, weight=1.0, start_share=0.0, ramp_share=0.0, compress=False,
        domains_a_step=1000, pgd=PGD,
    )  # fmt: skip
    safety = SafetyDomains(adversarial_domains(scans, labels, EPSILON_M), network, config, seed=0)
    loop = LoopConfig(
        epochs=6,
        extra_epochs=0,
        learning_rate=LearningRateConfig(peak=1e-2, warm_up_share=0.0, decay_share=0.0),
        gradient_norm=1e9,
    )
    run_loop(network, OneBatch(everything), everything, loop, 0, [].append, safety)

    beside = small_network()
    adversarially_train(beside, everything, epochs=6)
    for one, other in zip(network.parameters(), beside.parameters(), strict=True):
        torch.testing.assert_close(one, other, rtol=1e-3, atol=1e-5)
    moved = [
        (one - other).abs().max() for one, other in zip(network.parameters(), small_network().parameters(), strict=True)
    ]
    assert min(moved) > 1e-3


def adversarially_train(network: FollowNet, data: Batch, epochs: int) -> None:
    """Adversarial training by projected gradient, whole data a step; the starts are those that epoch numbers give."""
    optimizer = torch.optim.AdamW(network.parameters(), lr=1e-2, weight_decay=0.05)
    for epoch in range(1, epochs + 1):
        generator = torch.Generator().manual_seed(epoch)
        centre, delta = data.ranges_m, []
        for label in range(7):
            count = int((data.labels == label).sum())
            delta.append((2 * torch.rand((count, 541), generator=generator) - 1) * EPSILON_M)
        noise = torch.cat(delta)
        for _ in range(PGD.steps):
            noise.requires_grad_()
            loss = functional.cross_entropy(network(centre + noise), data.labels, reduction="sum")
            (slope,) = torch.autograd.grad(loss, noise)
            noise = (noise.detach() + PGD.step_share * 2 * EPSILON_M * slope.sign()).clamp(-EPSILON_M, EPSILON_M)
        loss = functional.cross_entropy(network(centre + noise), data.labels)
        optimizer.zero_grad()
        torch.autograd.backward(loss)
        optimizer.step()


def test_lambda_grows_when_the_planned_steps_are_gone() -> None:
    config = SafetyConfig(weight=2.0, start_share=0.1, ramp_share=0.5, late_growth=100.0)
    assert [weight(config, progress) for progress in (0.05, 0.35, 0.6, 1.0, 1.5, 2.0, 40.0)] == pytest.approx(
        [0, 1, 2, 2, 20, 200, 200]
    )
