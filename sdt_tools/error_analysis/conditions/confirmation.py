"""Whether candidate conditions hold on recordings on which they were not found.

Frames of a recording are not independent, so the test moves whole recordings: the loss of each is given to another one
and rotated in time, which keeps bursts and bad recordings as they are and breaks only their tie to the features. The
p-values of all candidates are corrected together (Holm 1979).
"""

from dataclasses import dataclass
from typing import no_type_check

import numpy as np
from jaxtyping import Bool, Float64, Int64
from numba import njit

from sdt_tools.error_analysis.conditions.predicates import Condition
from sdt_tools.error_analysis.definitions import ConditionOptions, is_conditional

MIN_FRAMES = 20
"""Fewest frames inside a condition for a mean that says anything."""
RESAMPLES = 400
"""Bootstrap resamples of recordings behind an interval."""


@dataclass(frozen=True, eq=False)
class Recordings:
    """Whole recordings one after the other: the losses of their frames, and where each begins."""

    loss: Float64[np.ndarray, "frames"]
    wrong: Bool[np.ndarray, "frames"]
    number: Int64[np.ndarray, "frames"]

    @property
    def starts(self) -> Int64[np.ndarray, "ends"]:
        """First frame of each recording, and the end of the last."""
        borders = np.flatnonzero(np.diff(self.number)) + 1
        return np.concatenate([[0], borders, [len(self.number)]]).astype(np.int64)


@dataclass(frozen=True)
class Verdict:
    """What the confirming recordings say of one condition. All figures are measured on them alone.

    ``effect`` is the mean loss inside less the mean loss outside, with a 95 % interval over resampled recordings;
    ``support`` the share of frames inside; ``recordings`` those with frames inside. ``reason`` is empty where the
    condition is confirmed.
    """

    condition: Condition
    frames: int
    support: float
    recordings: int
    mean_loss_in: float | None
    mean_loss_out: float | None
    effect: float | None
    effect_interval: tuple[float, float] | None
    p_adjusted: float | None
    reason: str

    @property
    def confirmed(self) -> bool:
        """Whether nothing speaks against the condition."""
        return self.reason == ""


def confirm(
    conditions: list[Condition],
    masks: list[Bool[np.ndarray, "frames"]],
    recordings: Recordings,
    eta: float,
    options: ConditionOptions,
    rng: np.random.Generator,
) -> list[Verdict]:
    """One verdict a condition, in order; ``masks`` are the frames of ``recordings`` inside each."""
    testable = [
        int(mask.sum()) >= MIN_FRAMES
        and not mask.all()
        and np.unique(recordings.number[mask]).size >= options.min_recordings
        for mask in masks
    ]
    tested = [mask for mask, test in zip(masks, testable, strict=True) if test]
    adjusted = iter(holm([permutation_p(recordings, mask, options.permutations, rng) for mask in tested]))
    return [
        _verdict(condition, mask, recordings, next(adjusted) if test else None, eta, options, rng)
        for condition, mask, test in zip(conditions, masks, testable, strict=True)
    ]


def permutation_p(
    recordings: Recordings, inside: Bool[np.ndarray, "frames"], permutations: int, rng: np.random.Generator
) -> float:
    """One-sided p-value of the difference of mean losses, inside less outside, under swap and shift of recordings."""
    starts = recordings.starts
    lengths = np.diff(starts)
    orders = rng.permuted(np.tile(np.arange(len(lengths)), (permutations, 1)), axis=1)
    shifts = np.floor(rng.random(orders.shape) * lengths[orders]).astype(np.int64)
    identity = np.arange(len(lengths))[None]
    observed = _effects(recordings.loss, starts, inside, identity, np.zeros_like(identity))[0]
    effects = _effects(recordings.loss, starts, inside, orders, shifts)
    return float(1 + np.sum(effects >= observed - 1e-9)) / (permutations + 1)


