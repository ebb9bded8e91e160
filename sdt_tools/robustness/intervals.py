"""Interval bound propagation: what a network can answer, at worst, to all scans of a box.

Bounds go through the layers one by one. A layer that is monotone takes the two ends of an interval; one that is affine
takes its centre and radius, the radius by the absolute weights. A last layer that is affine is elided: what is bounded
is the difference of two logits over its inputs, which is tighter than the difference of two bounded logits. Branches
that are added at the end are bounded one by one.

Bounds hold in exact arithmetic. Rounding adds an error of the size of the precision times the activations, so whoever
certifies computes in float64 (``domain_differences``) and asks for a margin.

Dropout is the identity, whatever mode the network is in: bounds speak of the network that answers.
"""

from collections.abc import Sequence
from copy import deepcopy
from typing import Final

import numpy as np
import torch
from jaxtyping import Bool, Float, Float64
from torch import Tensor, nn
from torch.nn import functional

from sdt_tools.errors import CheckpointError
from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import FollowNet
from sdt_tools.models.layers import MaxOverRays, Rays, SoftClip, SumOfBranches
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.models.preprocess import ClipScale
from sdt_tools.robustness.boxes import DomainSet

MARGIN: Final = 1e-3
"""Logits by which an allowed class has to win: hundreds of times what the paper's network loses in float32. A network
of much larger weights loses more, and needs its own."""

_BOXES_AT_ONCE: Final = 40
"""The activations of much larger batches leave the processor's cache."""

_MONOTONE: Final = (ClipScale, nn.ReLU, SoftClip, MaxOverRays)
_RESHAPING: Final = (nn.Unflatten, nn.Flatten, Rays)
_SILENT: Final = (nn.Dropout, nn.Identity)

_Bounds = tuple[Tensor, Tensor]


def difference_bounds(
    layers: nn.Sequential,
    lower_m: Float[Tensor, "boxes rays"],
    upper_m: Float[Tensor, "boxes rays"],
    allowed: frozenset[MotionClass],
) -> Float[Tensor, "boxes allowed forbidden"]:
    """Lower bounds of logit(allowed) - logit(forbidden) in each box, for all pairs, in the order of ``MotionClass``.

    Boxes are in metres and in the precision of the weights. Gradients flow to the weights (and to the boxes).
    Raises CheckpointError for layers that bounds cannot pass.
    """
    return _differences(layers, (lower_m, upper_m), allowed)


def worst_case_loss(differences: Float[Tensor, "boxes allowed forbidden"]) -> Float[Tensor, "boxes"]:
    """-log of the probability mass of the allowed classes under worst-case logits: no scan of the box has a larger one.

    With d bounding z_k - z_f from below, the forbidden mass over the allowed one is at most Σ_f 1 / Σ_k exp(d_kf).
    Finite, and with finite gradients, for differences of any size.
    """
    log_ratio = torch.logsumexp(-torch.logsumexp(differences, dim=1), dim=1)
    return torch.logaddexp(log_ratio, torch.zeros_like(log_ratio))


def worst_margins(differences: Float[Tensor, "boxes allowed forbidden"]) -> Float[Tensor, "boxes"]:
    """By how many logits each forbidden class is provably beaten by some allowed one, at least; negative if one is not.

    It need not be the same class that beats all: where every forbidden logit is below some other one, the largest is
    an allowed class's. There has to be a class of each kind.
    """
    return differences.amax(dim=1).amin(dim=1)


def certified(differences: Float[Tensor, "boxes allowed forbidden"], margin: float = MARGIN) -> Bool[Tensor, "boxes"]:
    """In which boxes every forbidden class is provably beaten by more than ``margin``; never for NaN."""
    return worst_margins(differences) > margin


def domain_differences(network: FollowNet, boxes: DomainSet) -> Float64[np.ndarray, "domains allowed forbidden"]:
    """``difference_bounds`` of all boxes of a set in float64, on one thread; the network is left as it is.

    Raises CheckpointError for layers that bounds cannot pass.
    """
    layers = deepcopy(network.layers).double()
    found = np.empty((len(boxes), len(boxes.allowed), len(MotionClass) - len(boxes.allowed)))
    with one_torch_thread(), torch.inference_mode():
        for start in range(0, len(boxes), _BOXES_AT_ONCE):
            part = slice(start, start + _BOXES_AT_ONCE)
            lower_m, upper_m = torch.tensor(boxes.lower_m[part]), torch.tensor(boxes.upper_m[part])
            found[part] = difference_bounds(layers, lower_m, upper_m, boxes.allowed).numpy()
    return found


