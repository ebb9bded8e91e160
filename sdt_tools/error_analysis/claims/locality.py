"""How far errors reach: the correlation of the losses of two frames, by the distance of their scans.

The paper's locality says that beyond some K the loss at one sample is not influenced by the loss at another. What data
at hand can show of it: losses of frames of different recordings do not go together beyond K.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int64

_BOUNDS = 14


@dataclass(frozen=True, eq=False)
class Correlogram:
    """Correlation of losses of pairs of frames of different recordings, in bins of distance from near to far.

    ``low`` and ``high`` are 95 % bounds over resampled recordings.
    """

    upper_m: Float64[np.ndarray, "bins"]
    pairs: Int64[np.ndarray, "bins"]
    correlation: Float64[np.ndarray, "bins"]
    low: Float64[np.ndarray, "bins"]
    high: Float64[np.ndarray, "bins"]

    def reach_m(self, small: float) -> float | None:
        """The least bin's end from which on no correlation is above ``small`` by more than chance; None if the last is.

        0 where even the nearest pairs do not correlate.
        """
        large = np.flatnonzero(self.low > small)
        if large.size == 0:
            return 0.0
        return None if large[-1] == len(self.low) - 1 else float(self.upper_m[large[-1]])


def correlogram(
    scans: Float32[np.ndarray, "frames rays"],
    loss: Float64[np.ndarray, "frames"],
    recording: Int64[np.ndarray, "frames"],
    draws: Int64[np.ndarray, "recordings draws"],
) -> Correlogram:
    """Over all pairs of frames; ``recording`` numbers rows of ``draws``. Memory grows with the square of frames."""
    exact = scans.astype(np.float64)
    lengths = np.einsum("ij,ij->i", exact, exact)
    squares = (lengths[:, None] + lengths[None] - 2.0 * exact @ exact.T) / scans.shape[1]
    distance_m = np.sqrt(np.maximum(squares, 0.0))
    other = recording[:, None] != recording[None]
    deviation = loss - loss.mean()
    together = np.outer(deviation, deviation)
    # Most pairs are far apart: bins grow from the nearest thousandth of pairs to all.
    shares = np.concatenate([np.geomspace(0.001, 0.2, _BOUNDS // 2), np.linspace(0.2, 1.0, _BOUNDS // 2 + 1)[1:]])
    upper_m = np.quantile(distance_m[other], shares)
    bins = np.searchsorted(upper_m, distance_m, side="left")
    rows = np.unique(recording)
    place = np.searchsorted(rows, recording)
    variance = float(deviation @ deviation) / len(deviation)
    results = []
    for number in range(len(upper_m)):
        chosen = other & (bins == number)
        products = _by_recording(np.where(chosen, together, 0.0), place, len(rows))
        counts = _by_recording(chosen.astype(np.float64), place, len(rows))
        weights = draws[rows].astype(np.float64)
        resampled = np.einsum("id,ij,jd->d", weights, products, weights, optimize=True) / np.maximum(
            np.einsum("id,ij,jd->d", weights, counts, weights, optimize=True), 1.0
        )
        low, high = np.percentile(resampled / variance, [2.5, 97.5])
        results.append((int(chosen.sum()) // 2, products.sum() / max(counts.sum(), 1.0) / variance, low, high))
    pairs, value, low, high = zip(*results, strict=True)
    return Correlogram(upper_m, np.array(pairs), np.array(value), np.array(low), np.array(high))


def _by_recording(
    values: Float64[np.ndarray, "frames frames"], place: Int64[np.ndarray, "frames"], recordings: int
) -> Float64[np.ndarray, "recordings recordings"]:
    """Sums over the frames of each pair of recordings."""
    starts = np.flatnonzero(np.diff(place, prepend=-1))
    sums: Float64[np.ndarray, "recordings recordings"] = np.add.reduceat(
        np.add.reduceat(values, starts, axis=0), starts, axis=1
    )
    return sums.reshape(recordings, recordings)
