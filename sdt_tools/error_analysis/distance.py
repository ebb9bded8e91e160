"""How far apart two scans are: root mean square per ray, in metres, with codes filled and far ranges clipped.

Why not a plainer norm, as measured on drives of a real LMS1xx: depth edges make the largest difference of successive
scans jump by metres, and unfilled codes put two noisy copies of one scan farther apart than successive moving ones.
Clipped at 2.5 m, what is near (and decides the motion) sets the distance.
"""

from dataclasses import dataclass
from typing import no_type_check

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int64
from numba import njit

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.errors import UsageError
from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes
from sdt_tools.runs.blocks import in_blocks

BLOCK_PAIRS = 16_384
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


def pair_distances_m(
    scans: Float32[np.ndarray, "frames rays"], left: Int64[np.ndarray, "pairs"], right: Int64[np.ndarray, "pairs"]
) -> Float64[np.ndarray, "pairs"]:
    """``rms_m`` between the frames ``left`` and ``right``, pair by pair, for millions of pairs."""
    distances_m = np.empty(len(left))

    def measure(block: slice) -> None:
        _rms(scans, left[block], right[block], distances_m[block])

    in_blocks(measure, len(left), BLOCK_PAIRS)
    return distances_m


@njit(cache=True, nogil=True)
@no_type_check
def _rms(scans, left, right, distances_m):
    rays = scans.shape[1]
    for pair in range(len(left)):
        square = 0.0
        for ray in range(rays):
            difference = np.float64(scans[left[pair], ray]) - np.float64(scans[right[pair], ray])
            square += difference * difference
        distances_m[pair] = np.sqrt(square / rays)


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
    successive = pair_distances_m(scans, later - 1, later)
    unrelated = pair_distances_m(scans, *_unrelated_pairs(recording, stamp_ns, np.random.default_rng(options.seed)))
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
