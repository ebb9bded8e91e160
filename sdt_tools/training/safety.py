"""Safety-domain training: what Algorithm 1 of the paper adds to a step, and when it may end.

The criterion is the paper's Equation 3,

    1/n Σ loss(y_i, f(x_i)) + λ · 1/k Σ max over the domain D_i of loss(z_i, f(x)),

with a set z_i of allowed classes: the loss of a set is -log of its probability mass. How the maximum is found is the
business of an inner maximiser (``training.inner``). Three things keep the training from ending at a constant answer:
λ and the ranges of the domains' far rays grow over the first part of it, and the worst-case loss, which starts at
thousands of nats, enters through log(1 + loss).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import torch
from jaxtyping import Float, Float32, Int64
from pydantic import Field
from torch import Tensor

from sdt_tools.config import Config
from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import FollowNet
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.intervals import MARGIN, certified, difference_bounds, seen_box, worst_margins
from sdt_tools.training.inner import PGDConfig, bound_losses, found_losses

_AT_ONCE: Final = 60
"""Boxes measured at once; the activations of many more leave the processor's cache."""


class SafetyConfig(Config):
    """How strongly, and how, a network is held to its domains.

    ``inner``: ``ibp`` minimises an upper bound of the worst case (certified), ``pgd`` what projected gradient finds
    (empirical). ``weight`` is the paper's λ, ``delta`` its δ: the largest worst-case loss of a domain, in nats, with
    which training may end. At most -log(4/5) = 0.22 nats in every domain mean that an allowed class wins in all of
    them. ``clean_weight`` weighs the loss on the data; 0 leaves the domains alone, as in the paper's Proposition 1.

    Shares are of the planned steps: none before ``start_share``, all of the weight and range after ``ramp_share``
    more. Beyond the planned steps, which are gone when the bound is still above δ, the weight grows: by ``late_growth``
    in as many steps again as were planned, and no further. ``compress`` takes log(1 + loss) of each domain's loss.
    ``domains_a_step`` are drawn by chance, or all taken where there are no more.
    """

    inner: Literal["ibp", "pgd"] = "ibp"
    weight: float = Field(default=1.0, gt=0.0)
    clean_weight: float = Field(default=1.0, ge=0.0)
    delta: float = Field(default=0.2, gt=0.0)
    domains_a_step: int = Field(default=32, ge=1)
    start_share: float = Field(default=0.1, ge=0.0, lt=1.0)
    ramp_share: float = Field(default=0.5, ge=0.0, le=1.0)
    late_growth: float = Field(default=100.0, ge=1.0)
    compress: bool = True
    pgd: PGDConfig = PGDConfig()


@dataclass(frozen=True)
class SafetyRecord:
    """How a network stands to its domains: ``bound`` is the paper's safety bound, the largest loss of a domain in nats.

    It comes from the inner maximiser; what is certified, and by what margin, from interval bounds whatever that is.
    """

    bound: float
    certified_share: float
    worst_margin: float


