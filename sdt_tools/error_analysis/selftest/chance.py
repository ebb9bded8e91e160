"""Chance as drives have it: alike, correlated in time, in bursts, in bad recordings."""

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int64

RATES: Final = (0.05, 0.45)
"""Error rates of null data; near η = 0.5 a condition is easiest to imagine."""
BURST_FRAMES: Final = 25
BAD_RECORDINGS: Final = 0.2
BAD_RATE: Final = 0.85
GOOD_RATE: Final = 0.03

Null = Callable[[Int64[np.ndarray, "frames"], np.random.Generator], Bool[np.ndarray, "frames"]]


def sticky_uniforms(
    recording: Int64[np.ndarray, "frames"], hold_frames: float, rng: np.random.Generator
) -> Float64[np.ndarray, "frames"]:
    """Uniform numbers that each hold for ``hold_frames`` frames on average, and never beyond a recording."""
    fresh = rng.random(len(recording)) < 1.0 / hold_frames
    fresh[np.flatnonzero(np.diff(recording, prepend=-1))] = True
    held: Float64[np.ndarray, "frames"] = rng.random(len(recording))[
        np.maximum.accumulate(np.where(fresh, np.arange(len(recording)), 0))
    ]
    return held


def at_random(recording: Int64[np.ndarray, "frames"], rng: np.random.Generator) -> Bool[np.ndarray, "frames"]:
    """Errors independent of each other."""
    wrong: Bool[np.ndarray, "frames"] = rng.random(len(recording)) < rng.uniform(*RATES)
    return wrong


def autocorrelated(recording: Int64[np.ndarray, "frames"], rng: np.random.Generator) -> Bool[np.ndarray, "frames"]:
    """Errors where a wandering series (correlation 0.95 from frame to frame) is high."""
    series = np.empty(len(recording))
    for at, shock in enumerate(rng.normal(size=len(recording)).tolist()):
        begins = at == 0 or recording[at] != recording[at - 1]
        series[at] = shock if begins else 0.95 * series[at - 1] + np.sqrt(1 - 0.95**2) * shock
    wrong: Bool[np.ndarray, "frames"] = series > np.quantile(series, 1.0 - rng.uniform(*RATES))
    return wrong


def in_bursts(recording: Int64[np.ndarray, "frames"], rng: np.random.Generator) -> Bool[np.ndarray, "frames"]:
    """All wrong for 25 frames on average, then all right; recordings differ in how often."""
    wrong = np.zeros(len(recording), bool)
    rate = rng.uniform(*RATES)
    for number in range(int(recording[-1]) + 1):
        rows = np.flatnonzero(recording == number)
        share = float(np.clip(rng.normal(rate, 0.1), 0.01, 0.8))
        at, state = 0, bool(rng.random() < share)
        while at < len(rows):
            lasts = int(rng.geometric(1.0 / (BURST_FRAMES if state else BURST_FRAMES * (1 - share) / share + 1.0)))
            wrong[rows[at : at + lasts]] = state
            at, state = at + lasts, not state
    return wrong


def in_bad_recordings(recording: Int64[np.ndarray, "frames"], rng: np.random.Generator) -> Bool[np.ndarray, "frames"]:
    """A fifth of the recordings fail almost throughout, the others seldom; errors hold for ten frames on average."""
    bad = rng.random(int(recording[-1]) + 1) < BAD_RECORDINGS
    wrong: Bool[np.ndarray, "frames"] = (
        sticky_uniforms(recording, 10.0, rng) < np.where(bad, BAD_RATE, GOOD_RATE)[recording]
    )
    return wrong


NULLS: Final[Mapping[str, Null]] = {
    "random": at_random,
    "autocorrelated": autocorrelated,
    "bursts": in_bursts,
    "bad_recordings": in_bad_recordings,
}
