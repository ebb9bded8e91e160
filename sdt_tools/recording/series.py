"""A run of scans as arrays."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from sdt_tools.frames import RAYS


@dataclass(frozen=True, eq=False)
class ScanSeries:
    """Scans as arrays: when the sensor took them, when the host received them, and ranges in metres, codes kept."""

    stamps_ns: Int64[np.ndarray, "scans"]
    received_ns: Int64[np.ndarray, "scans"]
    ranges_m: Float64[np.ndarray, "scans rays"]

    def __len__(self) -> int:
        return len(self.stamps_ns)


def empty_series(scans: int) -> ScanSeries:
    """Room for ``scans`` scans, not filled."""
    return ScanSeries(np.empty(scans, np.int64), np.empty(scans, np.int64), np.empty((scans, RAYS)))


def joined(batches: list[ScanSeries]) -> ScanSeries:
    """The batches one after the other."""
    if len(batches) == 1:
        return batches[0]
    return ScanSeries(
        np.concatenate([batch.stamps_ns for batch in batches] or [np.empty(0, np.int64)]),
        np.concatenate([batch.received_ns for batch in batches] or [np.empty(0, np.int64)]),
        np.concatenate([batch.ranges_m for batch in batches] or [np.empty((0, RAYS))]),
    )
