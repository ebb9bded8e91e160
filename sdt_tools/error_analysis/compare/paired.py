"""Paired differences of two models on the same frames, with recordings as the unit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.resampling import Estimate, difference_of_ratios, estimate, ratio, sum_by_unit
from sdt_tools.error_analysis.side_by_side import SideBySide
from sdt_tools.frames import FORWARD_CLASSES

_FORWARD: Final = [motion.label for motion in FORWARD_CLASSES]


@dataclass(frozen=True)
class Measure:
    """A number of each model, and that of the other less that of the base."""

    base: Estimate
    other: Estimate
    difference: Estimate

    def document(self) -> dict[str, Any]:
        """As a part of the report."""
        return {name: value.document() for name, value in vars(self).items()}


@dataclass(frozen=True)
class Change:
    """What changed in a group of frames. ``worse``: the base is right and the other wrong; ``better``: the reverse.

    ``net`` is the share that got worse less the share that got better.
    """

    group: str
    value: str
    frames: int
    recordings: int
    worse: int
    better: int
    net: Estimate

    def document(self) -> dict[str, Any]:
        """As a part of the report."""
        return {**vars(self), "net": self.net.document()}


def measures(
    frames: SideBySide, base: int, other: int, draws: Int64[np.ndarray, "recordings draws"]
) -> Mapping[str, Measure]:
    """Accuracy, cross-entropy, and forward recall (a forward class where one is right; NaN without such frames)."""
    right = ~frames.wrong
    forward_class = np.isin(np.array(frames.classes), _FORWARD)
    forward = forward_class[frames.predicted]
    everything = np.ones(len(frames.recording), bool)
    wanted = np.isin(frames.column("label").astype(str), _FORWARD)
    return {
        "accuracy": _measure(frames, right[base], right[other], everything, draws),
        "loss_ce": _measure(frames, frames.loss_ce[base], frames.loss_ce[other], everything, draws),
        "forward_recall": _measure(frames, forward[base], forward[other], wanted, draws),
    }


def changes(
    frames: SideBySide, base: int, other: int, draws: Int64[np.ndarray, "recordings draws"]
) -> tuple[Change, ...]:
    """What changed in all frames, by right motion, and by scenario; the largest groups of each first."""
    worse, better = worsened(frames, base, other), worsened(frames, other, base)
    groups: list[tuple[str, str, Bool[np.ndarray, "frames"]]] = [("all", "", np.ones(len(worse), bool))]
    for column, name in (("label", "motion"), ("scenario", "scenario")):
        values = frames.table[column].fill_null("unknown").to_numpy()
        known, counts = np.unique(values, return_counts=True)
        groups += [(name, str(known[place]), values == known[place]) for place in np.argsort(-counts, kind="stable")]
    return tuple(
        Change(
            group=name,
            value=value,
            frames=int(here.sum()),
            recordings=int(np.unique(frames.recording[here]).size),
            worse=int((worse & here).sum()),
            better=int((better & here).sum()),
            net=_net(frames, worse, better, here, draws),
        )
        for name, value, here in groups
    )


def worsened(frames: SideBySide, base: int, other: int) -> Bool[np.ndarray, "frames"]:
    """The frames that the base answers rightly and the other wrongly."""
    lost: Bool[np.ndarray, "frames"] = ~frames.wrong[base] & frames.wrong[other]
    return lost


def _measure(
    frames: SideBySide,
    base: np.ndarray,
    other: np.ndarray,
    where: Bool[np.ndarray, "frames"],
    draws: Int64[np.ndarray, "recordings draws"],
) -> Measure:
    parts = np.array([base * where, where, other * where, where], dtype=np.float64)
    sums: Float64[np.ndarray, "4 recordings"] = sum_by_unit(parts, frames.recording, frames.recordings)
    return Measure(
        base=estimate(sums[:2], ratio, draws),
        other=estimate(sums[2:], ratio, draws),
        difference=estimate(sums[[2, 3, 0, 1]], difference_of_ratios, draws),
    )


def _net(
    frames: SideBySide,
    worse: Bool[np.ndarray, "frames"],
    better: Bool[np.ndarray, "frames"],
    here: Bool[np.ndarray, "frames"],
    draws: Int64[np.ndarray, "recordings draws"],
) -> Estimate:
    parts = np.array([(worse.astype(np.float64) - better) * here, here * 1.0])
    return estimate(sum_by_unit(parts, frames.recording, frames.recordings), ratio, draws)
