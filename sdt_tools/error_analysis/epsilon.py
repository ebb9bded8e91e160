"""ε, the distance up to which frames are neighbours: given, or taken from successive frames, and what it means."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.spaces import Measure, Space
from sdt_tools.errors import UsageError

UNRELATED_PAIRS = 5000
UNRELATED_PERCENTILE = 1.0
UNRELATED_AFTER_S = 10.0
"""Within a single recording, frames this far apart in time count as unrelated."""


@dataclass(frozen=True, eq=False)
class Epsilon:
    """The neighbourhood of Definition 1 and what it means on the data at hand.

    ``value``, and the sampled distances between ``successive`` and between ``unrelated`` frames, are in the unit of
    ``measure``; ``warning`` is empty where ε keeps them apart.
    """

    value: float
    measure: Measure
    source: str
    successive: Float64[np.ndarray, "pairs"]
    unrelated: Float64[np.ndarray, "others"]
    warning: str

    @property
    def text(self) -> str:
        """ε with its unit."""
        return self.measure.text(self.value)

    @property
    def unrelated_limit(self) -> float | None:
        """The percentile of unrelated pairs that ε should stay below."""
        return float(np.percentile(self.unrelated, UNRELATED_PERCENTILE)) if self.unrelated.size else None


def estimate_epsilon(
    space: Space,
    recording: Int64[np.ndarray, "frames"],
    stamp_ns: Int64[np.ndarray, "frames"],
    options: ErrorOptions,
) -> Epsilon:
    """ε in ``space`` as given in ``options``, else from the distances of successive frames, with both distributions.

    Frames are sorted by recording and stamp. Raises UsageError where ε is not given and cannot be estimated.
    """
    measure = space.measure
    later = np.flatnonzero(follows_closely(recording, stamp_ns, options.max_gap_s))
    successive = space.distances(later - 1, later)
    unrelated = space.distances(*_unrelated_pairs(recording, stamp_ns, np.random.default_rng(options.seed)))
    unrelated = unrelated[np.isfinite(unrelated)]
    given = options.epsilon_of(measure.neighbourhood)
    if given is not None:
        return Epsilon(given, measure, "given", successive, unrelated, _warning(given, unrelated, measure))
    if successive.size == 0:
        raise UsageError(
            f"no two labelled frames follow each other within {options.max_gap_s:g} s, so ε cannot be estimated; "
            f"label more frames, or set {measure.option}"
        )
    epsilon = float(np.percentile(successive, options.epsilon_percentile))
    if epsilon == 0.0:
        raise UsageError(
            f"successive frames are exact copies of each other, so ε cannot be estimated; set {measure.option}"
        )
    source = f"percentile {options.epsilon_percentile:g} of {successive.size} distances between successive frames"
    return Epsilon(epsilon, measure, source, successive, unrelated, _warning(epsilon, unrelated, measure))


def follows_closely(
    recording: Int64[np.ndarray, "frames"], stamp_ns: Int64[np.ndarray, "frames"], max_gap_s: float
) -> Bool[np.ndarray, "frames"]:
    """Whether the frame before belongs to the same recording and lies at most ``max_gap_s`` back."""
    follows = np.zeros(len(recording), bool)
    follows[1:] = (np.diff(recording) == 0) & (np.diff(stamp_ns) <= round(max_gap_s * 1e9))
    return follows


def _unrelated_pairs(
    recording: Int64[np.ndarray, "frames"], stamp_ns: Int64[np.ndarray, "frames"], rng: np.random.Generator
) -> tuple[Int64[np.ndarray, "pairs"], Int64[np.ndarray, "pairs"]]:
    """Random pairs of frames of different recordings; of one recording, far apart in time."""
    left, right = rng.integers(len(recording), size=(2, UNRELATED_PAIRS))
    if recording[0] != recording[-1]:
        apart = recording[left] != recording[right]
    else:
        apart = np.abs(stamp_ns[left] - stamp_ns[right]) >= round(UNRELATED_AFTER_S * 1e9)
    return left[apart], right[apart]


def _warning(epsilon: float, unrelated: Float64[np.ndarray, "others"], measure: Measure) -> str:
    if unrelated.size == 0:
        return ""
    limit = float(np.percentile(unrelated, UNRELATED_PERCENTILE))
    if epsilon <= limit:
        return ""
    share = float(np.mean(unrelated <= epsilon))
    return (
        f"ε = {measure.text(epsilon)} is wide: {share:.1%} of unrelated frames lie within it, so neighbours may be "
        f"other situations; frames closer in time, or {measure.option} below {limit:.3g}, keep them apart"
    )
