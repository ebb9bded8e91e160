"""How well scans and images belong together."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Int64

from sdt_tools.recording.pairing import nearest_pairs
from sdt_tools.recording.timing.topic import Spread, spread_of

TOLERANCE_NS: Final = 20_000_000
"""One period of scans at 50 Hz: what is farther apart shows different moments."""


@dataclass(frozen=True)
class PairTiming:
    """Scans and images paired one to one by their sensor stamps, at most ``tolerance_ns`` apart; the rest is unpaired.

    ``skew`` is how far apart they are, whichever is earlier; None of no pairs.
    """

    count: int
    unpaired_scans: int
    unpaired_images: int
    skew: Spread | None
    tolerance_ns: int = TOLERANCE_NS

    @property
    def unpaired(self) -> int:
        """What has no partner of the rarer of the two: the other one cannot be paired up in any case."""
        return min(self.unpaired_scans, self.unpaired_images)

    @property
    def unpaired_share(self) -> float:
        """``unpaired`` of all messages of the rarer one."""
        return self.unpaired / max(self.count + self.unpaired, 1)


def pair_timing(scans_ns: Int64[np.ndarray, "scans"], images_ns: Int64[np.ndarray, "images"]) -> PairTiming:
    """Pair ``scans_ns`` and ``images_ns``, in any order."""
    skew_ns = pair_skews(scans_ns, images_ns)
    pairs = len(skew_ns)
    return PairTiming(pairs, len(scans_ns) - pairs, len(images_ns) - pairs, spread_of(np.abs(skew_ns)))


def pair_skews(
    scans_ns: Int64[np.ndarray, "scans"], images_ns: Int64[np.ndarray, "images"]
) -> Int64[np.ndarray, "pairs"]:
    """Image less scan of each pair, in the order of the images."""
    images, scans = np.sort(images_ns), np.sort(scans_ns)
    pairs = nearest_pairs(images, scans, TOLERANCE_NS)
    skews_ns: Int64[np.ndarray, "pairs"] = images[pairs[:, 0]] - scans[pairs[:, 1]]
    return skews_ns
