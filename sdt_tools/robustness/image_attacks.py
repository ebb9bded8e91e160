"""Attacks on images: fast gradient sign and projected gradient, in whole steps of 8-bit colour.

Images are red, green, blue of 0 to 255, after resizing and before normalisation. An attack moves no colour by more than
``epsilon`` steps nor out of 0 to 255; what it found is rounded to 8 bits, and judged after that.
"""

from dataclasses import dataclass
from typing import Final, Literal

import torch
from jaxtyping import Bool, Float, Int64, UInt8
from pydantic import Field
from torch import Tensor, nn
from torch.nn import functional

from sdt_tools.config import Config
from sdt_tools.models.loaded import one_torch_thread

AT_ONCE: Final = 4
"""Images under way at once: the activations of many large ones leave the processor's cache."""

Method = Literal["fgsm", "pgd"]


class ImageAttackConfig(Config):
    """How images are attacked.

    ``fgsm`` (Goodfellow et al. 2015) takes one step of ``epsilon``. ``pgd`` (Madry et al. 2018) takes ``steps`` of a
    quarter of it from ``restarts`` random images within it, which depend on ``seed`` alone; the best of them counts.
    """

    method: Method = "fgsm"
    epsilon: int = Field(default=1, ge=0, le=255)
    steps: int = Field(default=10, ge=1)
    restarts: int = Field(default=1, ge=1)
    seed: int = Field(default=0, ge=0)


@dataclass(frozen=True, eq=False)
class ImageAttackResult:
    """Attacked images, the logits of each, and whether the attack did what it was for.

    That is another answer than the label, or, with a target, the target.
    """

    images_u8: UInt8[Tensor, "images 3 height width"]
    logits: Float[Tensor, "images classes"]
    succeeded: Bool[Tensor, "images"]


def attack_images(
    network: nn.Module,
    images_u8: UInt8[Tensor, "images 3 height width"],
    labels: Int64[Tensor, "images"],
    config: ImageAttackConfig,
    target: int | None = None,
) -> ImageAttackResult:
    """Attack each image on one thread: away from its label, or towards the class ``target``.

    ``network`` maps colours of 0 to 255 to logits; it is asked as it stands, so put it in inference mode.
    """
    generator = torch.Generator().manual_seed(config.seed)
    goals = labels if target is None else torch.full_like(labels, target)
    found, logits = images_u8.clone(), []
    with one_torch_thread():
        for start in range(0, len(images_u8), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            found[part], answers = _attack_batch(
                network, images_u8[part], goals[part], config, target is not None, generator
            )
            logits.append(answers)
    answered = torch.cat(logits) if logits else torch.empty(0, 0)
    hit = answered.argmax(1) == goals if len(goals) else torch.empty(0, dtype=torch.bool)
    return ImageAttackResult(found, answered, ~hit if target is None else hit)


def fgsm(
    network: nn.Module,
    images: Float[Tensor, "batch 3 height width"],
    labels: Int64[Tensor, "batch"],
    epsilon: int,
    targeted: bool = False,
) -> Float[Tensor, "batch 3 height width"]:
    """Images of whole colours, each moved by ``epsilon`` up the slope of its loss, or down that of its target.

    A colour without a slope stays as it is; so does everything at ``epsilon`` 0.
    """
    if epsilon == 0:
        return images
    step = epsilon * _ascent(network, images, labels, targeted)
    return torch.clamp(images + step, 0.0, 255.0)


def pgd(
    network: nn.Module,
    images: Float[Tensor, "batch 3 height width"],
    labels: Int64[Tensor, "batch"],
    config: ImageAttackConfig,
    generator: torch.Generator,
    targeted: bool = False,
) -> Float[Tensor, "batch 3 height width"]:
    """One ascent from a random image within ``epsilon``, rounded to whole colours at its end."""
    epsilon = config.epsilon
    low, high = torch.clamp(images - epsilon, 0.0, 255.0), torch.clamp(images + epsilon, 0.0, 255.0)
    moved = low + torch.rand(images.shape, generator=generator) * (high - low)
    for _ in range(config.steps):
        step = epsilon / 4 * _ascent(network, moved, labels, targeted)
        moved = torch.minimum(torch.maximum(moved + step, low), high)
    return torch.round(moved)


def _attack_batch(
    network: nn.Module,
    images_u8: UInt8[Tensor, "batch 3 height width"],
    goals: Int64[Tensor, "batch"],
    config: ImageAttackConfig,
    targeted: bool,
    generator: torch.Generator,
) -> tuple[UInt8[Tensor, "batch 3 height width"], Float[Tensor, "batch classes"]]:
    """The attacked images in 8 bits, and the answers to those very images."""
    images = images_u8.float()
    best_u8 = images_u8
    best = _answers(network, best_u8)
    for _ in range(config.restarts if config.method == "pgd" else 1):
        if config.method == "fgsm":
            moved = fgsm(network, images, goals, config.epsilon, targeted)
        else:
            moved = pgd(network, images, goals, config, generator, targeted)
        moved_u8 = moved.to(torch.uint8)
        assert int((moved_u8.int() - images_u8.int()).abs().max()) <= config.epsilon
        answers = _answers(network, moved_u8)
        gained = _gain(answers, goals, targeted) > _gain(best, goals, targeted)
        if config.method == "fgsm":
            gained = torch.ones_like(gained)  # its one try counts, for better or worse
        best_u8 = torch.where(gained[:, None, None, None], moved_u8, best_u8)
        best = torch.where(gained[:, None], answers, best)
    return best_u8, best


def _answers(network: nn.Module, images_u8: UInt8[Tensor, "batch 3 height width"]) -> Float[Tensor, "batch classes"]:
    with torch.no_grad():
        logits: Tensor = network(images_u8.float())
    return logits


def _gain(
    logits: Float[Tensor, "batch classes"], goals: Int64[Tensor, "batch"], targeted: bool
) -> Float[Tensor, "batch"]:
    """What an attack wants large: by how much the other logits, in soft maximum, exceed the goal's; or the reverse.

    It grows and falls with the cross-entropy, log(1 + exp(gain)), and has the same sign of its slope, but never goes
    flat where float32 takes a sure answer's probability for 1.
    """
    goal = functional.one_hot(goals, logits.shape[1]).bool()
    others = logits.masked_fill(goal, -torch.inf).logsumexp(dim=1)
    gain = others - logits[goal]
    return -gain if targeted else gain


def _ascent(
    network: nn.Module, images: Float[Tensor, "batch 3 height width"], labels: Int64[Tensor, "batch"], targeted: bool
) -> Float[Tensor, "batch 3 height width"]:
    """The sign of the slope that an attack goes up."""
    asked = images.detach().requires_grad_()
    with torch.enable_grad():
        gain = _gain(network(asked), labels, targeted).sum()
    (slope,) = torch.autograd.grad(gain, asked)
    return slope.sign()
