"""One recording under one model: a row a frame, without a file."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal, Protocol, runtime_checkable

import numpy as np
import polars as pl
from jaxtyping import Bool, Float32, Float64, Int64

from sdt_tools.frames import MotionClass
from sdt_tools.recording.reader import Recording
from sdt_tools.replay.features import scan_features, track_features
from sdt_tools.replay.predictions import SCHEMA
from sdt_tools.replay.tracks import read_tracks

CLASSES: Final = tuple(motion.label for motion in MotionClass)
NO_LABELS: Final = pl.DataFrame(schema={"stamp_ns": pl.Int64, "label": pl.String})


@runtime_checkable
class MotionModel(Protocol):
    """Something that answers scans, as ``models.loaded.LoadedModel`` does."""

    @property
    def name(self) -> str:
        """What its predictions are filed under."""
        ...

    def predict_logits(self, ranges_m: Float64[np.ndarray, "scans rays"]) -> Float32[np.ndarray, "scans classes"]:
        """One logit a motion class for scans as the sensor gave them."""
        ...


@dataclass(frozen=True, eq=False)
class _Answers:
    """A batch of scans answered."""

    stamps_ns: Int64[np.ndarray, "frames"]
    logits: Float32[np.ndarray, "frames classes"]
    latency_us: Float64[np.ndarray, "frames"]
    features: pl.DataFrame


def predict_recording(
    model: MotionModel,
    recording: Recording,
    labels: pl.DataFrame,
    frames: Literal["all", "labelled"],
    batch: int,
) -> pl.DataFrame:
    """Predictions for the scans of ``recording``, in the columns of predictions files, in order of receipt.

    ``labels`` has the columns stamp_ns and label. Scans are read, answered ``batch`` at a time, and let go of. Raises
    RecordingError where the recording cannot be read.
    """
    labelled_ns = labels["stamp_ns"].to_numpy() if frames == "labelled" else None
    answers = list(_answers(model, recording, labelled_ns, batch))
    if not answers:
        return pl.DataFrame(schema=SCHEMA)
    stamps_ns = np.concatenate([answer.stamps_ns for answer in answers])
    logits = np.concatenate([answer.logits for answer in answers])
    names = np.array(CLASSES)
    rows = pl.DataFrame(
        {
            "stamp_ns": stamps_ns,
            "predicted": names[logits.argmax(axis=1)],
            "logits": logits,
            "latency_us": np.concatenate([answer.latency_us for answer in answers]),
        }
    )
    known = pl.concat([answer.features for answer in answers])
    around = track_features(read_tracks(recording), stamps_ns)
    rows = pl.concat([rows, known, around], how="horizontal")
    rows = rows.join(labels.select("stamp_ns", "label"), on="stamp_ns", how="left", maintain_order="left")
    session = recording.session
    return rows.with_columns(
        recording=pl.lit(recording.stem),
        recording_id=pl.lit(recording.recording_id),
        model=pl.lit(model.name),
        loss_01=(pl.col("label") != pl.col("predicted")).cast(pl.Float32),
        loss_ce=cross_entropy(logits, rows["label"]),
        motion=pl.coalesce("label", "expert"),
        scenario=pl.lit(session.get("scenario") or None),
        light=pl.lit(session.get("light") or None),
    ).select(pl.col(name).cast(dtype) for name, dtype in SCHEMA.items())


def cross_entropy(
    logits: Float32[np.ndarray, "frames classes"], labels: pl.Series, classes: Sequence[str] = CLASSES
) -> pl.Series:
    """-log of the probability of each label, in nats; null where there is none.

    ``classes`` are the names of the logits, in order.
    """
    exact = logits.astype(np.float64)
    largest = exact.max(axis=1, keepdims=True)
    normalizer = largest[:, 0] + np.log(np.exp(exact - largest).sum(axis=1))
    chosen = labels.replace_strict({name: number for number, name in enumerate(classes)}, default=None).cast(pl.Int64)
    losses = normalizer - exact[np.arange(len(exact)), chosen.fill_null(0).to_numpy()]
    return pl.select(pl.when(pl.Series(chosen.is_not_null())).then(pl.Series(losses))).to_series()


def _answers(
    model: MotionModel, recording: Recording, labelled_ns: Int64[np.ndarray, "labels"] | None, batch: int
) -> Iterator[_Answers]:
    for series in recording.scan_batches():
        wanted = _wanted(series.stamps_ns, labelled_ns)
        stamps_ns, ranges_m = series.stamps_ns[wanted], series.ranges_m[wanted]
        for start in range(0, len(stamps_ns), batch):
            ranges = ranges_m[start : start + batch]
            began_ns = time.perf_counter_ns()
            logits = model.predict_logits(ranges)
            latency_us = (time.perf_counter_ns() - began_ns) / 1000 / len(ranges)
            yield _Answers(
                stamps_ns[start : start + batch], logits, np.full(len(ranges), latency_us), scan_features(ranges)
            )


def _wanted(
    stamps_ns: Int64[np.ndarray, "scans"], labelled_ns: Int64[np.ndarray, "labels"] | None
) -> Bool[np.ndarray, "scans"] | slice:
    """Which scans are answered: all, or those at given stamps."""
    return slice(None) if labelled_ns is None else np.isin(stamps_ns, labelled_ns)
