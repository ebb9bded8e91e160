"""Labelled frames, from wherever they lie: a data set, labelled recordings, or predictions."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Float64, Int64

from sdt_tools.dataset.build import build_dataset
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.load import load_dataset
from sdt_tools.error_analysis.suspects.options import SuspectOptions
from sdt_tools.errors import UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.replay.predictions import PredictionKind, kind_of, scan_predictions
from sdt_tools.runs.local import Progress


@dataclass(frozen=True, eq=False)
class LabelledScans:
    """Frames with a label that may be wrong: ``keys`` has the columns recording, recording_id and stamp_ns."""

    keys: pl.DataFrame
    ranges_m: Float64[np.ndarray, "frames rays"]
    labels: Int64[np.ndarray, "frames"]


@dataclass(frozen=True, eq=False)
class Judged:
    """Frames, their labels, and how probable each class is to networks that did not learn from their recordings."""

    keys: pl.DataFrame
    labels: Int64[np.ndarray, "frames"]
    probabilities: Float64[np.ndarray, "frames classes"]


def scans_of_dataset(folder: Path) -> LabelledScans:
    """All frames of a data set of motions, of both splits. Raises DatasetError; UsageError for other classes."""
    dataset = load_dataset(folder)
    expected = tuple(motion.label for motion in MotionClass)
    if dataset.classes != expected:
        raise UsageError(f"{folder}: its classes are {', '.join(dataset.classes)}, not motions; name another data set")
    parts = (dataset.train, dataset.val)
    keys = pl.DataFrame(
        {
            "recording": [name for part in parts for name in part.recordings],
            "recording_id": [name for part in parts for name in part.recording_ids],
            "stamp_ns": np.concatenate([part.stamps_ns for part in parts]),
        }
    )
    ranges_m = np.concatenate([part.ranges_m for part in parts])
    return LabelledScans(keys, ranges_m, np.concatenate([part.labels for part in parts]))


def scans_of_recordings(
    recordings: Sequence[Path], labels_dir: Path, options: SuspectOptions, progress: Progress | None = None
) -> LabelledScans:
    """The labelled frames of recordings, no two of one nearer than ``spacing_s``.

    Raises RecordingError, LabelError or DatasetError as building a data set does.
    """
    config = DatasetConfig(
        spacing_s=options.spacing_s, per_recording_cap=None, balanced=False, conflict_level=0, seed=options.seed
    )
    with tempfile.TemporaryDirectory(prefix="sdt-suspects-") as folder:
        out = Path(folder) / "dataset"
        build_dataset(recordings, labels_dir, config, out, progress=progress)
        return scans_of_dataset(out)


def judged_by_predictions(paths: Sequence[Path], model: str | None = None) -> Judged:
    """The labelled frames of predictions, as the model in them sees them; it must not have learnt from them.

    Raises UsageError for files that hold no predictions, no labels, or several models where none is named.
    """
    rows = scan_predictions(paths).filter(pl.col("label").is_not_null())
    where = ", ".join(map(str, paths))
    if kind_of(rows.collect_schema().names()) is not PredictionKind.SCANS:
        raise UsageError(f"{where}: answers to pictures; wrong labels are looked for among those of scans")
    models = rows.select(pl.col("model").unique().sort()).collect()["model"].to_list()
    if not models:
        raise UsageError(f"{where}: none of the frames has a label; replay with --labels")
    if model is None and len(models) > 1:
        raise UsageError(f"{where}: predictions of {len(models)} models ({', '.join(models)}); name one with --model")
    if model is not None and model not in models:
        raise UsageError(f"{where}: no predictions of model '{model}'; there are those of {', '.join(models)}")
    table = rows.filter(pl.col("model") == (model or models[0])).collect()
    numbers = {motion.label: int(motion) for motion in MotionClass}
    logits = np.array(table["logits"].to_list(), np.float64)
    return Judged(
        keys=table.select("recording", "recording_id", "stamp_ns"),
        labels=table["label"].replace_strict(numbers, return_dtype=pl.Int64).to_numpy(),
        probabilities=softmax(logits),
    )


def softmax(logits: Float64[np.ndarray, "frames classes"]) -> Float64[np.ndarray, "frames classes"]:
    """Probabilities of logits, row by row."""
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    shares: Float64[np.ndarray, "frames classes"] = powers / powers.sum(axis=1, keepdims=True)
    return shares
