"""Exact ε-neighbours of some frames among all frames, counted.

Scans are projected on their principal directions; the length r of what is left over is one more coordinate. With p
the projections, |p - p'|² + (r - r')² ≤ |x - x'|² ≤ |p - p'|² + (r + r')². The lower bound rules out and the upper one
takes in, exactly: single frames, and, by the boxes of a median-split tree over these coordinates, thousands at once.
Only what is left is measured over all rays, and abandoned as soon as it exceeds ε.

Neighbours are counted, never listed, so memory does not grow with ε. Scans are read where they lie, in their own order
(which is that of time, as neighbours mostly are): they may be a mapped file larger than memory.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple, no_type_check

import numpy as np
from jaxtyping import Bool, Float32, Int64
from numba import njit

from sdt_tools.error_analysis.copies import copy_classes
from sdt_tools.runs.blocks import in_blocks
from sdt_tools.runs.local import Progress

DIRECTIONS: Final = 16
LEAF_FRAMES: Final = 128
SAMPLE_FRAMES: Final = 2_000
"""Frames from which the principal directions are taken: they change the speed, never the answer."""
BLOCK_FRAMES: Final = 4_096
BLOCK_QUERIES: Final = 64
KEY_MARGIN: Final = 1e-5
"""More than the relative rounding error of a squared distance between keys, summed in float32."""


class BoxTree(NamedTuple):
    """Nodes of a median-split tree in depth-first order, over frames in the tree's order.

    Node k holds the frames ``start[k] … end[k] - 1`` of that order, within the box ``low[k]``, ``high[k]`` of keys. The
    first node that is not below it is ``after[k]``; a leaf's is the next.
    """

    start: Int64[np.ndarray, "nodes"]
    end: Int64[np.ndarray, "nodes"]
    after: Int64[np.ndarray, "nodes"]
    low: Float32[np.ndarray, "nodes keys"]
    high: Float32[np.ndarray, "nodes keys"]


@dataclass(frozen=True, eq=False)
class NeighbourIndex:
    """All frames, and where similar ones are found.

    ``order[i]`` is the row of the i-th frame in the tree's order, which ``keys`` follow: the projections, and the
    length of the rest. ``copies[row]`` is the same for exact copies alone. ``key_slack`` bounds the rounding error of a
    distance between keys.
    """

    scans: Float32[np.ndarray, "frames rays"]
    copies: Int64[np.ndarray, "frames"]
    order: Int64[np.ndarray, "frames"]
    keys: Float32[np.ndarray, "frames keys"]
    tree: BoxTree
    key_slack: float


def build_index(scans: Float32[np.ndarray, "frames rays"], workers: int | None = None) -> NeighbourIndex:
    """Index ``scans``, one a row, at least one; they are not copied."""
    keys = _project(scans, workers)
    order, tree = _median_split(keys)
    # A key is rounded to float32 once: at most half a unit in the last place of the largest, in each coordinate.
    rounding = float(np.abs(keys).max(initial=0.0)) * 2.0**-24
    slack = 4.0 * rounding * np.sqrt(keys.shape[1])
    return NeighbourIndex(scans, copy_classes(scans, workers), order, keys[order], tree, slack)


def count_neighbours(
    index: NeighbourIndex,
    rows: Int64[np.ndarray, "queries"],
    epsilon: float,
    groups: Bool[np.ndarray, "groups frames"],
    workers: int | None = None,
    progress: Progress | None = None,
) -> Int64[np.ndarray, "groups queries"]:
    """How many frames of each group lie within ``epsilon`` (root mean square) of the frames ``rows``.

    Neither the frame itself nor an exact copy of it counts. At most 63 groups. The counts are the same for any number
    of ``workers``; ``progress`` hears of the queries done.
    """
    if len(groups) > 63:
        raise ValueError(f"at most 63 groups, not {len(groups)}")
    bits = np.zeros(len(index.order), np.int64)
    for position, group in enumerate(groups):
        bits |= group[index.order].astype(np.int64) << position
    place = np.empty_like(index.order)
    place[index.order] = np.arange(len(place))
    limit = epsilon * epsilon * index.scans.shape[1]
    length, slack = np.sqrt(limit), index.key_slack
    outer = (length + slack) ** 2 * (1.0 + KEY_MARGIN)
    inner = (length - slack) ** 2 * (1.0 - KEY_MARGIN) if length > slack else -1.0  # below rounding keys say nothing
    members = _members(index.tree, groups, index.order)
    counts = np.zeros((len(rows), len(groups)), np.int64)

    def search(block: slice) -> None:
        asked = rows[block]
        frames = (index.scans, index.order, index.keys, bits)
        _count(
            *frames, index.tree, members, asked, place[asked], limit, _float32(outer), _float32(inner), counts[block]
        )

    in_blocks(search, len(rows), BLOCK_QUERIES, workers, progress)
    others: Int64[np.ndarray, "groups queries"] = counts.T - _copies_of(index.copies, rows, groups)
    return others


def _float32(value: float) -> np.float32:
    return np.float32(min(value, float(np.finfo(np.float32).max)))


def _members(
    tree: BoxTree, groups: Bool[np.ndarray, "groups frames"], order: Int64[np.ndarray, "frames"]
) -> Int64[np.ndarray, "nodes groups"]:
    """How many frames of each group each node holds."""
    members = np.empty((len(tree.start), len(groups)), np.int64)
    for position, group in enumerate(groups):
        before = np.concatenate([[0], np.cumsum(group[order])])
        members[:, position] = before[tree.end] - before[tree.start]
    return members


def _copies_of(
    copies: Int64[np.ndarray, "frames"], rows: Int64[np.ndarray, "queries"], groups: Bool[np.ndarray, "groups frames"]
) -> Int64[np.ndarray, "groups queries"]:
    """How many frames of each group are the frame itself or an exact copy of it."""
    found = np.empty((len(groups), len(rows)), np.int64)
    for position, group in enumerate(groups):
        found[position] = np.bincount(copies[group], minlength=len(copies))[copies[rows]]
    return found


def _project(scans: Float32[np.ndarray, "frames rays"], workers: int | None) -> Float32[np.ndarray, "frames keys"]:
    """Coordinates along the principal directions, and the length of the rest."""
    frames, rays = scans.shape
    sample = scans[:: max(1, frames // SAMPLE_FRAMES)].astype(np.float64)
    mean = sample.mean(axis=0)
    _, vectors = np.linalg.eigh((sample - mean).T @ (sample - mean))
    basis = vectors[:, ::-1][:, : min(DIRECTIONS, rays)]
    keys = np.empty((frames, basis.shape[1] + 1), np.float32)

    def project(block: slice) -> None:
        centred = scans[block] - mean
        along = centred @ basis
        rest = np.einsum("ij,ij->i", centred, centred) - np.einsum("ij,ij->i", along, along)
        keys[block, :-1] = along
        keys[block, -1] = np.sqrt(np.maximum(rest, 0.0))

    in_blocks(project, frames, BLOCK_FRAMES, workers)
    return keys


def _median_split(keys: Float32[np.ndarray, "frames keys"]) -> tuple[Int64[np.ndarray, "frames"], BoxTree]:
    """An order of the frames, and the tree over it: halved where they spread most, down to ``LEAF_FRAMES``."""
    order = np.arange(len(keys))
    starts, ends, lows, highs = [], [], [], []
    waiting = [(0, len(keys))]
    while waiting:
        start, end = waiting.pop()
        here = keys[order[start:end]]
        starts.append(start)
        ends.append(end)
        lows.append(here.min(axis=0))
        highs.append(here.max(axis=0))
        if end - start > LEAF_FRAMES:
            middle = (end - start) // 2
            halves = np.argpartition(here[:, np.argmax(highs[-1] - lows[-1])], middle)
            order[start:end] = order[start:end][halves]
            waiting += [(start + middle, end), (start, start + middle)]
    borders = np.array(starts), np.array(ends)
    return order, BoxTree(*borders, _first_beyond(*borders), np.array(lows), np.array(highs))


@njit(cache=True)
@no_type_check
def _first_beyond(start, end):
    """For each node in depth-first order the next one that begins at its end or later."""
    nodes = len(start)
    after = np.full(nodes, nodes)
    for node in range(nodes - 1, -1, -1):
        beyond = node + 1
        while beyond < nodes and start[beyond] < end[node]:
            beyond = after[beyond]
        after[node] = beyond
    return after


@njit(cache=True, nogil=True)
@no_type_check
def _count(scans, order, keys, bits, tree, members, rows, places, limit, outer, inner, counts):
    """Add up, for each query, the frames of each group within ``limit``, copies included."""
    rest = keys.shape[1] - 1
    for query in range(len(rows)):
        here = keys[places[query]]
        node = 0
        while node < len(tree.start):
            if _nearest(here, tree.low[node], tree.high[node], outer) > outer:
                node = tree.after[node]
                continue
            if _farthest(here, tree.low[node], tree.high[node], inner) <= inner:
                counts[query] += members[node]
                node = tree.after[node]
                continue
            if tree.after[node] == node + 1:  # a leaf
                for other in range(tree.start[node], tree.end[node]):
                    if bits[other] == 0:
                        continue
                    apart = np.float32(0.0)
                    for k in range(rest + 1):
                        step = here[k] - keys[other, k]
                        apart += step * step
                    if apart > outer:
                        continue
                    most = apart + np.float32(4.0) * here[rest] * keys[other, rest]
                    if most <= inner or _within(scans[rows[query]], scans[order[other]], limit):
                        for group in range(counts.shape[1]):
                            counts[query, group] += (bits[other] >> group) & 1
            node += 1


@njit(nogil=True)
@no_type_check
def _nearest(here, low, high, enough):
    """Square of the least distance between keys in the box and ``here``, or any number beyond ``enough``."""
    square = np.float32(0.0)
    for k in range(len(here)):
        outside = max(low[k] - here[k], here[k] - high[k])
        if outside > 0:
            square += outside * outside
            if square > enough:
                break
    return square


@njit(nogil=True)
@no_type_check
def _farthest(here, low, high, enough):
    """Square of what the distance of scans in the box cannot exceed, or any number beyond ``enough``."""
    rest = len(here) - 1
    across = here[rest] + high[rest]
    square = across * across
    for k in range(rest):
        if square > enough:
            break
        across = max(here[k] - low[k], high[k] - here[k])
        square += across * across
    return square


@njit(nogil=True)
@no_type_check
def _within(scan, other, limit):
    """Whether the squared distance of two scans is at most ``limit``, by float64 wherever float32 could be wrong."""
    rays = len(scan)
    margin = np.float32((rays + 4) * 2.0**-23)
    rough = np.float32(0.0)
    for start in range(0, rays, 64):
        rough += _rough_square(scan, other, start, min(start + 64, rays))
        if rough * (np.float32(1.0) - margin) > limit:
            return False
    if rough * (np.float32(1.0) + margin) < limit:
        return True
    exact = 0.0
    for ray in range(rays):
        difference = np.float64(scan[ray]) - np.float64(other[ray])
        exact += difference * difference
    return exact <= limit


@njit(nogil=True)
@no_type_check
def _rough_square(scan, other, start, end):
    """Squared distance over some rays in float32, in eight sums, so that they are taken at once."""
    whole = end - (end - start) % 8
    a = b = c = d = e = f = g = h = np.float32(0.0)
    for ray in range(start, whole, 8):
        a += (scan[ray] - other[ray]) * (scan[ray] - other[ray])
        b += (scan[ray + 1] - other[ray + 1]) * (scan[ray + 1] - other[ray + 1])
        c += (scan[ray + 2] - other[ray + 2]) * (scan[ray + 2] - other[ray + 2])
        d += (scan[ray + 3] - other[ray + 3]) * (scan[ray + 3] - other[ray + 3])
        e += (scan[ray + 4] - other[ray + 4]) * (scan[ray + 4] - other[ray + 4])
        f += (scan[ray + 5] - other[ray + 5]) * (scan[ray + 5] - other[ray + 5])
        g += (scan[ray + 6] - other[ray + 6]) * (scan[ray + 6] - other[ray + 6])
        h += (scan[ray + 7] - other[ray + 7]) * (scan[ray + 7] - other[ray + 7])
    for ray in range(whole, end):
        a += (scan[ray] - other[ray]) * (scan[ray] - other[ray])
    return ((a + b) + (c + d)) + ((e + f) + (g + h))
