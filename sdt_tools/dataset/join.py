"""Labels and scans, paired by time."""

import numpy as np
from jaxtyping import Int64


def nearest_pairs(
    label_stamps_ns: Int64[np.ndarray, "labels"], scan_stamps_ns: Int64[np.ndarray, "scans"], tolerance_ns: int
) -> Int64[np.ndarray, "pairs 2"]:
    """Pair labels with scans one to one, nearest first: rows of (index of a label, index of its scan).

    Both inputs ascend, and so do the labels of the result. Paired stamps are at most ``tolerance_ns`` apart, and no
    better pair is left: of a label and a scan within the tolerance that are not paired with each other, at least one
    has a partner that is as near or nearer. Among equally near pairs the earlier label, then the earlier scan, goes
    first.
    """
    labels, scans = _pairs_within(label_stamps_ns, scan_stamps_ns, tolerance_ns)
    apart_ns = np.abs(label_stamps_ns[labels] - scan_stamps_ns[scans])
    nearest_first = np.lexsort((scans, labels, apart_ns))
    scan_of_label = np.full(len(label_stamps_ns), -1, dtype=np.int64)
    scan_taken = np.zeros(len(scan_stamps_ns), dtype=bool)
    for label, scan in zip(labels[nearest_first].tolist(), scans[nearest_first].tolist(), strict=True):
        if scan_of_label[label] < 0 and not scan_taken[scan]:
            scan_of_label[label] = scan
            scan_taken[scan] = True
    paired = np.flatnonzero(scan_of_label >= 0)
    return np.stack([paired, scan_of_label[paired]], axis=1)


def _pairs_within(
    label_stamps_ns: Int64[np.ndarray, "labels"], scan_stamps_ns: Int64[np.ndarray, "scans"], tolerance_ns: int
) -> tuple[Int64[np.ndarray, "pairs"], Int64[np.ndarray, "pairs"]]:
    """Every label and scan no more than ``tolerance_ns`` apart, as two arrays of indices."""
    first = np.searchsorted(scan_stamps_ns, label_stamps_ns - tolerance_ns, side="left")
    end = np.searchsorted(scan_stamps_ns, label_stamps_ns + tolerance_ns, side="right")
    count = end - first
    labels = np.repeat(np.arange(len(label_stamps_ns)), count)
    place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return labels, first[labels] + place
