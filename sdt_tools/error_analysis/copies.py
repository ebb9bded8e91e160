"""Which scans are exact copies of each other: a logger that wrote one twice, or a simulated robot that stood still."""

from typing import no_type_check

import numpy as np
from jaxtyping import Float32, Int64
from numba import njit

from sdt_tools.runs.blocks import in_blocks

BLOCK_FRAMES = 4_096


def copy_classes(scans: Float32[np.ndarray, "frames rays"], workers: int | None = None) -> Int64[np.ndarray, "frames"]:
    """A row number for each frame, the same for frames whose scans are equal in every ray, and only for those."""
    hashes = np.empty(len(scans), np.uint64)

    def work(block: slice) -> None:
        _hash(scans[block], hashes[block])

    in_blocks(work, len(scans), BLOCK_FRAMES, workers)
    classes = np.arange(len(scans))
    _compare(scans, hashes, np.argsort(hashes, kind="stable"), classes)
    return classes


@njit(cache=True, nogil=True)
@no_type_check
def _hash(scans, hashes):
    """A sum of the rays' values under fixed odd weights, modulo 2^64: equal scans have equal sums."""
    for frame in range(len(scans)):
        weight = np.uint64(0x9E3779B97F4A7C15)
        total = np.uint64(0)
        for ray in range(scans.shape[1]):
            value = np.uint64(np.int64(scans[frame, ray] * np.float32(2.0**24)))
            total += value * weight
            weight *= np.uint64(0xD1342543DE82EF95)
        hashes[frame] = total


@njit(cache=True, nogil=True)
@no_type_check
def _compare(scans, hashes, order, classes):
    """Among frames of equal hash, in their order, give each the class of the first one that it equals."""
    first = 0
    for at in range(1, len(order)):
        if hashes[order[at]] != hashes[order[first]]:
            first = at
            continue
        for earlier in range(first, at):
            known = order[earlier]
            if classes[known] == known and np.array_equal(scans[known], scans[order[at]]):
                classes[order[at]] = known
                break
