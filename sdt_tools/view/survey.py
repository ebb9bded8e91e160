"""One look at all scans of a recording, before anything is drawn."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64, Int64

from sdt_tools.recording.series import ScanSeries
from sdt_tools.top_view import codes, distances, front_range_m

SMALLEST_REACH_M: Final = 2.5
LARGEST_REACH_M: Final = 5.0
SAMPLED_SHARE: Final = 25


@dataclass(frozen=True, eq=False)
class Survey:
    """What is read off each scan, and how far most of them see.

    ``front_m``: the nearest distance on the rays of the safety zone (NaN without one); ``codes_percent``: rays on which
    the sensor gave a code; ``reach_m``: three in four hits are nearer, within 2.5 and 5 m.
    """

    stamps_ns: Int64[np.ndarray, "scans"]
    front_m: Float64[np.ndarray, "scans"]
    codes_percent: Float64[np.ndarray, "scans"]
    reach_m: float


def survey(batches: Iterable[ScanSeries]) -> Survey:
    """Look at all scans, a batch at a time."""
    stamps, fronts, shares, sampled = [np.empty(0, np.int64)], [np.empty(0)], [np.empty(0)], [np.empty(0)]
    for batch in batches:
        stamps.append(batch.stamps_ns)
        fronts.append(front_range_m(batch.ranges_m))
        shares.append(100.0 * codes(batch.ranges_m).mean(axis=1))
        some = batch.ranges_m[::SAMPLED_SHARE]
        sampled.append(some[distances(some)])
    hits = np.concatenate(sampled)
    reach_m = float(np.percentile(hits, 75.0)) if len(hits) else SMALLEST_REACH_M
    return Survey(
        stamps_ns=np.concatenate(stamps),
        front_m=np.concatenate(fronts),
        codes_percent=np.concatenate(shares),
        reach_m=float(np.clip(np.ceil(2.0 * reach_m) / 2.0, SMALLEST_REACH_M, LARGEST_REACH_M)),
    )
