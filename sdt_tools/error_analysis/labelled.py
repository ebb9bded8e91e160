"""The labelled frames of one model: what an error analysis is about."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.definitions import ErrorOptions, is_right, is_wrong
from sdt_tools.errors import UsageError
from sdt_tools.replay.predictions import SCHEMAS, PredictionKind, kind_of, scan_predictions

UNUSED: Final = ("logits", "latency_us", "features")
"""Columns of predictions that no analysis of errors asks for, the widest among them."""


@dataclass(frozen=True, eq=False)
class LabelledFrames:
    """Frames with their loss, sorted by recording and stamp.

    ``table`` has the columns of predictions that an analysis may need, so neither logits nor latencies, and of other
    columns only those that conditions are made of; ``recording`` numbers the recordings from 0 in the
    order of the table, each a contiguous run of rows.
    """

    table: pl.DataFrame
    recording: Int64[np.ndarray, "frames"]
    stamp_ns: Int64[np.ndarray, "frames"]
    loss: Float64[np.ndarray, "frames"]
    wrong: Bool[np.ndarray, "frames"]
    right: Bool[np.ndarray, "frames"]

    @property
    def kind(self) -> PredictionKind:
        """Whether the frames are scans or pictures."""
        return kind_of(self.table.columns)

    @property
    def recordings(self) -> int:
        """How many recordings the frames come from."""
        return int(self.recording[-1]) + 1


def load_labelled(predictions: Path, options: ErrorOptions, model: str | None = None) -> LabelledFrames:
    """The labelled frames of ``model`` (needed where the file holds several) in a predictions file.

    Raises UsageError for a file without labels, without predictions, of several models, or of unknown model.
    """
    rows = scan_predictions([predictions])
    models = rows.select(pl.col("model").unique().sort()).collect()["model"].to_list()
    if not models:
        raise UsageError(f"{predictions}: holds no frames; replay a recording that has some")
    if model is None and len(models) > 1:
        raise UsageError(f"{predictions}: holds predictions of {len(models)} models ({', '.join(models)}); name one")
    if model is not None and model not in models:
        raise UsageError(f"{predictions}: no predictions of model '{model}'; it holds {', '.join(models)}")
    labelled = rows.filter((pl.col("model") == (model or models[0])) & pl.col("label").is_not_null())
    asked = [name.strip("|") for name in options.conditions.features]
    names = rows.collect_schema().names()
    schema = SCHEMAS[kind_of(names)]
    kept = [name for name in names if name in asked or (name in schema and name not in UNUSED)]
    table = labelled.select(kept).collect(engine="streaming")
    if table.is_empty():
        raise UsageError(
            f"{predictions}: none of its frames has a label, so no frame can be called wrong; "
            "label the recordings (`sdt label`), then replay with --labels"
        )
    return frames_of(table, options, str(predictions))


def frames_of(table: pl.DataFrame, options: ErrorOptions, where: str) -> LabelledFrames:
    """``table`` (columns of predictions, one model, all labelled) as frames; ``where`` names it in errors."""
    keys = ("recording", "recording_id", "stamp_ns")
    if not _in_order(table):
        table = table.sort(keys)
    starts = table.select(pl.struct("recording", "recording_id").rle_id().cast(pl.Int64)).to_series().to_numpy()
    stamps_ns = table["stamp_ns"].to_numpy()
    twice = np.flatnonzero((np.diff(starts) == 0) & (np.diff(stamps_ns) == 0))
    if twice.size:
        stem, _, stamp_ns = table.select(keys).row(int(twice[0]))
        raise UsageError(f"{where}: holds the frame of {stem} at {stamp_ns} ns twice; replay each recording once")
    loss = table["loss_01" if options.loss == "zero_one" else "loss_ce"].cast(pl.Float64).to_numpy()
    if not np.isfinite(loss).all():
        raise UsageError(
            f"{where}: {int((~np.isfinite(loss)).sum())} frames have a loss that is not finite; check the model"
        )
    return LabelledFrames(
        table=table,
        recording=starts,
        stamp_ns=stamps_ns,
        loss=loss,
        wrong=is_wrong(loss, options.eta),
        right=is_right(loss, options.eta),
    )


def _in_order(table: pl.DataFrame) -> bool:
    """Whether rows are sorted by recording and stamp, as they mostly are: sorting takes a second table."""
    runs = table.select(
        pl.struct("recording", "recording_id").rle_id().alias("run"), "recording", "recording_id", "stamp_ns"
    )
    steps = runs.select(((pl.col("run").diff() == 0) & (pl.col("stamp_ns").diff() < 0)).any()).item()
    heads = runs.group_by("run", maintain_order=True).first().select("recording", "recording_id")
    return not steps and heads.equals(heads.sort("recording", "recording_id"))
