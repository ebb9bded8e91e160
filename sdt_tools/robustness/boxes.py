"""Boxes of scans: which scans lie in one, and how far the others are from the nearest.

Both answers are exact and cost little more than reading the scan, because the boxes of a set agree on most rays: the
commonest bounds of each ray make a *common box*, and each box is the common one but for a few rays. What a scan leaves
it by is what it leaves the common one by, corrected at those rays.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import no_type_check

import numpy as np
from jaxtyping import Bool, Float, Float64, Int64
from numba import njit

from sdt_tools.frames import MotionClass


@dataclass(frozen=True, eq=False)
class DomainSet:
    """Boxes of code-resolved scans in metres, bounds included, and the classes that are allowed in all of them.

    ``rays`` is the ray that each domain is named after.
    """

    name: str
    lower_m: Float64[np.ndarray, "domains rays"]
    upper_m: Float64[np.ndarray, "domains rays"]
    rays: Int64[np.ndarray, "domains"]
    allowed: frozenset[MotionClass]

    def __len__(self) -> int:
        return len(self.rays)


def in_any_box(ranges_m: Float[np.ndarray, "scans rays"], boxes: DomainSet) -> Bool[np.ndarray, "scans"]:
    """Which scans lie in at least one box; in none of an empty set.

    Bounds are compared in the precision of the scans, so that 0.2 m is 0.2 m in float32 as it is in float64.
    """
    inside, _ = _nearest(ranges_m, boxes)
    return inside


def distance_to_boxes_rms_m(
    ranges_m: Float[np.ndarray, "scans rays"], boxes: DomainSet
) -> Float64[np.ndarray, "scans"]:
    """The smallest change (root mean square over the rays) that brings each scan into a box; infinite without boxes."""
    _, squares = _nearest(ranges_m, boxes)
    distance: Float64[np.ndarray, "scans"] = np.sqrt(squares / ranges_m.shape[1])
    return distance


@dataclass(frozen=True, eq=False)
class _SparseBoxes:
    """The common box, and for box k the rays ``ray[start[k]:start[k + 1]]`` where its bounds are others."""

    common_lower_m: Float[np.ndarray, "rays"]
    common_upper_m: Float[np.ndarray, "rays"]
    start: Int64[np.ndarray, "boxes_and_end"]
    ray: Int64[np.ndarray, "entries"]
    lower_m: Float[np.ndarray, "entries"]
    upper_m: Float[np.ndarray, "entries"]


def _nearest(
    ranges_m: Float[np.ndarray, "scans rays"], boxes: DomainSet
) -> tuple[Bool[np.ndarray, "scans"], Float64[np.ndarray, "scans"]]:
    """Whether each scan is in a box, and the smallest sum of squared metres by which it leaves one."""
    inside, squares = np.zeros(len(ranges_m), np.bool_), np.full(len(ranges_m), np.inf)
    if len(boxes) == 0:
        return inside, squares
    sparse = _sparse(boxes, ranges_m.dtype)
    _measure(
        np.ascontiguousarray(ranges_m),
        sparse.common_lower_m,
        sparse.common_upper_m,
        sparse.start,
        sparse.ray,
        sparse.lower_m,
        sparse.upper_m,
        inside,
        squares,
    )
    return inside, squares


@lru_cache(maxsize=32)
def _sparse(boxes: DomainSet, precision: "np.dtype[np.floating]") -> _SparseBoxes:
    lower, upper = boxes.lower_m.astype(precision), boxes.upper_m.astype(precision)
    common_lower, common_upper = _commonest(lower), _commonest(upper)
    box, ray = np.nonzero((lower != common_lower) | (upper != common_upper))
    start = np.searchsorted(box, np.arange(len(boxes) + 1))
    return _SparseBoxes(common_lower, common_upper, start, ray, lower[box, ray], upper[box, ray])


def _commonest(bounds: Float[np.ndarray, "boxes rays"]) -> Float[np.ndarray, "rays"]:
    """The value that stands most often in each column."""
    columns = (np.unique(column, return_counts=True) for column in bounds.T)
    return np.array([values[np.argmax(counts)] for values, counts in columns], bounds.dtype)


@njit(cache=True)
@no_type_check
def _measure(ranges_m, common_lower, common_upper, start, ray, lower, upper, inside, squares):
    """Fill ``inside`` and ``squares``.

    Membership is counted in rays, not read from a sum, so that rounding cannot make a member of a scan that is none.
    """
    scans, rays = ranges_m.shape
    common = np.empty(rays)
    for scan in range(scans):
        total, outside = 0.0, 0
        for j in range(rays):
            common[j] = _excess_squared(ranges_m[scan, j], common_lower[j], common_upper[j])
            total += common[j]
            outside += ranges_m[scan, j] < common_lower[j] or ranges_m[scan, j] > common_upper[j]
        best = np.inf
        for k in range(len(start) - 1):
            replaced, own, still_outside = 0.0, 0.0, outside
            for entry in range(start[k], start[k + 1]):
                j = ray[entry]
                value = ranges_m[scan, j]
                replaced += common[j]
                own += _excess_squared(value, lower[entry], upper[entry])
                still_outside -= value < common_lower[j] or value > common_upper[j]
                still_outside += value < lower[entry] or value > upper[entry]
            inside[scan] |= still_outside == 0
            best = min(best, max(total - replaced, 0.0) + own)
        squares[scan] = 0.0 if inside[scan] else best


@njit(cache=True)
@no_type_check
def _excess_squared(value, lower, upper):
    """Squared distance of ``value`` to [lower, upper], in double precision."""
    if value < lower:
        return (np.float64(lower) - np.float64(value)) ** 2
    if value > upper:
        return (np.float64(value) - np.float64(upper)) ** 2
    return 0.0
