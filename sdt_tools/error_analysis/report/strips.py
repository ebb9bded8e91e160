"""Errors over time: one strip a recording, from its first labelled frame to its last."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl

from sdt_tools.clock import SECOND_NS
from sdt_tools.error_analysis.definitions import ERROR_TAGS
from sdt_tools.error_analysis.report.breakdown import Part

WIDTH: Final = 300
"""Columns of a strip: each stands for as many frames as lie in that part of the time."""
HEIGHT: Final = 22
SMALLEST: Final = 4.0
"""A single error among many frames is drawn this high, or it would not be seen."""


@dataclass(frozen=True)
class Strip:
    """A recording's errors over time, as one SVG path a tag: columns stacked to the share of their frames."""

    part: Part
    seconds: float
    paths: Mapping[str, str]


def strip_of(part: Part, frames: pl.DataFrame) -> Strip:
    """The strip of one recording; ``frames`` (columns stamp_ns and tag) are its own, in order."""
    stamps_ns = frames["stamp_ns"].to_numpy()
    lasted_ns = max(1, int(stamps_ns[-1] - stamps_ns[0]))
    columns = ((stamps_ns - stamps_ns[0]) * (WIDTH - 1) // lasted_ns).astype(np.int64)
    total = np.maximum(np.bincount(columns, minlength=WIDTH), 1)
    foot = np.full(WIDTH, float(HEIGHT))
    paths: dict[str, str] = {}
    for tag in ERROR_TAGS:
        counts = np.bincount(columns[(frames["tag"] == tag).to_numpy()], minlength=WIDTH)
        drawn = np.flatnonzero(counts)
        heights = np.minimum(np.maximum(HEIGHT * counts / total, SMALLEST), foot)
        if len(drawn):
            paths[str(tag)] = "".join(f"M{x}.5 {foot[x]:.3g}v-{heights[x]:.3g}" for x in drawn.tolist())
        foot -= np.where(counts > 0, heights, 0.0)
    return Strip(part, lasted_ns / SECOND_NS, paths)
