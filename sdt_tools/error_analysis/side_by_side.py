"""Several models on the same frames: their answers joined by recording and stamp, and what did not fit reported."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Bool, Float64, Int64

from sdt_tools.errors import UsageError
from sdt_tools.replay.predictions import scan_predictions

KEYS: Final = ("recording_id", "stamp_ns")
_ANSWERS: Final = ("predicted", "loss_01", "loss_ce")
_OF_A_MODEL: Final = ("model", "latency_us", *_ANSWERS)


@dataclass(frozen=True)
class Mismatch:
    """What was left out: labelled frames of ``model`` that others lack, or that are labelled otherwise elsewhere."""

    model: str
    frames: int
    without_partner: int
    other_label: int


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Labelled frames that all models have answered, sorted by recording and stamp.

    ``table`` has what is known of each frame (the columns of predictions but for the answers); ``predicted`` holds
    places in ``classes``; ``recording`` numbers recordings from 0, each a contiguous run of frames.
    """

    models: tuple[str, ...]
    table: pl.DataFrame
    recording: Int64[np.ndarray, "frames"]
    wrong: Bool[np.ndarray, "models frames"]
    loss_ce: Float64[np.ndarray, "models frames"]
    predicted: Int64[np.ndarray, "models frames"]
    classes: tuple[str, ...]
    mismatches: tuple[Mismatch, ...]

    @property
    def recordings(self) -> int:
        """How many recordings the frames come from."""
        return int(self.recording[-1]) + 1

    def column(self, name: str) -> np.ndarray:
        """A column of ``table`` as an array; unknown numbers are NaN, unknown names None."""
        return self.table[name].to_numpy()


def load_side_by_side(paths: Sequence[Path], models: Sequence[str] = ()) -> SideBySide:
    """The frames of ``paths`` that all ``models`` (all that the files hold, where none is named) have answered.

    Raises UsageError for files that are no predictions, unknown models, predictions without labels, a frame that a
    model answered twice, losses that are not finite, and for models that share no frame.
    """
    rows = scan_predictions(paths)
    held = rows.select(pl.col("model").unique().sort()).collect()["model"].to_list()
    where = ", ".join(str(path) for path in paths[:3]) + (" …" if len(paths) > 3 else "")
    if not held:
        raise UsageError(f"{where}: no frames; replay a recording that has some")
    for name in models:
        if name not in held:
            raise UsageError(f"{where}: no predictions of model '{name}'; there are {', '.join(held)}")
    names = tuple(models) or tuple(held)
    everything = [name for name in rows.collect_schema().names() if name not in ("logits", "features")]
    answers = ["recording", *KEYS, "label", *_ANSWERS]
    each = [_labelled(rows, name, answers if place else everything, where) for place, name in enumerate(names)]
    shared = each[0].select(*KEYS, "label")
    for other in each[1:]:
        shared = shared.join(other.select(*KEYS, "label"), on=[*KEYS, "label"], how="inner")
    if shared.is_empty():
        raise UsageError(
            f"{where}: no labelled frame was answered by all of {', '.join(names)}; replay them over the same "
            "recordings and labels"
        )
    labels = pl.concat([frames.select(*KEYS, "label") for frames in each]).unique()
    disputed = labels.filter(pl.struct(KEYS).is_duplicated()).select(KEYS).unique()
    mismatches = tuple(_mismatch(name, frames, shared, disputed) for name, frames in zip(names, each, strict=True))
    joined = [frames.join(shared.select(KEYS), on=KEYS, how="semi").sort("recording", *KEYS) for frames in each]
    table = joined[0]
    by_key = [table.select(KEYS).join(other, on=KEYS, how="left", maintain_order="left") for other in joined]
    classes = tuple(sorted(set().union(*(frames["predicted"].unique().to_list() for frames in by_key))))
    places = {label: place for place, label in enumerate(classes)}
    loss_ce = np.array([frames["loss_ce"].cast(pl.Float64).to_numpy() for frames in by_key])
    if not np.isfinite(loss_ce).all():
        raise UsageError(f"{where}: {int((~np.isfinite(loss_ce)).sum())} losses are not finite; check the models")
    return SideBySide(
        models=names,
        table=table.drop(_OF_A_MODEL),
        recording=table.select(pl.col("recording_id").rle_id().cast(pl.Int64)).to_series().to_numpy(),
        wrong=np.array([frames["loss_01"].to_numpy() > 0.5 for frames in by_key]),
        loss_ce=loss_ce,
        predicted=np.array([frames["predicted"].replace_strict(places, return_dtype=pl.Int64) for frames in by_key]),
        classes=classes,
        mismatches=mismatches,
    )


def _labelled(rows: pl.LazyFrame, model: str, columns: Sequence[str], where: str) -> pl.DataFrame:
    """Those columns of the labelled frames of one model."""
    frames = rows.filter((pl.col("model") == model) & pl.col("label").is_not_null()).select(columns).collect()
    if frames.is_empty():
        raise UsageError(
            f"{where}: none of the frames of '{model}' has a label, so none can be called wrong; "
            "label the recordings (`sdt label`), then replay with --labels"
        )
    twice = frames.filter(pl.struct(KEYS).is_duplicated())
    if not twice.is_empty():
        stem, stamp_ns = twice.row(0, named=True)["recording"], twice.row(0, named=True)["stamp_ns"]
        raise UsageError(f"{where}: '{model}' answered {stem} at {stamp_ns} ns twice; give each replay once")
    return frames


def _mismatch(model: str, frames: pl.DataFrame, shared: pl.DataFrame, disputed: pl.DataFrame) -> Mismatch:
    left_out = frames.join(shared, on=KEYS, how="anti")
    other_label = len(left_out.join(disputed, on=KEYS, how="semi"))
    return Mismatch(model, len(frames), len(left_out) - other_label, other_label)
