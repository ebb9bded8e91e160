"""Implication 1: what safety training adds in errors lies near the boundaries of the safety domains.

The paper prints ‖x - x̃‖ ≥ K for it, where its title and its proof mean *near*; so the excess loss of the networks of a
level over those of level 0 is tested as a decreasing function of the distance to the domains.

The rule, fixed before data were looked at. Of the frames outside the domains, excess is the loss averaged over the
level's networks less that over level 0's. The number that decides is Spearman's correlation of excess and distance, its
interval over resampled recordings (ranks are those of all frames). Undecided where in no bin of distance the excess is
above 0 by its interval, since then nothing was added that could lie anywhere, and with fewer than ``min_recordings``
recordings; supported where the interval lies below 0; contradicted where it lies above.
"""

from typing import Any, Final

import numpy as np
from jaxtyping import Float64, Int64
from sklearn.isotonic import isotonic_regression

from sdt_tools.error_analysis.claims.locality import Correlogram
from sdt_tools.error_analysis.claims.material import Material
from sdt_tools.error_analysis.claims.options import LOSS_NAMES, ClaimOptions, LossName
from sdt_tools.error_analysis.claims.premises import locality, training_stability
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, Finding, Premise, at_most, reason_of, undecided
from sdt_tools.error_analysis.resampling import (
    Estimate,
    correlation,
    difference_of_ratios,
    estimate,
    moments,
    ratio,
)

CLAIM: Final = "implication_1"
STATEMENT: Final = "What safety training adds in errors decreases with the distance to the safety domains."
PICTURE: Final = "implication_1.png"


def judge_implication(material: Material, correlogram: Correlogram | None, options: ClaimOptions) -> list[ClaimVerdict]:
    """A verdict for each level of the networks that were held to domains."""
    if not material.certified_levels or not material.places(0):
        return [undecided(CLAIM, "", STATEMENT, "needs networks of level 0 and others that were held to domains")]
    return [_judge(material, level, correlogram, options) for level in material.certified_levels]


def _judge(material: Material, level: int, correlogram: Correlogram | None, options: ClaimOptions) -> ClaimVerdict:
    distance_m = material.distance_m(level)
    outside = np.isfinite(distance_m) & ~material.inside(level)
    frames, recordings = material.frames_with(outside)
    if recordings < options.min_recordings:
        reason = f"{recordings} recordings have frames outside; {options.min_recordings} are needed"
        return undecided(CLAIM, f"level {level}", STATEMENT, reason, frames=frames, recordings=recordings)
    bins, edges_m = _binned(distance_m, outside, options.bins)
    trends = {name: _trend(material, level, name, distance_m, outside, bins) for name in LOSS_NAMES}
    decisive, numbers = trends[options.loss]
    added = any((bound["low"] or 0.0) > 0.0 for bound in numbers["curve"])
    finding = at_most(decisive, 0.0) if added else Finding.UNDECIDED
    reason = reason_of(finding, "the excess falls with distance", "the excess grows with distance")
    if not added:
        reason = "at no distance are more errors made than without domains"
    scenarios = _by_scenario(material, level, distance_m, outside, options)
    against = sum(1 for one in scenarios.values() if one.low > 0.0)
    alone = sum(1 for one in scenarios.values() if one.high < 0.0)
    if added and scenarios:
        reason += f"; within scenarios it falls in {alone} of {len(scenarios)}" + (
            f", grows in {against}" if against else ""
        )
    vanishes = [edge for edge, bound in zip(edges_m[1:], numbers["curve"], strict=True) if (bound["low"] or 0.0) > 0.0]
    return ClaimVerdict(
        claim=CLAIM,
        about=f"level {level}",
        statement=STATEMENT,
        finding=finding,
        reason=reason,
        measure=f"rank correlation of excess loss ({options.loss}) and distance",
        estimate=decisive,
        frames=frames,
        recordings=recordings,
        picture=PICTURE,
        numbers={
            "distance_edges_m": edges_m.tolist(),
            "distance_mean_m": _bin_means(distance_m, bins),
            "excess_up_to_m": vanishes[-1] if vanishes else None,
            "rank_correlation_by_scenario": {name: one.document() for name, one in scenarios.items()},
            **{name: numbers for name, (_, numbers) in trends.items()},
        },
        premises=(
            _same_architecture(material, level),
            training_stability(material, level, options),
            locality(correlogram, options),
        ),
    )


