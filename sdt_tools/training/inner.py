"""The two inner maximisers of Algorithm 1: the worst loss in a box, bounded from above or searched for from below.

The loss of a set of allowed classes is -log of its probability mass; for a set of one it is the cross-entropy.
"""

import torch
from jaxtyping import Float, Float32
from pydantic import Field
from torch import Tensor

from sdt_tools.config import Config
from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import FollowNet
from sdt_tools.robustness.intervals import difference_bounds, split_classes, worst_case_loss


class PGDConfig(Config):
    """Projected gradient (Madry et al. 2017): ``steps`` of a share of each ray's interval, from a random scan of it."""

    steps: int = Field(default=7, ge=0)
    step_share: float = Field(default=0.2, gt=0.0, le=1.0)


def bound_losses(
    network: FollowNet,
    lower_m: Float32[Tensor, "boxes rays"],
    upper_m: Float32[Tensor, "boxes rays"],
    allowed: frozenset[MotionClass],
) -> Float[Tensor, "boxes"]:
    """An upper bound of the worst loss of each box, by intervals: no scan of the box has a larger one."""
    return worst_case_loss(difference_bounds(network.layers, lower_m, upper_m, allowed))


def found_losses(
    network: FollowNet,
    lower_m: Float32[Tensor, "boxes rays"],
    upper_m: Float32[Tensor, "boxes rays"],
    allowed: frozenset[MotionClass],
    config: PGDConfig,
    generator: torch.Generator,
) -> Float[Tensor, "boxes"]:
    """The loss at the worst scan that projected gradient finds in each box: a lower bound of the worst.

    Dropout is off, as it is when the network answers; the mode that the network was in comes back afterwards.
    """
    was_training = network.training
    network.eval()
    try:
        start = torch.rand(lower_m.shape, generator=generator, dtype=lower_m.dtype)
        scan = lower_m + start * (upper_m - lower_m)
        step_m = config.step_share * (upper_m - lower_m)
        with torch.enable_grad():
            for _ in range(config.steps):
                scan = scan.detach().requires_grad_()
                (slope,) = torch.autograd.grad(set_losses(network(scan), allowed).sum(), scan)
                scan = torch.minimum(torch.maximum(scan.detach() + step_m * slope.sign(), lower_m), upper_m)
        return set_losses(network(scan.detach()), allowed)
    finally:
        network.train(was_training)


def set_losses(logits: Float[Tensor, "scans classes"], allowed: frozenset[MotionClass]) -> Float[Tensor, "scans"]:
    """-log of the probability mass of the allowed classes."""
    kept, _ = split_classes(allowed)
    return torch.logsumexp(logits, dim=1) - torch.logsumexp(logits[:, kept], dim=1)
