"""Tags shared out over scenarios, motions and recordings."""

from collections.abc import Mapping
from dataclasses import dataclass

import polars as pl

from sdt_tools.error_analysis.definitions import Tag
from sdt_tools.statistics import wilson


@dataclass(frozen=True)
class Part:
    """Some of the frames: those of one scenario, say. ``low`` and ``high``: Wilson interval of the share of errors."""

    name: str
    frames: int
    errors: int
    low: float
    high: float
    tags: Mapping[str, int]

    @property
    def share(self) -> float:
        """Share of errors."""
        return self.errors / self.frames


def parts_by(column: str, frames: pl.DataFrame) -> list[Part]:
    """The parts of ``frames`` (columns tag and ``column``), those with the largest share of errors first.

    Frames of which ``column`` is not known make a part of their own.
    """
    tags = [str(tag) for tag in Tag]
    counted = frames.group_by(pl.col(column).fill_null("not known").alias("name")).agg(
        pl.len().alias("frames"), *[(pl.col("tag") == tag).sum().alias(tag) for tag in tags]
    )
    parts = [_part(row, tags) for row in counted.iter_rows(named=True)]
    return sorted(parts, key=lambda part: (-part.share, part.name))


def _part(row: Mapping[str, object], tags: list[str]) -> Part:
    counts = {tag: int(str(row[tag])) for tag in tags}
    frames = sum(counts.values())
    errors = frames - counts[Tag.CORRECT]
    low, high = wilson(errors, frames)
    return Part(str(row["name"]), frames, errors, low, high, counts)
