"""Theorem 1: the mean loss inside the union of the safety domains is at most that outside.

The rule, fixed before data were looked at. Each frame's loss is averaged over the networks of a level; the number that
decides is the mean inside less the mean outside, its interval over resampled recordings. Undecided with fewer than
``min_frames_inside`` frames or ``min_recordings_inside`` recordings inside; supported where the interval lies at or
below 0; contradicted where it lies above. The premises are reported beside it and do not change the verdict.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from jaxtyping import Bool, Float64

from sdt_tools.error_analysis.claims.locality import Correlogram
from sdt_tools.error_analysis.claims.material import Material, allowed_loss
from sdt_tools.error_analysis.claims.options import LOSS_NAMES, ClaimOptions
from sdt_tools.error_analysis.claims.premises import (
    bound_below_training_loss,
    bound_holds_for_labels,
    locality,
    no_conflicts,
    training_stability,
)
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, Finding, at_most, reason_of, undecided
from sdt_tools.error_analysis.resampling import Estimate, difference_of_ratios, estimate, ratio

CLAIM: Final = "theorem_1"
STATEMENT: Final = "The mean loss inside the union of the safety domains is at most that outside."
PICTURE: Final = "theorem_1.png"


def judge_theorem(
    material: Material, paths: Sequence[Path], correlogram: Correlogram | None, options: ClaimOptions
) -> list[ClaimVerdict]:
    """A verdict for each level of the networks that were held to domains."""
    if not material.certified_levels:
        return [undecided(CLAIM, "", STATEMENT, "no network that was held to safety domains was given")]
    return [_judge(material, level, paths, correlogram, options) for level in material.certified_levels]


def _judge(
    material: Material, level: int, paths: Sequence[Path], correlogram: Correlogram | None, options: ClaimOptions
) -> ClaimVerdict:
    inside = material.inside(level)
    frames, recordings = material.frames_with(inside)
    networks = [material.networks[place] for place in material.places(level)]
    bounded = np.array([allowed_loss(paths, network.name, material.frames, level) for network in networks])
    premises = (
        bound_below_training_loss(networks),
        no_conflicts(material, inside),
        bound_holds_for_labels(bounded, material.mean_loss(level, "cross_entropy")[inside], networks),
        training_stability(material, level, options),
        locality(correlogram, options),
    )
    decisive = _difference(material, material.mean_loss(level, options.loss), inside)
    finding = at_most(decisive, 0.0)
    reason = reason_of(finding, "lower inside, or equal", "higher inside")
    if frames < options.min_frames_inside or recordings < options.min_recordings_inside:
        finding = Finding.UNDECIDED
        reason = (
            f"{frames} frames of {recordings} recordings lie inside; "
            f"{options.min_frames_inside} of {options.min_recordings_inside} are needed"
        )
    return ClaimVerdict(
        claim=CLAIM,
        about=f"level {level}",
        statement=STATEMENT,
        finding=finding,
        reason=reason,
        measure=f"mean loss inside less outside ({options.loss})",
        estimate=decisive,
        frames=frames,
        recordings=recordings,
        picture=PICTURE,
        numbers=_numbers(material, level, inside),
        premises=premises,
    )


def _numbers(material: Material, level: int, inside: Bool[np.ndarray, "frames"]) -> dict[str, Any]:
    """Means inside and outside of the level's networks and of those without domains, in both losses.

    ``same_recordings``: the difference within the recordings that have frames inside, where scenes are the same.
    ``beyond_standard``: the level's difference less that of level 0, which is what safety training did.
    """
    alone = [_difference(material, material.frames.loss_ce[place], inside).value for place in material.places(level)]
    numbers: dict[str, Any] = {"networks": len(alone), "networks_that_agree": int(np.sum(np.array(alone) <= 0.0))}
    there = np.isin(material.frames.recording, np.unique(material.frames.recording[inside]))
    for name in LOSS_NAMES:
        safe = material.mean_loss(level, name)
        entry = {
            "inside": estimate(_part(material, safe, inside), ratio, material.draws).document(),
            "outside": estimate(_part(material, safe, ~inside), ratio, material.draws).document(),
            "difference": _difference(material, safe, inside).document(),
            "same_recordings": _difference(material, safe, inside, there).document(),
        }
        if material.places(0):
            standard = material.mean_loss(0, name)
            entry |= {
                "standard_inside": estimate(_part(material, standard, inside), ratio, material.draws).document(),
                "standard_outside": estimate(_part(material, standard, ~inside), ratio, material.draws).document(),
                "beyond_standard": _difference(material, safe - standard, inside).document(),
            }
        numbers[name] = entry
    return numbers


def _difference(
    material: Material,
    loss: Float64[np.ndarray, "frames"],
    inside: Bool[np.ndarray, "frames"],
    among: Bool[np.ndarray, "frames"] | None = None,
) -> Estimate:
    """Mean inside less mean outside, of all frames or ``among`` some."""
    outside = ~inside if among is None else ~inside & among
    sums = np.concatenate([_part(material, loss, inside), _part(material, loss, outside)])
    return estimate(sums, difference_of_ratios, material.draws)


def _part(
    material: Material, loss: Float64[np.ndarray, "frames"], where: Bool[np.ndarray, "frames"]
) -> Float64[np.ndarray, "2 recordings"]:
    """Loss and frames of a part, by recording."""
    return material.sums(np.array([np.where(where, loss, 0.0), where.astype(np.float64)]))
