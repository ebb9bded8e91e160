"""How fast two clocks part, in spite of what is late."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64, Int64

from sdt_tools.clock import SECOND_NS

SHORTEST_NS: Final = 10 * SECOND_NS
"""Over less time a millisecond of jitter looks like a drift of 100 ppm and more: none is given."""
_BLOCKS: Final = 200
_LEAST_BLOCKS: Final = 10
_NORMAL_95: Final = 1.96


@dataclass(frozen=True)
class Drift:
    """A slope in parts per million, and the bounds of its 95 % interval.

    Positive: the delay grows, which is to say that the sensor's clock runs slower than the host's.
    """

    ppm: float
    low_ppm: float
    high_ppm: float


def drift_of(stamps_ns: Int64[np.ndarray, "messages"], delays_ns: Int64[np.ndarray, "messages"]) -> Drift | None:
    """The drift of delays over the ascending ``stamps_ns``; None where they span under 10 s or hold under 10 messages.

    The Theil-Sen slope (Sen 1968, J. Am. Stat. Assoc. 63: the median of the slopes between any two points; its interval
    by Kendall's variance) of at most 200 points, each the middle stamp and the median delay of as many messages. It
    stands while under half of the messages of a block, in under 29 % of the blocks, are late.
    """
    if len(stamps_ns) < _LEAST_BLOCKS or stamps_ns[-1] - stamps_ns[0] < SHORTEST_NS:
        return None
    at_ns = (stamps_ns - stamps_ns[0]).astype(np.float64)
    late_ns = (delays_ns - delays_ns[0]).astype(np.float64)
    return _theil_sen(_block_medians(at_ns), _block_medians(late_ns))


def _block_medians(values: Float64[np.ndarray, "messages"]) -> Float64[np.ndarray, "points"]:
    """Medians of at most 200 blocks in order; where the number does not divide, the first are longer by one."""
    blocks = min(_BLOCKS, len(values))
    size, longer = divmod(len(values), blocks)
    head, tail = np.split(values, [longer * (size + 1)])
    return np.concatenate(
        [np.median(head.reshape(longer, size + 1), axis=1), np.median(tail.reshape(blocks - longer, size), axis=1)]
    )


def _theil_sen(x: Float64[np.ndarray, "points"], y: Float64[np.ndarray, "points"]) -> Drift | None:
    one, other = np.triu_indices(len(x), 1)
    run, rise = x[other] - x[one], y[other] - y[one]
    slopes = np.sort(rise[run > 0] / run[run > 0]) * 1e6
    if not slopes.size:
        return None
    points = len(x)
    spread = _NORMAL_95 * np.sqrt(points * (points - 1) * (2 * points + 5) / 18)
    low = int(max((slopes.size - spread) / 2, 0))
    high = int(min((slopes.size + spread) / 2, slopes.size - 1))
    return Drift(float(np.median(slopes)), float(slopes[low]), float(slopes[high]))