class SafetyDomains:
    """The domains as a loss of ``network``: Algorithm 1's second term, and its safety bound.

    Draws depend on ``seed`` and the epoch alone.
    """

    def __init__(self, specification: Sequence[DomainSet], network: FollowNet, config: SafetyConfig, seed: int) -> None:
        boxes = [seen_box(network, part) for part in specification]
        self._lower_m = _float32([lower for lower, _ in boxes])
        self._upper_m = _float32([upper for _, upper in boxes])
        self._part = torch.from_numpy(np.repeat(np.arange(len(boxes)), [len(part) for part in specification]))
        self._allowed = [part.allowed for part in specification]
        self._network = network
        self._config = config
        self._seed = seed
        self._generator = torch.Generator()

    @property
    def clean_weight(self) -> float:
        """What the loss on the data counts."""
        return self._config.clean_weight

    def begin(self, epoch: int) -> None:
        """Make the draws of ``epoch``, whatever was drawn before."""
        self._generator.manual_seed(1_000_003 * self._seed + epoch)

    def loss(self, progress: float) -> Float[Tensor, ""]:
        """λ times the mean loss of some domains, when the share ``progress`` of the planned steps is done."""
        config = self._config
        strength = ramp(config, progress)
        if strength == 0.0:
            return torch.zeros(())
        chosen = self._drawn()
        lower_m = self._lower_m[chosen]
        upper_m = narrowed(lower_m, self._upper_m[chosen], strength)
        losses = self._losses(lower_m, upper_m, self._part[chosen])
        if config.compress:
            losses = torch.log1p(losses)
        return weight(config, progress) * losses.mean()

    def measure(self) -> SafetyRecord:
        """All whole domains."""
        losses, shares, margins = [], [], []
        for start in range(0, len(self._part), _AT_ONCE):
            lower_m, upper_m, part = (
                values[start : start + _AT_ONCE] for values in (self._lower_m, self._upper_m, self._part)
            )
            losses.append(self._losses(lower_m, upper_m, part).detach())
            for number, allowed in enumerate(self._allowed):
                of_part = part == number
                if of_part.any():
                    with torch.inference_mode():
                        found = difference_bounds(self._network.layers, lower_m[of_part], upper_m[of_part], allowed)
                    shares.append(certified(found, MARGIN))
                    margins.append(worst_margins(found))
        return SafetyRecord(
            float(torch.cat(losses).max()),
            float(torch.cat(shares).float().mean()),
            float(torch.cat(margins).min()),
        )

    def satisfied(self, record: SafetyRecord) -> bool:
        """Whether the safety bound is at most δ; NaN is not."""
        return record.bound <= self._config.delta

    def _drawn(self) -> Int64[Tensor, "chosen"]:
        count = len(self._part)
        if count <= self._config.domains_a_step:
            return torch.arange(count)
        return torch.randint(count, (self._config.domains_a_step,), generator=self._generator)

    def _losses(
        self,
        lower_m: Float32[Tensor, "chosen rays"],
        upper_m: Float32[Tensor, "chosen rays"],
        part: Int64[Tensor, "chosen"],
    ) -> Float[Tensor, "chosen"]:
        """The worst-case loss of each box, by the inner maximiser; in the order of the parts."""
        losses = []
        for number, allowed in enumerate(self._allowed):
            of_part = part == number
            if not of_part.any():
                continue
            low, high = lower_m[of_part], upper_m[of_part]
            if self._config.inner == "ibp":
                losses.append(bound_losses(self._network, low, high, allowed))
            else:
                losses.append(found_losses(self._network, low, high, allowed, self._config.pgd, self._generator))
        return torch.cat(losses)


def ramp(config: SafetyConfig, progress: float) -> float:
    """Share of λ and of the range at the share ``progress`` of the planned steps: 0, a line, 1."""
    if progress < config.start_share:
        return 0.0
    if config.ramp_share == 0.0:
        return 1.0
    return min(1.0, (progress - config.start_share) / config.ramp_share)


def weight(config: SafetyConfig, progress: float) -> float:
    """λ at the share ``progress`` of the planned steps: it grows along the ramp, and again when they are gone."""
    return config.weight * ramp(config, progress) * math.pow(config.late_growth, min(max(0.0, progress - 1.0), 1.0))


def narrowed(
    lower_m: Float32[Tensor, "boxes rays"], upper_m: Float32[Tensor, "boxes rays"], strength: float
) -> Float32[Tensor, "boxes rays"]:
    """Upper bounds nearer to the lower ones: no ray spans more than ``strength`` of the widest in its box.

    The narrowest ray, the near one in the paper's domains, keeps what it has, and no other gets narrower than it.
    """
    span_m = upper_m - lower_m
    widest_m, narrowest_m = span_m.amax(dim=1, keepdim=True), span_m.amin(dim=1, keepdim=True)
    return lower_m + torch.minimum(span_m, torch.maximum(narrowest_m, strength * widest_m))


def adversarial_domains(
    ranges_m: Float32[np.ndarray, "frames rays"], labels: Int64[np.ndarray, "frames"], epsilon_m: float
) -> tuple[DomainSet, ...]:
    """The domains that make adversarial training of safety-domain training (the paper's Proposition 1).

    One box a frame, within ``epsilon_m`` of each of its code-resolved ranges, and its label the one allowed class.
    """
    return tuple(
        DomainSet(
            name=f"{epsilon_m:g} m around {motion.label}",
            lower_m=np.maximum(ranges_m[labels == motion].astype(np.float64) - epsilon_m, 0.0),
            upper_m=ranges_m[labels == motion].astype(np.float64) + epsilon_m,
            rays=np.flatnonzero(labels == motion),
            allowed=frozenset({motion}),
        )
        for motion in MotionClass
        if (labels == motion).any()
    )


def _float32(parts: Sequence[np.ndarray]) -> Float32[Tensor, "boxes rays"]:
    return torch.from_numpy(np.concatenate(parts).astype(np.float32))
