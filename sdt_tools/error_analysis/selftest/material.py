"""Frames to plant errors into: synthetic ones, or those of predictions at hand with their own errors put right."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Bool, Float32

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.distance import situations
from sdt_tools.error_analysis.labelled import LabelledFrames, frames_of
from sdt_tools.error_analysis.selftest.drives import predictions_of, scans_of, wander
from sdt_tools.frames import MotionClass

FRAMES: Final = "frames.parquet"
SITUATIONS: Final = "situations.npy"


@dataclass(frozen=True)
class Material:
    """Where frames come from: a folder that ``keep`` made, or, without one, synthetic drives of so many frames."""

    kept: Path | None = None
    recordings: int = 40
    frames: int = 400

    def table(self, rng: np.random.Generator) -> pl.DataFrame:
        """Labelled predictions of one model, their errors to be replaced."""
        if self.kept:
            return _kept_table(self.kept)
        return predictions_of(wander(rng, self.recordings, self.frames), rng)

    def table_and_scans(
        self, rng: np.random.Generator, options: ErrorOptions
    ) -> tuple[pl.DataFrame, Float32[np.ndarray, "frames rays"]]:
        """The same with the situations of its rows."""
        if self.kept:
            return _kept_table(self.kept), np.load(self.kept / SITUATIONS, mmap_mode="r")
        wandered = wander(rng, self.recordings, self.frames)
        return predictions_of(wandered, rng), situations(scans_of(wandered, rng), options)


def keep(frames: LabelledFrames, scans: Float32[np.ndarray, "frames rays"], folder: Path) -> Material:
    """Lay frames and their situations down in ``folder``, where other processes can reach them."""
    frames.table.write_parquet(folder / FRAMES)
    np.save(folder / SITUATIONS, scans)
    return Material(folder)


def with_errors(table: pl.DataFrame, wrong: Bool[np.ndarray, "frames"], options: ErrorOptions) -> LabelledFrames:
    """``table`` (labelled predictions of one model) with exactly the frames ``wrong`` wrong, in its order.

    A wrong prediction is the next class after the label; a right one is the label. Losses lie well beyond η on the side
    where they belong.
    """
    names = [motion.label for motion in MotionClass]
    names += sorted(set(table["label"].unique()) - set(names))
    following = dict(zip(names, [*names[1:], names[0]], strict=True))
    missed = pl.Series("wrong", wrong)
    loss = pl.when(missed).then(max(2.0, 2.0 * options.eta)).otherwise(min(0.1, 0.5 * options.eta))
    altered = table.with_columns(
        predicted=pl.when(missed).then(pl.col("label").replace_strict(following)).otherwise(pl.col("label")),
        loss_01=missed.cast(pl.Float32),
        loss_ce=loss.cast(pl.Float32),
    )
    return frames_of(altered, options, "planted errors")


def all_right(table: pl.DataFrame, options: ErrorOptions) -> LabelledFrames:
    """``table`` without errors."""
    return with_errors(table, np.zeros(table.height, bool), options)


@cache
def _kept_table(folder: Path) -> pl.DataFrame:
    return pl.read_parquet(folder / FRAMES)