def _trend(
    material: Material,
    level: int,
    loss: LossName,
    distance_m: Float64[np.ndarray, "frames"],
    outside: np.ndarray,
    bins: Int64[np.ndarray, "frames"],
) -> tuple[Estimate, dict[str, Any]]:
    """The rank correlation; the mean excess in each bin, near to far, with the decreasing line closest to it."""
    excess = material.mean_loss(level, loss) - material.mean_loss(0, loss)
    count = int(bins.max()) + 1
    sums = np.zeros((6, len(excess)))
    sums[:, outside] = moments(_ranks(distance_m[outside]), _ranks(excess[outside]))
    spearman = estimate(material.sums(sums), correlation, material.draws)
    curve = []
    for number in range(count):
        here = bins == number
        curve.append(
            estimate(material.sums(np.array([np.where(here, excess, 0.0), here * 1.0])), ratio, material.draws)
        )
    near, far = bins == 0, bins == count - 1
    both = np.array([np.where(near, excess, 0.0), near * 1.0, np.where(far, excess, 0.0), far * 1.0])
    sizes = np.bincount(bins[outside], minlength=count).astype(float)
    fitted = isotonic_regression([bound.value for bound in curve], sample_weight=sizes, increasing=False)
    return spearman, {
        "rank_correlation": spearman.document(),
        "mean_excess": estimate(
            material.sums(np.array([np.where(outside, excess, 0.0), outside * 1.0])), ratio, material.draws
        ).document(),
        "nearest_less_farthest": estimate(material.sums(both), difference_of_ratios, material.draws).document(),
        "curve": [bound.document() for bound in curve],
        "decreasing_fit": np.asarray(fitted).tolist(),
    }


def _by_scenario(
    material: Material,
    level: int,
    distance_m: Float64[np.ndarray, "frames"],
    outside: np.ndarray,
    options: ClaimOptions,
) -> dict[str, Estimate]:
    """The rank correlation within each scenario of enough recordings: without what only tells scenarios apart."""
    excess = material.mean_loss(level, options.loss) - material.mean_loss(0, options.loss)
    scenario = material.frames.table["scenario"].fill_null("unknown").to_numpy()
    found = {}
    for name in np.unique(scenario):
        here = outside & (scenario == name)
        if material.frames_with(here)[1] >= options.min_recordings:
            sums = np.zeros((6, len(excess)))
            sums[:, here] = moments(_ranks(distance_m[here]), _ranks(excess[here]))
            found[str(name)] = estimate(material.sums(sums), correlation, material.draws)
    return found


def _binned(
    distance_m: Float64[np.ndarray, "frames"], outside: np.ndarray, bins: int
) -> tuple[Int64[np.ndarray, "frames"], Float64[np.ndarray, "edges"]]:
    """Bins of equal frame counts, -1 for frames inside; and their edges."""
    edges_m = np.unique(np.quantile(distance_m[outside], np.linspace(0.0, 1.0, bins + 1)))
    number = np.clip(np.searchsorted(edges_m, distance_m, side="right") - 1, 0, len(edges_m) - 2)
    return np.where(outside, number, -1).astype(np.int64), edges_m


def _bin_means(distance_m: Float64[np.ndarray, "frames"], bins: Int64[np.ndarray, "frames"]) -> list[float]:
    return [float(distance_m[bins == number].mean()) for number in range(int(bins.max()) + 1)]


def _ranks(values: Float64[np.ndarray, "items"]) -> Float64[np.ndarray, "items"]:
    """Ranks from 0, equal values sharing the middle of theirs."""
    ordered = np.sort(values)
    ranks: Float64[np.ndarray, "items"] = (
        np.searchsorted(ordered, values, side="left") + np.searchsorted(ordered, values, side="right") - 1
    ) / 2.0
    return ranks


def _same_architecture(material: Material, level: int) -> Premise:
    """Excess speaks of safety training only where nothing else differs."""
    kinds = [{material.networks[place].kind for place in material.places(which)} for which in (0, level)]
    text = "level 0: " + ", ".join(sorted(kinds[0])) + f"; level {level}: " + ", ".join(sorted(kinds[1]))
    return Premise("same architecture", kinds[0] == kinds[1], text)
