"""Exact ε-neighbours of some frames among all frames.

Scans are projected on their principal directions; the length of what is left over is one more coordinate. Distances
between projections never exceed those between scans, so they rule out most pairs exactly. Projections are sorted into
leaves of a median-split tree, whose boxes rule out whole groups at once; only what remains is measured over all rays,
in float64, and abandoned as soon as it exceeds ε.
"""

from dataclasses import dataclass
from typing import no_type_check

import numpy as np
from jaxtyping import Bool, Float32, Int64
from numba import njit

DIRECTIONS = 16
LEAF_FRAMES = 128
SAMPLE_FRAMES = 2_000
"""Frames from which the principal directions are taken: they change the speed, never the answer."""
BLOCK_FRAMES = 4_096


@dataclass(frozen=True, eq=False)
class NeighbourIndex:
    """All frames, ordered so that similar scans lie together.

    ``order[i]`` is the original row of the i-th ordered frame; ``scans`` and ``keys`` (projections, and the length of
    the rest) follow that order. Leaf k holds the ordered frames ``leaves[k] … leaves[k + 1] - 1`` within the box
    ``low[k]``, ``high[k]`` of keys. ``key_slack`` bounds the rounding error of a distance between keys.
    """

    order: Int64[np.ndarray, "frames"]
    scans: Float32[np.ndarray, "frames rays"]
    keys: Float32[np.ndarray, "frames keys"]
    leaves: Int64[np.ndarray, "ends"]
    low: Float32[np.ndarray, "leaves keys"]
    high: Float32[np.ndarray, "leaves keys"]
    key_slack: float


def build_index(scans: Float32[np.ndarray, "frames rays"]) -> NeighbourIndex:
    """Index ``scans``, one a row, at least one. Holds one reordered copy of them."""
    keys = _project(scans)
    order, leaves = _median_split(keys)
    keys = keys[order]
    starts = leaves[:-1]
    # A key is rounded to float32 once: at most half a unit in the last place of the largest, in each coordinate.
    rounding = float(np.abs(keys).max(initial=0.0)) * 2.0**-24
    return NeighbourIndex(
        order=order,
        scans=scans[order],
        keys=keys,
        leaves=leaves,
        low=np.minimum.reduceat(keys, starts, axis=0),
        high=np.maximum.reduceat(keys, starts, axis=0),
        key_slack=4.0 * rounding * np.sqrt(keys.shape[1]),
    )


def count_neighbours(
    index: NeighbourIndex,
    rows: Int64[np.ndarray, "queries"],
    epsilon_m: float,
    groups: Bool[np.ndarray, "groups frames"],
) -> Int64[np.ndarray, "groups queries"]:
    """How many frames of each group lie within ``epsilon_m`` (root mean square per ray) of the frames ``rows``.

    Neighbours have a distance of more than 0: neither the frame itself nor an exact copy of it counts. At most 63
    groups. Memory does not grow with the number of neighbours.
    """
    if len(groups) > 63:
        raise ValueError(f"at most 63 groups, not {len(groups)}")
    bits = np.zeros(len(index.order), np.int64)
    for position, group in enumerate(groups):
        bits |= group[index.order].astype(np.int64) << position
    place = np.empty_like(index.order)
    place[index.order] = np.arange(len(place))
    # Queries that lie together visit the same leaves while those are in the cache.
    ordered = np.argsort(place[rows], kind="stable")
    limit = epsilon_m * epsilon_m * index.scans.shape[1]
    key_limit = (np.sqrt(limit) + index.key_slack) ** 2 * (1.0 + 1e-5)
    counts = np.zeros((len(rows), len(groups)), np.int64)
    _count(
        index.scans,
        index.keys,
        index.leaves,
        index.low,
        index.high,
        place[rows][ordered],
        limit,
        np.float32(key_limit),
        bits,
        counts,
    )
    result = np.empty_like(counts)
    result[ordered] = counts
    return np.ascontiguousarray(result.T)


def _project(scans: Float32[np.ndarray, "frames rays"]) -> Float32[np.ndarray, "frames keys"]:
    """Coordinates along the principal directions, and the length of the rest."""
    frames, rays = scans.shape
    sample = scans[:: max(1, frames // SAMPLE_FRAMES)].astype(np.float64)
    mean = sample.mean(axis=0)
    _, vectors = np.linalg.eigh((sample - mean).T @ (sample - mean))
    basis = vectors[:, ::-1][:, : min(DIRECTIONS, rays)]
    keys = np.empty((frames, basis.shape[1] + 1), np.float32)
    for start in range(0, frames, BLOCK_FRAMES):
        centred = scans[start : start + BLOCK_FRAMES] - mean
        along = centred @ basis
        rest = np.einsum("ij,ij->i", centred, centred) - np.einsum("ij,ij->i", along, along)
        keys[start : start + BLOCK_FRAMES, :-1] = along
        keys[start : start + BLOCK_FRAMES, -1] = np.sqrt(np.maximum(rest, 0.0))
    return keys


def _median_split(
    keys: Float32[np.ndarray, "frames keys"],
) -> tuple[Int64[np.ndarray, "frames"], Int64[np.ndarray, "ends"]]:
    """Order frames so that leaves of at most ``LEAF_FRAMES`` are compact; returns the order and the leaves' ends."""
    order = np.arange(len(keys))
    ends = [0]
    waiting = [(0, len(keys))]
    while waiting:
        start, end = waiting.pop()
        if end - start <= LEAF_FRAMES:
            ends.append(end)
            continue
        here = keys[order[start:end]]
        middle = (end - start) // 2
        halves = np.argpartition(here[:, np.argmax(np.ptp(here, axis=0))], middle)
        order[start:end] = order[start:end][halves]
        waiting += [(start + middle, end), (start, start + middle)]
    return order, np.array(ends)


@njit(cache=True)
@no_type_check
def _count(scans, keys, leaves, low, high, queries, limit, key_limit, bits, counts):
    rays = scans.shape[1]
    coordinates = keys.shape[1]
    groups = counts.shape[1]
    for query in range(len(queries)):
        at = queries[query]
        for leaf in range(len(leaves) - 1):
            beyond = np.float32(0.0)
            for k in range(coordinates):
                under = low[leaf, k] - keys[at, k]
                over = keys[at, k] - high[leaf, k]
                if under > 0:
                    beyond += under * under
                elif over > 0:
                    beyond += over * over
                if beyond > key_limit:
                    break
            if beyond > key_limit:
                continue
            for other in range(leaves[leaf], leaves[leaf + 1]):
                if bits[other] == 0:
                    continue
                apart = np.float32(0.0)
                for k in range(coordinates):
                    step = keys[at, k] - keys[other, k]
                    apart += step * step
                if apart > key_limit:
                    continue
                distance = 0.0
                for start in range(0, rays, 64):
                    for ray in range(start, min(start + 64, rays)):
                        difference = np.float64(scans[at, ray]) - np.float64(scans[other, ray])
                        distance += difference * difference
                    if distance > limit:
                        break
                if 0.0 < distance <= limit:
                    for group in range(groups):
                        counts[query, group] += (bits[other] >> group) & 1
