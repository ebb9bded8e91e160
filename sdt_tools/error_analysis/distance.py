"""How far apart two scans are: root mean square per ray, in metres, with codes filled and far ranges clipped.

Why not a plainer norm, as measured on drives of a real LMS1xx: depth edges make the largest difference of successive
scans jump by metres, and unfilled codes put two noisy copies of one scan farther apart than successive moving ones.
Clipped at 2.5 m, what is near (and decides the motion) sets the distance.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int64

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.errors import UsageError
from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes

UNRELATED_PAIRS = 5000
UNRELATED_PERCENTILE = 1.0
UNRELATED_AFTER_S = 10.0
"""Within a single recording, frames this far apart in time count as unrelated."""

_FILL = PreprocessConfig(code_policy="interpolate")


def situations(ranges_m: Float[np.ndarray, "frames rays"], options: ErrorOptions) -> Float32[np.ndarray, "frames rays"]:
    """Scans as distances are taken over them: codes filled by interpolation along the scan, ranges clipped."""
    filled = resolve_codes(ranges_m, _FILL) if options.fill_codes else ranges_m
    clipped: Float32[np.ndarray, "frames rays"] = np.minimum(filled, options.clip_m).astype(np.float32)
    return clipped


def rms_m(
    left: Float32[np.ndarray, "pairs rays"], right: Float32[np.ndarray, "pairs rays"]
) -> Float64[np.ndarray, "pairs"]:
    """Root mean square difference per ray of each pair of rows."""
    difference = left.astype(np.float64) - right
    distance_m: Float64[np.ndarray, "pairs"] = np.sqrt(np.mean(difference * difference, axis=1))
    return distance_m


@dataclass(frozen=True, eq=False)
class Epsilon:
    """The neighbourhood of Definition 1 and what it means on the data at hand.

    ``successive_m`` and ``unrelated_m`` are sampled distances between successive and between unrelated frames;
    ``warning`` is empty where ε keeps them apart.
    """

    epsilon_m: float
    source: str
    successive_m: Float64[np.ndarray, "pairs"]
    unrelated_m: Float64[np.ndarray, "others"]
    warning: str

    @property
    def unrelated_limit_m(self) -> float | None:
        """The percentile of unrelated pairs that ε should stay below."""
        return float(np.percentile(self.unrelated_m, UNRELATED_PERCENTILE)) if self.unrelated_m.size else None


def estimate_epsilon(
    scans: Float32[np.ndarray, "frames rays"],
    recording: Int64[np.ndarray, "frames"],
    stamp_ns: Int64[np.ndarray, "frames"],
    options: ErrorOptions,
) -> Epsilon:
    """ε as given in ``options``, else from the distances of successive frames, with both distributions.

    Frames are sorted by recording and stamp. Raises UsageError where ε is not given and cannot be estimated.
    """
    follows = follows_closely(recording, stamp_ns, options.max_gap_s)
    later = np.flatnonzero(follows)
    successive = _distances(scans, later - 1, later)
    unrelated = _distances(scans, *_unrelated_pairs(recording, stamp_ns, np.random.default_rng(options.seed)))
    if options.epsilon_m is not None:
        epsilon_m, source = options.epsilon_m, "given"
    elif successive.size == 0:
        raise UsageError(
            f"no two labelled frames follow each other within {options.max_gap_s:g} s, so ε cannot be estimated; "
            "label more frames, or set epsilon_m"
        )
    else:
        epsilon_m = float(np.percentile(successive, options.epsilon_percentile))
        source = f"percentile {options.epsilon_percentile:g} of {successive.size} distances between successive frames"
        if epsilon_m == 0.0:
            raise UsageError(
                "successive frames are exact copies of each other, so ε cannot be estimated; set epsilon_m"
            )
    return Epsilon(epsilon_m, source, successive, unrelated, _warning(epsilon_m, unrelated))


def follows_closely(
    recording: Int64[np.ndarray, "frames"], stamp_ns: Int64[np.ndarray, "frames"], max_gap_s: float
) -> Bool[np.ndarray, "frames"]:
    """Whether the frame before belongs to the same recording and lies at most ``max_gap_s`` back."""
    follows = np.zeros(len(recording), bool)
    follows[1:] = (np.diff(recording) == 0) & (np.diff(stamp_ns) <= round(max_gap_s * 1e9))
    return follows


def _distances(
    scans: Float32[np.ndarray, "frames rays"], left: Int64[np.ndarray, "pairs"], right: Int64[np.ndarray, "pairs"]
) -> Float64[np.ndarray, "pairs"]:
    """Distances of pairs of rows, a few thousand pairs in memory at a time."""
    blocks = [slice(start, start + 4096) for start in range(0, len(left), 4096)]
    return np.concatenate([np.empty(0), *(rms_m(scans[left[block]], scans[right[block]]) for block in blocks)])


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


def _warning(epsilon_m: float, unrelated_m: Float64[np.ndarray, "others"]) -> str:
    if unrelated_m.size == 0:
        return ""
    limit_m = float(np.percentile(unrelated_m, UNRELATED_PERCENTILE))
    if epsilon_m <= limit_m:
        return ""
    share = float(np.mean(unrelated_m <= epsilon_m))
    return (
        f"ε = {epsilon_m:.3f} m is wide: {share:.1%} of unrelated frames lie within it, so neighbours may be other "
        f"situations; frames closer in time, or epsilon_m below {limit_m:.3f}, keep them apart"
    )
