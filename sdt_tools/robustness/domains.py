"""Safety domains: sets of scans in which the robot must not drive forward, in levels of increasing strictness.

The levels are those of the paper's Table II, and a fourth. Each domain is a subset of one at the next level:

====== =============================== ===============================
level  near rays, 0 to 0.2 m           other rays
====== =============================== ===============================
0      no domains
1      i - 1, i, i + 1                 0 to 3 m
2      i                               0 to 3 m
3      i                               0 to 4 m
4      i                               0 to 20 m, the sensor's range
====== =============================== ===============================

with i = 150 … 389: 240 domains a level. Level 4 closes a gap of the others: a scan with a near object and any ray
beyond 4 m lies in no domain of level 3. All of them speak of scans whose codes are resolved.
"""

from enum import IntEnum
from functools import cache
from typing import Final

import numpy as np
from jaxtyping import Bool, Float, Float64, Int64

from sdt_tools.frames import FORWARD_CLASSES, MAX_RANGE_M, RAYS, MotionClass
from sdt_tools.models.preprocess import FIRST_FRONT_RAY, LAST_FRONT_RAY
from sdt_tools.robustness.boxes import DomainSet, distance_to_boxes_rms_m, in_any_box

NEAR_M: Final = 0.2
NOT_FORWARD: Final = frozenset(MotionClass) - FORWARD_CLASSES
"""The answers that the paper allows in every domain."""


class SafetyLevel(IntEnum):
    """How strict a specification is: 0 asks for nothing, 1 to 3 are the paper's, 4 holds over the sensor's range."""

    NONE = 0
    ONE = 1
    TWO = 2
    THREE = 3
    FOUR = 4


_FAR_M: Final = {1: 3.0, 2: 3.0, 3: 4.0, 4: MAX_RANGE_M}
_NEAR_OFFSETS: Final = {1: (-1, 0, 1), 2: (0,), 3: (0,), 4: (0,)}


@cache
def domains(level: SafetyLevel) -> DomainSet:
    """The 240 domains of a level, in read-only arrays; none for level 0."""
    if level is SafetyLevel.NONE:
        rays = np.empty(0, np.int64)
        lower, upper = np.empty((0, RAYS)), np.empty((0, RAYS))
    else:
        rays = np.arange(FIRST_FRONT_RAY, LAST_FRONT_RAY + 1)
        lower, upper = np.zeros((len(rays), RAYS)), np.full((len(rays), RAYS), _FAR_M[level])
        for offset in _NEAR_OFFSETS[level]:
            upper[np.arange(len(rays)), rays + offset] = NEAR_M
    for array in (lower, upper, rays):
        array.setflags(write=False)
    return DomainSet(f"level {int(level)}", lower, upper, rays, NOT_FORWARD)


def membership(ranges_m: Float[np.ndarray, "scans rays"], level: SafetyLevel) -> Bool[np.ndarray, "scans"]:
    """Which scans lie in at least one domain of ``level``, bounds included; in none of level 0."""
    return in_any_box(ranges_m, domains(level))


def distance_rms_m(ranges_m: Float[np.ndarray, "scans rays"], level: SafetyLevel) -> Float64[np.ndarray, "scans"]:
    """Root mean square over the rays, in metres, of the smallest change that brings a scan into a domain of ``level``.

    0 inside a domain; infinite for level 0.
    """
    return distance_to_boxes_rms_m(ranges_m, domains(level))


def conflicts(
    ranges_m: Float[np.ndarray, "scans rays"], labels: Int64[np.ndarray, "scans"], level: SafetyLevel
) -> Bool[np.ndarray, "scans"]:
    """Which scans lie in a domain of ``level`` although their label is forbidden there.

    Without any, the data meet the paper's third assumption (non-conflicting data).
    """
    forbidden = [int(motion) for motion in MotionClass if motion not in domains(level).allowed]
    return membership(ranges_m, level) & np.isin(labels, forbidden)
