"""Attacks on images, against a linear model, whose worst image is known."""

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from sdt_tools.robustness.image_attacks import ImageAttackConfig, attack_images, fgsm

SHAPE = (3, 6, 8)


class Linear(nn.Module):
    """Logits of classes 0 and 1 that are w·image and 0."""

    def __init__(self, seed: int = 0) -> None:
        super().__init__()
        self.weight = torch.randn(SHAPE, generator=torch.Generator().manual_seed(seed)) / 10

    def forward(self, images: Tensor) -> Tensor:
        score = (images * self.weight).sum(dim=(1, 2, 3)) - (127.0 * self.weight).sum()
        return torch.stack([score, torch.zeros_like(score)], dim=1)


def images_u8(count: int, low: int = 0, high: int = 256, seed: int = 1) -> Tensor:
    return torch.from_numpy(np.random.default_rng(seed).integers(low, high, (count, *SHAPE)).astype(np.uint8))


@pytest.mark.parametrize("label", [0, 1])
def test_on_a_linear_model_fgsm_is_the_worst_image_in_closed_form(label: int) -> None:
    """Class 0 loses most by a step against the sign of its weights, class 1 by one with it."""
    model, images = Linear(), images_u8(5, 10, 240).float()
    found = fgsm(model, images, torch.full((5,), label), epsilon=3)
    direction = -1.0 if label == 0 else 1.0
    torch.testing.assert_close(found, images + 3 * direction * model.weight.sign())
    lost = direction * (model(found) - model(images))[:, 0]
    torch.testing.assert_close(lost, torch.full((5,), 3 * float(model.weight.abs().sum())))


def test_a_targeted_step_goes_the_other_way() -> None:
    model, images = Linear(), images_u8(5, 10, 240).float()
    away, towards = (fgsm(model, images, torch.full((5,), label), 2, label == 1) for label in (0, 1))
    torch.testing.assert_close(away, towards)


@pytest.mark.parametrize("method", ["fgsm", "pgd"])
@pytest.mark.parametrize("epsilon", [0, 1, 2, 7])
def test_no_colour_leaves_epsilon_or_eight_bits(method: str, epsilon: int) -> None:
    images = images_u8(6)
    images[:3] = torch.where(images[:3] < 128, 0, 255).to(torch.uint8)
    config = ImageAttackConfig(method=method, epsilon=epsilon, steps=4)
    found = attack_images(Linear(), images, torch.zeros(6, dtype=torch.long), config)
    assert found.images_u8.dtype == torch.uint8
    assert int((found.images_u8.int() - images.int()).abs().max()) <= epsilon
    if epsilon == 0:
        assert torch.equal(found.images_u8, images)


@pytest.mark.parametrize("method", ["fgsm", "pgd"])
@pytest.mark.parametrize("target", [None, 1])
def test_success_is_judged_on_the_rounded_images(method: str, target: int | None) -> None:
    model, images = Linear(), images_u8(40)
    with torch.inference_mode():
        right = images[model(images.float()).argmax(1) == 0]
    labels = torch.zeros(len(right), dtype=torch.long)
    found = attack_images(model, right, labels, ImageAttackConfig(method=method, epsilon=2), target)
    answers = model(found.images_u8.float()).argmax(1)
    assert torch.equal(found.succeeded, answers == 1)
    margin, reach = model(right.float())[:, 0], 2 * float(model.weight.abs().sum())
    assert 0 < int(found.succeeded.sum()) < len(right)
    assert not found.succeeded[margin > reach].any()  # no image within ±2 is answered otherwise
    assert found.succeeded[margin < 0.8 * reach].float().mean() > 0.9  # away from 0 and 255 all are


def test_on_a_linear_model_projected_gradient_reaches_the_worst_image() -> None:
    model, images = Linear(), images_u8(3, 10, 240)
    found = attack_images(
        model, images, torch.zeros(3, dtype=torch.long), ImageAttackConfig(method="pgd", epsilon=2, steps=20)
    )
    torch.testing.assert_close(found.images_u8.float(), images - 2 * model.weight.sign())


def test_the_same_seed_starts_from_the_same_images() -> None:
    images, labels = images_u8(3), torch.zeros(3, dtype=torch.long)
    one, again, other = (
        attack_images(Linear(), images, labels, ImageAttackConfig(method="pgd", epsilon=5, steps=1, seed=seed))
        for seed in (1, 1, 2)
    )
    assert torch.equal(one.images_u8, again.images_u8)
    assert not torch.equal(one.images_u8, other.images_u8)


def test_nothing_to_attack_is_no_error() -> None:
    found = attack_images(Linear(), images_u8(0), torch.zeros(0, dtype=torch.long), ImageAttackConfig())
    assert len(found.succeeded) == 0