def split_classes(allowed: frozenset[MotionClass]) -> tuple[list[int], list[int]]:
    """The allowed and the forbidden classes as indices of logits, each in the order of ``MotionClass``."""
    return [int(motion) for motion in MotionClass if motion in allowed], [
        int(motion) for motion in MotionClass if motion not in allowed
    ]


def seen_box(
    network: nn.Module, boxes: DomainSet
) -> tuple[Float64[np.ndarray, "domains rays"], Float64[np.ndarray, "domains rays"]]:
    """Lower and upper bounds of the part of each box where its scans differ to the network.

    Beyond the range at which a network clips, all scans are one and no gradient leads back.
    """
    clip_m = max((layer.clip_m for layer in network.modules() if isinstance(layer, ClipScale)), default=np.inf)
    return boxes.lower_m, np.maximum(boxes.lower_m, np.minimum(boxes.upper_m, clip_m))


def _named(layers: nn.Sequential) -> Sequence[tuple[str, nn.Module]]:
    named = list(layers.named_children())
    if not named:
        raise CheckpointError("the network has no layers, so there is nothing to bound")
    return named


def _differences(layers: nn.Sequential, bounds: _Bounds, allowed: frozenset[MotionClass]) -> Tensor:
    """Differences of logits after ``layers``: of a sum, the sum of its branches' differences."""
    *inner, (name, last) = _named(layers)
    for inner_name, layer in inner:
        bounds = _through(inner_name, layer, bounds)
    if isinstance(last, SumOfBranches):
        return torch.stack([_differences(branch, bounds, allowed) for branch in last.parts()]).sum(dim=0)
    if isinstance(last, SoftClip):
        lower, upper = _through(name, last, bounds)
        kept, forbidden = split_classes(allowed)
        return lower[:, kept].unsqueeze(2) - upper[:, forbidden].unsqueeze(1)
    return _elided(name, last, bounds, allowed)


def _through(name: str, layer: nn.Module, bounds: _Bounds) -> _Bounds:
    lower, upper = bounds
    if isinstance(layer, _SILENT):
        return bounds
    if isinstance(layer, _MONOTONE + _RESHAPING):
        return layer(lower), layer(upper)
    if isinstance(layer, nn.Conv1d | nn.Linear):
        centre, radius = _affine(name, layer, (lower + upper) / 2, (upper - lower) / 2)
        return centre - radius, centre + radius
    raise CheckpointError(
        f"layer '{name}' is a {type(layer).__name__}, through which no bounds can be propagated; "
        "use Conv1d, Linear, ReLU, Dropout, Flatten, Unflatten and the layers of sdt_tools.models"
    )


def _affine(name: str, layer: nn.Conv1d | nn.Linear, centre: Tensor, radius: Tensor) -> _Bounds:
    """Centre and radius of the layer's outputs, exact for each output by itself."""
    if isinstance(layer, nn.Linear):
        return layer(centre), functional.linear(radius, layer.weight.abs())
    if layer.padding_mode != "zeros":
        raise CheckpointError(f"layer '{name}' pads with '{layer.padding_mode}', but bounds know zeros alone")
    spread = functional.conv1d(
        radius, layer.weight.abs(), None, layer.stride, layer.padding, layer.dilation, layer.groups
    )
    return layer(centre), spread


def _elided(name: str, layer: nn.Module, bounds: _Bounds, allowed: frozenset[MotionClass]) -> Tensor:
    if not isinstance(layer, nn.Linear) or layer.out_features != len(MotionClass):
        raise CheckpointError(
            f"the last layer, '{name}', must be a Linear to {len(MotionClass)} logits, for differences to be bounded"
        )
    kept, forbidden = split_classes(allowed)
    weight = (layer.weight[kept].unsqueeze(1) - layer.weight[forbidden].unsqueeze(0)).flatten(0, 1)
    lower, upper = bounds
    centre = functional.linear((lower + upper) / 2, weight)
    if layer.bias is not None:
        centre = centre + (layer.bias[kept].unsqueeze(1) - layer.bias[forbidden].unsqueeze(0)).flatten()
    radius = functional.linear((upper - lower) / 2, weight.abs())
    return (centre - radius).reshape(len(lower), len(kept), len(forbidden))
