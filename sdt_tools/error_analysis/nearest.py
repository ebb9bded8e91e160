"""The frames most like some frames: what an example is shown beside."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float32, Int64

from sdt_tools.error_analysis.distance import rms_m

BLOCK_FRAMES: Final = 8192
SPARE: Final = 8
"""Candidates beyond those asked for: the quick distances that they are found by are rounded."""


@dataclass(frozen=True)
class Near:
    """A frame by its row, and how far it is from another."""

    row: int
    distance: float


def nearest_frames(
    scans: Float32[np.ndarray, "frames rays"], rows: Int64[np.ndarray, "wanted"], epsilon: float, count: int
) -> list[list[Near]]:
    """For each of ``rows`` the ``count`` nearest other frames within ``epsilon``, nearest first; copies left out.

    One pass over ``scans``, a block at a time.
    """
    if not len(rows):
        return []
    wanted = np.asarray(scans[rows], np.float32)
    keep = count + SPARE
    best = np.full((len(rows), keep), np.inf, np.float32)
    at = np.zeros((len(rows), keep), np.int64)
    own = np.einsum("ij,ij->i", wanted, wanted)
    for start in range(0, len(scans), BLOCK_FRAMES):
        block = np.asarray(scans[start : start + BLOCK_FRAMES], np.float32)
        squares = np.einsum("ij,ij->i", block, block)[None] + own[:, None] - 2.0 * wanted @ block.T
        here = np.arange(start, start + len(block))
        squares[here[None] == rows[:, None]] = np.inf
        values = np.concatenate([best, squares], axis=1)
        places = np.concatenate([at, np.broadcast_to(here, squares.shape)], axis=1)
        chosen = np.argpartition(values, keep - 1, axis=1)[:, :keep]
        best, at = np.take_along_axis(values, chosen, axis=1), np.take_along_axis(places, chosen, axis=1)
    found = []
    for row, candidates, quick in zip(rows, at, best, strict=True):
        others = np.unique(candidates[np.isfinite(quick)])
        exact = rms_m(np.repeat(scans[row][None], len(others), axis=0), np.asarray(scans[others]))
        near = [Near(int(o), float(d)) for d, o in sorted(zip(exact, others, strict=True)) if 0.0 < d <= epsilon]
        found.append(near[:count])
    return found
