"""What Theorem 1 and Implication 1 rest on, held against the material."""

from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float32, Float64

from sdt_tools.error_analysis.claims.locality import Correlogram
from sdt_tools.error_analysis.claims.material import Material, Network
from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.error_analysis.claims.verdict import Premise
from sdt_tools.frames import FORWARD_CLASSES

_FORBIDDEN = [motion.label for motion in FORWARD_CLASSES]


def bound_below_training_loss(networks: list[Network]) -> Premise:
    """Theorem 1 assumes δ to be at most the training loss; the δ of its proof is the bound that was reached."""
    known = [
        (network.bound, network.train_loss)
        for network in networks
        if network.bound is not None and network.train_loss is not None
    ]
    name = "δ ≤ training loss"
    if len(known) < len(networks):
        return Premise(name, None, "a checkpoint lacks the bound or the training loss (curve.csv) of its training")
    bounds, losses = zip(*known, strict=True)
    asked = {network.delta for network in networks if network.delta is not None}
    text = (
        f"bounds reached at most {max(bounds):.2g} nats (asked for: {', '.join(f'{delta:g}' for delta in asked)}), "
        f"training losses at least {min(losses):.2g}"
    )
    return Premise(name, max(bounds) <= min(losses), text)


def no_conflicts(material: Material, inside: Bool[np.ndarray, "frames"]) -> Premise:
    """No frame inside the domains is labelled with a class that they forbid."""
    conflicts = int(np.isin(material.frames.column("label")[inside].astype(str), _FORBIDDEN).sum())
    return Premise("non-conflicting data", conflicts == 0, f"{conflicts} of {int(inside.sum())} frames inside conflict")


def bound_holds_for_labels(
    allowed_loss: Float64[np.ndarray, "networks inside"],
    loss_ce: Float64[np.ndarray, "inside"],
    networks: list[Network],
) -> Premise:
    """The first step of the proof: the loss of a frame inside is at most the bound of its domain.

    It takes the domain's answer to be the label. Where domains allow a set of classes the bound is about the set, and
    says nothing of which class of it is answered.
    """
    name = "the bound covers the labels inside"
    if allowed_loss.size == 0:
        return Premise(name, None, "no frame lies inside")
    bounds = [network.bound for network in networks if network.bound is not None]
    limit = max(bounds) if bounds else None
    text = (
        f"inside, the loss of the allowed set is {allowed_loss.max():.2g} nats at most and that of the label "
        f"{loss_ce.mean():.2g} on average, against a bound of {'?' if limit is None else f'{limit:.2g}'}"
    )
    return Premise(name, None if limit is None else bool(loss_ce.mean() <= limit), text)


def training_stability(material: Material, level: int, options: ClaimOptions) -> Premise:
    """Training again changes little: frames that one network gets right and its like wrong, among those of level 0.

    Held where that is at most ``stable_share`` of what changes from level 0 to the level.
    """
    name = "training stability"
    standard, safe = material.places(0), material.places(level)
    if len(standard) < 2 or not safe:
        return Premise(name, None, "needs two networks of level 0 or more, trained with different seeds")
    wrong = material.frames.wrong
    again = float(np.mean([np.mean(wrong[a] != wrong[b]) for a, b in combinations(standard, 2)]))
    between = float(np.mean([np.mean(wrong[a] != wrong[b]) for a in standard for b in safe]))
    text = f"training again changes {again:.1%} of the answers' correctness, level {level} changes {between:.1%}"
    return Premise(name, again <= options.stable_share * between, text)


def locality(correlogram: Correlogram | None, options: ClaimOptions) -> Premise:
    """Beyond some K, the loss at one frame says nothing of the loss at another."""
    name = "locality with some K"
    if correlogram is None:
        return Premise(name, None, "distances between frames need their scans; add --recordings")
    reach_m = correlogram.reach_m(options.local_correlation)
    limit = f"correlations of losses across recordings are at most {options.local_correlation:g}"
    if reach_m is None:
        return Premise(name, False, f"{limit} at no distance up to {correlogram.upper_m[-1]:.2f} m")
    return Premise(name, True, f"{limit} beyond K = {reach_m:.2f} m, up to {correlogram.upper_m[-1]:.2f} m")


def situations_sample(
    scans: Float32[np.ndarray, "frames rays"], options: ClaimOptions
) -> tuple[np.ndarray, Float32[np.ndarray, "sample rays"]]:
    """Frames spread evenly over all, and their scans clipped as distances take them."""
    rows = np.unique(np.linspace(0, len(scans) - 1, min(options.locality_frames, len(scans))).astype(np.int64))
    return rows, np.minimum(scans[rows], np.float32(options.errors.clip_m))
