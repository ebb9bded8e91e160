"""Layers that torch does not have, each simple enough that bounds pass through it."""

from collections.abc import Mapping

import torch
from jaxtyping import Float
from torch import Tensor, nn


class Rays(nn.Module):
    """The rays ``first`` to ``last``, both included."""

    def __init__(self, first: int, last: int) -> None:
        super().__init__()
        self.first = first
        self.last = last

    def forward(self, scans: Float[Tensor, "batch rays"]) -> Float[Tensor, "batch chosen"]:
        """The chosen rays of each scan."""
        return scans[:, self.first : self.last + 1]


class MaxOverRays(nn.Module):
    """The largest value of each channel, wherever along the scan it stands."""

    def forward(self, features: Float[Tensor, "batch channels rays"]) -> Float[Tensor, "batch channels"]:
        """The maxima."""
        return features.amax(dim=2)


class SoftClip(nn.Module):
    """Logits kept within ±``limit`` by limit · tanh(z / limit), which leaves small ones nearly as they are."""

    def __init__(self, limit: float) -> None:
        super().__init__()
        self.limit = limit

    def forward(self, logits: Float[Tensor, "batch classes"]) -> Float[Tensor, "batch classes"]:
        """The limited logits."""
        return self.limit * torch.tanh(logits / self.limit)


class SumOfBranches(nn.Module):
    """Several networks that see the same input, their logits added."""

    def __init__(self, branches: Mapping[str, nn.Sequential]) -> None:
        super().__init__()
        self.branches = nn.ModuleDict(branches)

    def parts(self) -> list[nn.Sequential]:
        """The branches, in order."""
        return [branch for branch in self.branches.values() if isinstance(branch, nn.Sequential)]

    def forward(self, scans: Float[Tensor, "batch rays"]) -> Float[Tensor, "batch classes"]:
        """The sum over the branches."""
        logits: Tensor = torch.stack([branch(scans) for branch in self.branches.values()]).sum(dim=0)
        return logits