def holm(p_values: list[float]) -> list[float]:
    """Adjusted p-values: rejecting those ≤ α keeps the chance of any false rejection ≤ α."""
    order = sorted(range(len(p_values)), key=p_values.__getitem__)
    adjusted = [0.0] * len(p_values)
    largest = 0.0
    for rank, position in enumerate(order):
        largest = max(largest, min(1.0, p_values[position] * (len(p_values) - rank)))
        adjusted[position] = largest
    return adjusted


def _verdict(
    condition: Condition,
    inside: Bool[np.ndarray, "frames"],
    recordings: Recordings,
    p_adjusted: float | None,
    eta: float,
    options: ConditionOptions,
    rng: np.random.Generator,
) -> Verdict:
    frames = int(inside.sum())
    with_frames = np.unique(recordings.number[inside]).size
    with_errors = np.unique(recordings.number[inside & recordings.wrong]).size
    mean_in = float(recordings.loss[inside].mean()) if frames else None
    mean_out = float(recordings.loss[~inside].mean()) if frames < len(inside) else None
    interval = _effect_interval(recordings, inside, rng) if 0 < frames < len(inside) else None
    if with_frames < options.min_recordings or frames < MIN_FRAMES:
        reason = f"only {frames} frames of {with_frames} confirming recordings lie inside"
    elif frames < options.min_support * len(inside):
        reason = f"only {frames / len(inside):.2%} of the confirming frames lie inside"
    elif not is_conditional(recordings.loss, inside, eta):
        reason = "on the confirming recordings the mean loss is not above eta inside and below it outside"
    elif with_errors < options.min_recordings:
        reason = f"only {with_errors} confirming recordings have errors inside"
    elif interval is None or interval[0] <= 0.0:
        reason = "its effect is not above 0 over resampled confirming recordings"
    elif p_adjusted is None or p_adjusted > options.alpha:
        reason = "errors gather there by chance as often"
    else:
        reason = ""
    return Verdict(
        condition=condition,
        frames=frames,
        support=frames / max(len(inside), 1),
        recordings=with_frames,
        mean_loss_in=mean_in,
        mean_loss_out=mean_out,
        effect=None if mean_in is None or mean_out is None else mean_in - mean_out,
        effect_interval=interval,
        p_adjusted=p_adjusted,
        reason=reason,
    )


def _effect_interval(
    recordings: Recordings, inside: Bool[np.ndarray, "frames"], rng: np.random.Generator
) -> tuple[float, float]:
    """95 % percentile interval of the effect over resampled recordings."""
    starts = recordings.starts[:-1]
    sums = np.array(
        [
            np.add.reduceat(values, starts)
            for part in (inside, ~inside)
            for values in (part.astype(float), np.where(part, recordings.loss, 0.0))
        ]
    )
    draws = rng.multinomial(len(starts), np.full(len(starts), 1.0 / len(starts)), RESAMPLES)
    frames_in, loss_in, frames_out, loss_out = sums @ draws.T
    known = (frames_in > 0) & (frames_out > 0)
    effects = loss_in[known] / frames_in[known] - loss_out[known] / frames_out[known]
    low, high = np.percentile(effects, [2.5, 97.5])
    return float(low), float(high)


@njit(cache=True)
@no_type_check
def _effects(loss, starts, inside, orders, shifts):
    """Mean loss inside less outside, with the losses of recording ``orders[p, r]``, rotated, in place of those of r."""
    frames = len(loss)
    effects = np.empty(len(orders))
    for permutation in range(len(orders)):
        total_in = 0.0
        total_out = 0.0
        count_in = 0
        for recording in range(len(starts) - 1):
            source = orders[permutation, recording]
            first = starts[source]
            length = starts[source + 1] - first
            at = shifts[permutation, recording] % length
            for frame in range(starts[recording], starts[recording + 1]):
                if inside[frame]:
                    total_in += loss[first + at]
                    count_in += 1
                else:
                    total_out += loss[first + at]
                at += 1
                if at == length:
                    at = 0
        effects[permutation] = total_in / count_in - total_out / (frames - count_in)
    return effects
