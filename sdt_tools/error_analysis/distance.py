"""How far apart two frames are: of scans root mean square per ray, in metres, codes filled and far ranges clipped.

Why not a plainer norm, as measured on drives of a real LMS1xx: depth edges make the largest difference of successive
scans jump by metres, and unfilled codes put two noisy copies of one scan farther apart than successive moving ones.
Clipped at 2.5 m, what is near (and decides the motion) sets the distance. Places in feature space are
compared likewise, root mean square per feature.
"""

from typing import no_type_check

import numpy as np
from jaxtyping import Float, Float32, Float64, Int64
from numba import njit

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes
from sdt_tools.runs.blocks import in_blocks

BLOCK_PAIRS = 16_384

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
