"""Two streams of stamps, paired by time: scans with images, labels with scans."""

import numpy as np
from jaxtyping import Int64


def nearest_pairs(
    first_ns: Int64[np.ndarray, "first"], second_ns: Int64[np.ndarray, "second"], tolerance_ns: int
) -> Int64[np.ndarray, "pairs 2"]:
    """Pair the stamps of two streams one to one, nearest first: rows of (index in the first, index in the second).

    Both inputs ascend, and so does the result. Paired stamps are at most ``tolerance_ns`` apart, no stamp is used
    twice, and no better pair is left: of two stamps within the tolerance that are not paired with each other, at least
    one has a partner that is as near or nearer. Among equally near pairs the earlier stamp of the first stream, then
    the earlier one of the second, goes first.
    """
    first, second = _pairs_within(first_ns, second_ns, tolerance_ns)
    apart_ns = np.abs(first_ns[first] - second_ns[second])
    nearest_first = np.lexsort((second, first, apart_ns))
    partner = np.full(len(first_ns), -1, dtype=np.int64)
    taken = np.zeros(len(second_ns), dtype=bool)
    for one, other in zip(first[nearest_first].tolist(), second[nearest_first].tolist(), strict=True):
        if partner[one] < 0 and not taken[other]:
            partner[one] = other
            taken[other] = True
    paired = np.flatnonzero(partner >= 0)
    return np.stack([paired, partner[paired]], axis=1)


def _pairs_within(
    first_ns: Int64[np.ndarray, "first"], second_ns: Int64[np.ndarray, "second"], tolerance_ns: int
) -> tuple[Int64[np.ndarray, "pairs"], Int64[np.ndarray, "pairs"]]:
    """Every two stamps no more than ``tolerance_ns`` apart, as two arrays of indices."""
    begin = np.searchsorted(second_ns, first_ns - tolerance_ns, side="left")
    end = np.searchsorted(second_ns, first_ns + tolerance_ns, side="right")
    count = end - begin
    first = np.repeat(np.arange(len(first_ns)), count)
    place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return first, begin[first] + place
