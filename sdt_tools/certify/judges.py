"""The same network computed three ways, and how far they are apart.

A proof is made in float64, torch trains and drives in float32, and others will run the exported graph. A scan counts as
a violation when all three agree that it is one.
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Float64
from torch import nn

from sdt_tools.certify.onnx_answers import OnnxNetwork
from sdt_tools.certify.onnx_export import onnx_model
from sdt_tools.frames import RAYS, MotionClass
from sdt_tools.models.loaded import LoadedModel, one_torch_thread
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.intervals import split_classes


@dataclass(frozen=True, eq=False)
class Judges:
    """The network in float64 and float32 as torch computes it, and in float32 as ONNX Runtime does."""

    exact: nn.Module
    single: nn.Module
    onnx: OnnxNetwork


@dataclass(frozen=True)
class Judgement:
    """``violation`` is the best forbidden logit minus the best allowed one in float64; ``answer`` is float32's.

    ``unanimous`` where all three answer with a forbidden class, and not by a tie.
    """

    violation: float
    answer: MotionClass
    unanimous: bool


def judges_of(model: LoadedModel) -> Judges:
    """The three. Raises CheckpointError for a layer that cannot be exported; ``model`` is left as it is."""
    exact, single = (deepcopy(model.network).eval().requires_grad_(False) for _ in range(2))
    return Judges(exact.double(), single.float(), OnnxNetwork(onnx_model(model)))


def judge(judges: Judges, scan_m: Float64[np.ndarray, "rays"], allowed: frozenset[MotionClass]) -> Judgement:
    """What the three say of one scan."""
    with one_torch_thread(), torch.inference_mode():
        exact = judges.exact(torch.from_numpy(scan_m[None])).numpy()[0]
        single = judges.single(torch.from_numpy(scan_m[None]).float()).numpy()[0]
    every = (exact, single, judges.onnx.logits(scan_m[None])[0])
    found = [violation_of(logits, allowed) for logits in every]
    return Judgement(found[0], MotionClass(int(single.argmax())), all(violation > 0.0 for violation in found))


def violation_of(logits: Float[np.ndarray, "classes"], allowed: frozenset[MotionClass]) -> float:
    """The best forbidden logit minus the best allowed one."""
    kept, forbidden = split_classes(allowed)
    return float(logits[forbidden].max()) - float(logits[kept].max())


def representable(
    scan_m: Float64[np.ndarray, "rays"], lower_m: Float64[np.ndarray, "rays"], upper_m: Float64[np.ndarray, "rays"]
) -> Float64[np.ndarray, "rays"]:
    """The scan with each range moved to a nearby float32 number inside its bounds, where there is one.

    So that float32 and float64 are asked the same, and it lies in the domain for both: 0.2 m itself is none.
    """
    near = scan_m.astype(np.float32)
    near = np.where(near > upper_m, np.nextafter(near, np.float32(-np.inf)), near)
    near = np.where(near < lower_m, np.nextafter(near, np.float32(np.inf)), near)
    return np.clip(near.astype(np.float64), lower_m, upper_m)


def numerical_error(judges: Judges, specification: Sequence[DomainSet], scans: int, seed: int) -> float:
    """The largest difference between a logit of ONNX Runtime in float32 and of torch in float64, found in the domains.

    Each domain gives its two extreme scans, and ``scans`` random ones, half of them corners. What rounding a scan to
    float32 does is part of it. A measurement, not a bound: no other scan is promised to lose less. NaN where an answer
    is not finite; domains that are no boxes of scans are left out.
    """
    worst = 0.0
    for number, boxes in enumerate(specification):
        if boxes.lower_m.shape[1] != RAYS:
            continue  # no scan of the sensor's; whoever bounds it says so
        sound = np.isfinite(boxes.lower_m).all(axis=1) & np.isfinite(boxes.upper_m).all(axis=1)
        for domain in np.flatnonzero(sound).tolist():
            generator = np.random.default_rng((seed, number, domain))
            probe_m = _probes(boxes.lower_m[domain], boxes.upper_m[domain], scans, generator)
            with one_torch_thread(), torch.inference_mode():
                exact = judges.exact(torch.from_numpy(probe_m)).numpy()
            worst = float(np.maximum(worst, np.abs(judges.onnx.logits(probe_m) - exact).max()))
    return worst


def _probes(
    lower_m: Float64[np.ndarray, "rays"],
    upper_m: Float64[np.ndarray, "rays"],
    scans: int,
    generator: np.random.Generator,
) -> Float64[np.ndarray, "scans rays"]:
    """The extremes, then random scans: corners, and scans spread over a random share of the box."""
    share = generator.random((scans, len(lower_m)))
    corners = scans // 2
    share[:corners] = share[:corners] < generator.random((corners, 1))
    share[corners:] *= generator.random((scans - corners, 1))
    return np.vstack([lower_m, upper_m, lower_m + share * (upper_m - lower_m)])
