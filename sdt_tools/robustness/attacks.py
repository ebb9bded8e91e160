"""Attacks: the search for a scan in a box that is answered with a forbidden class.

Projected gradient ascent on the *violation*, the best forbidden logit minus the best allowed one, from random scans of
the box. It climbs in float32, for speed; what it finds is put back inside the box and judged in float64. A box in which
nothing is found is not thereby certified.
"""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import torch
from jaxtyping import Bool, Float32, Float64, Int64
from pydantic import Field
from torch import Tensor, nn

from sdt_tools.config import Config
from sdt_tools.frames import MotionClass
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.intervals import seen_box, split_classes

_Network = TypeVar("_Network", bound=nn.Module)


class AttackConfig(Config):
    """``restarts`` ascents a box, of ``steps`` steps each, from scans that depend on ``seed``, box and restart alone.

    A step moves each ray by a share of its interval, ``step_share`` at first and falling linearly to 0. ``batch``
    ascents are under way at once, which bounds the memory.
    """

    restarts: int = Field(default=8, ge=1)
    steps: int = Field(default=50, ge=1)
    step_share: float = Field(default=0.1, gt=0.0, le=1.0)
    batch: int = Field(default=128, ge=1)
    seed: int = Field(default=0, ge=0)


@dataclass(frozen=True, eq=False)
class AttackResult:
    """The worst scan found in each box, inside it in float64, and the network's answer to it in float64.

    ``violation`` is the best forbidden logit minus the best allowed one; ``violated`` where it is positive, that is,
    where ``answer`` is forbidden and not by a tie.
    """

    scans_m: Float64[np.ndarray, "domains rays"]
    violation: Float64[np.ndarray, "domains"]
    answer: Int64[np.ndarray, "domains"]
    violated: Bool[np.ndarray, "domains"]


def attack(network: nn.Module, boxes: DomainSet, config: AttackConfig) -> AttackResult:
    """Search every box of a set, on one thread. ``network`` maps ranges in metres to logits, and is left as it is."""
    climber, judge = _frozen(network).float(), _frozen(network).double()
    lower_m, upper_m = seen_box(network, boxes)
    worst_m = (lower_m + upper_m) / 2
    violation = np.full(len(boxes), -np.inf)
    with one_torch_thread():
        for box, start_m in _starts(lower_m, upper_m, config):
            found_m = _climb(climber, start_m, lower_m[box], upper_m[box], boxes.allowed, config)
            found_m = np.clip(found_m, boxes.lower_m[box], boxes.upper_m[box])
            _, reached = _judged(judge, found_m, boxes.allowed)
            for row in np.argsort(reached, kind="stable"):  # rising, so that the best of a box comes last
                if reached[row] > violation[box[row]]:
                    worst_m[box[row]], violation[box[row]] = found_m[row], reached[row]
        answer, violation = _judged_in_batches(judge, worst_m, boxes.allowed, config.batch)
    return AttackResult(worst_m, violation, answer, violation > 0.0)


def _frozen(network: _Network) -> _Network:
    return deepcopy(network).eval().requires_grad_(False)


def _starts(
    lower_m: Float64[np.ndarray, "domains rays"], upper_m: Float64[np.ndarray, "domains rays"], config: AttackConfig
) -> Iterator[tuple[Int64[np.ndarray, "ascents"], Float64[np.ndarray, "ascents rays"]]]:
    """Batches of ascents: the box of each, and a scan in it to start from.

    The first of a box starts at its upper bounds, where a network that takes the nearest ray of all sees most of them
    far away and has a slope; the others start at uniformly random scans.
    """
    box, restart = np.divmod(np.arange(len(lower_m) * config.restarts), config.restarts)
    for first in range(0, len(box), config.batch):
        part = slice(first, first + config.batch)
        share = np.array(
            [
                np.random.default_rng((config.seed, own, number)).random(lower_m.shape[1])
                if number
                else np.ones(lower_m.shape[1])
                for own, number in zip(box[part].tolist(), restart[part].tolist(), strict=True)
            ]
        )
        low, high = lower_m[box[part]], upper_m[box[part]]
        yield box[part], low + share * (high - low)


def _climb(
    network: nn.Module,
    start_m: Float64[np.ndarray, "ascents rays"],
    lower_m: Float64[np.ndarray, "ascents rays"],
    upper_m: Float64[np.ndarray, "ascents rays"],
    allowed: frozenset[MotionClass],
    config: AttackConfig,
) -> Float64[np.ndarray, "ascents rays"]:
    """The scan of the largest violation on the way up from each start."""
    low, high = _float32(lower_m), _float32(upper_m)
    scan = torch.clamp(_float32(start_m), low, high)
    best_scan, best = scan.clone(), torch.full((len(scan),), -torch.inf)
    for step in range(config.steps + 1):
        scan = scan.requires_grad_()
        violation = _violation(network(scan), allowed)
        (slope,) = torch.autograd.grad(violation.sum(), scan)
        scan, reached = scan.detach(), violation.detach()
        better = reached > best
        best_scan, best = torch.where(better.unsqueeze(1), scan, best_scan), torch.where(better, reached, best)
        length = config.step_share * (1.0 - step / config.steps) * (high - low)
        scan = torch.clamp(scan + length * slope.sign(), low, high)
    return best_scan.double().numpy()


def _violation(logits: Tensor, allowed: frozenset[MotionClass]) -> Tensor:
    kept, forbidden = split_classes(allowed)
    return logits[:, forbidden].amax(dim=1) - logits[:, kept].amax(dim=1)


def _float32(values: Float64[np.ndarray, "ascents rays"]) -> Float32[Tensor, "ascents rays"]:
    return torch.from_numpy(values.astype(np.float32))


def _judged(
    judge: nn.Module, scans_m: Float64[np.ndarray, "scans rays"], allowed: frozenset[MotionClass]
) -> tuple[Int64[np.ndarray, "scans"], Float64[np.ndarray, "scans"]]:
    """Answer and violation in float64."""
    with torch.inference_mode():
        logits: Tensor = judge(torch.from_numpy(scans_m))
        return logits.argmax(dim=1).numpy(), _violation(logits, allowed).numpy()


def _judged_in_batches(
    judge: nn.Module, scans_m: Float64[np.ndarray, "scans rays"], allowed: frozenset[MotionClass], batch: int
) -> tuple[Int64[np.ndarray, "scans"], Float64[np.ndarray, "scans"]]:
    answer, violation = np.empty(len(scans_m), np.int64), np.empty(len(scans_m))
    for first in range(0, len(scans_m), batch):
        part = slice(first, first + batch)
        answer[part], violation[part] = _judged(judge, scans_m[part], allowed)
    return answer, violation
