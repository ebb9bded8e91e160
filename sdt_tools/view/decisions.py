"""What was said of a recording's frames: the labels, and for each model its predictions, losses and error tags.

The frames of a follow network are scans, said to be motions; those of a vision network pictures, said to be gestures.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl
from jaxtyping import Float64, Int64

from sdt_tools.errors import UsageError
from sdt_tools.view import palette
from sdt_tools.view.palette import CORRECT, ERROR, STATUSES, UNLABELED
from sdt_tools.view.timeline import held

KEY = ("recording_id", "model", "stamp_ns")
"""What a row of predictions and a row of tags share."""

_ANSWERS = {
    "recording_id": pl.String(),
    "model": pl.String(),
    "stamp_ns": pl.Int64(),
    "label": pl.String(),
    "predicted": pl.String(),
    "loss_ce": pl.Float32(),
}
_NO_ANSWERS = pl.DataFrame(schema=_ANSWERS)


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels at the stamps of scans, or of pictures, in order."""

    stamps_ns: Int64[np.ndarray, "labels"]
    names: tuple[str, ...]


NOT_LABELLED = Labels(np.empty(0, np.int64), ())


@dataclass(frozen=True, eq=False)
class ModelTrack:
    """One model over one recording, in order of stamps.

    ``labels`` are empty where a frame has none; ``loss`` (cross-entropy, nats) is NaN there. ``tags`` are empty where
    nothing was analysed.
    """

    model: str
    stamps_ns: Int64[np.ndarray, "frames"]
    predicted: tuple[str, ...]
    labels: tuple[str, ...]
    loss: Float64[np.ndarray, "frames"]
    tags: tuple[str, ...]

    @property
    def of_pictures(self) -> bool:
        """Whether the model answers pictures."""
        return self.predicted[0] in palette.GESTURES

    @property
    def has_tags(self) -> bool:
        """Whether an error analysis says anything about this track."""
        return any(self.tags)

    def statuses(self) -> tuple[str, ...]:
        """Of each frame what is known: its tag; without one, whether it is correct; without a label, ``unlabeled``."""
        return tuple(
            tag or (UNLABELED if not label else CORRECT if label == predicted else ERROR)
            for predicted, label, tag in zip(self.predicted, self.labels, self.tags, strict=True)
        )


def labels_of(frame: pl.DataFrame | None, names: Collection[str]) -> Labels:
    """Those of the resolved labels (columns stamp_ns and label) that are among ``names``."""
    if frame is None:
        return NOT_LABELLED
    known = frame.select("stamp_ns", "label").filter(pl.col("label").is_in(list(names))).sort("stamp_ns")
    return Labels(known["stamp_ns"].to_numpy(), tuple(known["label"].to_list()))


def labels_in(models: Sequence[ModelTrack], of_pictures: bool) -> Labels:
    """Labels of scans, or of pictures, as the frames of the first model carry them that has any."""
    for track in models:
        if track.of_pictures is not of_pictures:
            continue
        rows = [row for row, label in enumerate(track.labels) if label]
        if rows:
            return Labels(track.stamps_ns[np.array(rows)], tuple(track.labels[row] for row in rows))
    return NOT_LABELLED


def models_of(
    recording_id: str,
    predictions: Sequence[pl.DataFrame],
    tags: Sequence[pl.DataFrame],
    labels: Labels,
    gestures: Labels = NOT_LABELLED,
) -> tuple[ModelTrack, ...]:
    """The tracks of all models over the recording ``recording_id``, in the order in which they are first given.

    Frames of predictions hold the columns recording_id, stamp_ns, model, label, predicted and loss_ce; those of tags
    the same key and tag, and the others too where a model is known from them alone. Rows of other recordings are passed
    over. Where predictions were made without labels, ``labels`` of scans and labelled ``gestures`` of pictures take
    their place; the loss stays unknown.

    Raises UsageError where all predictions, or all tags, are about other recordings, and for an unknown tag.
    """
    ours = [_answers(frame, recording_id) for frame in predictions]
    rows = pl.concat(ours or [_NO_ANSWERS])
    if predictions and rows.is_empty():
        raise UsageError(_nothing_about(recording_id, predictions, "predictions", "replay the model over"))
    if tags and not any((frame["recording_id"] == recording_id).any() for frame in tags):
        raise UsageError(_nothing_about(recording_id, tags, "tags", "analyse the errors of"))
    told = [_answers(frame, recording_id) for frame in tags if set(_ANSWERS) <= set(frame.columns)]
    rows = pl.concat([rows, pl.concat(told or [_NO_ANSWERS]).join(rows, on="model", how="anti")])
    if rows.is_empty():
        return ()
    rows = rows.unique(KEY, keep="last", maintain_order=True)
    rows = rows.join(_tags_by_frame(tags), on=list(KEY), how="left", maintain_order="left")
    given = {"stamp_ns": pl.Int64, "given": pl.String, "of_picture": pl.Boolean}
    known = pl.concat(
        pl.DataFrame({"stamp_ns": one.stamps_ns, "given": list(one.names), "of_picture": of_picture}, given)
        for one, of_picture in ((labels, False), (gestures, True))
    )
    rows = rows.with_columns(pl.col("predicted").is_in(list(palette.GESTURES)).alias("of_picture"))
    rows = rows.join(known, on=["stamp_ns", "of_picture"], how="left", maintain_order="left")
    rows = rows.with_columns(pl.coalesce("label", "given").fill_null("").alias("label"), pl.col("tag").fill_null(""))
    return tuple(_track(frame) for frame in rows.partition_by("model", maintain_order=True))


def _answers(frame: pl.DataFrame, recording_id: str) -> pl.DataFrame:
    """What models said about one recording."""
    ours = frame.filter(pl.col("recording_id") == recording_id)
    return ours.select(pl.col(name).cast(dtype) for name, dtype in _ANSWERS.items())


def _nothing_about(recording_id: str, given: Sequence[pl.DataFrame], what: str, remedy: str) -> str:
    others = pl.concat([frame.select("recording_id") for frame in given])["recording_id"].unique().sort().to_list()
    named = ", ".join(others[:3]) + (" …" if len(others) > 3 else "")
    return (
        f"none of the {what} is about recording {recording_id}; they are about {named or 'nothing'}: "
        f"{remedy} this recording first"
    )


def _tags_by_frame(tags: Sequence[pl.DataFrame]) -> pl.DataFrame:
    schema = {"recording_id": pl.String, "model": pl.String, "stamp_ns": pl.Int64, "tag": pl.String}
    frames = [frame.select(pl.col(name).cast(dtype) for name, dtype in schema.items()) for frame in tags]
    table = pl.concat([pl.DataFrame(schema=schema), *frames]).unique(KEY, keep="last", maintain_order=True)
    unknown = sorted(set(table["tag"].drop_nulls().to_list()) - set(STATUSES))
    if unknown:
        raise UsageError(f"unknown error tag '{unknown[0]}'; it is one of {', '.join(STATUSES)}")
    return table


def _track(rows: pl.DataFrame) -> ModelTrack:
    rows = rows.sort("stamp_ns")
    return ModelTrack(
        model=str(rows["model"][0]),
        stamps_ns=rows["stamp_ns"].to_numpy(),
        predicted=tuple(rows["predicted"].to_list()),
        labels=tuple(rows["label"].to_list()),
        loss=rows["loss_ce"].cast(pl.Float64).fill_null(np.nan).to_numpy(),
        tags=tuple(rows["tag"].to_list()),
    )


@dataclass(frozen=True, eq=False)
class Judged:
    """The frames of a model of which something is known, and what."""

    stamps_ns: Int64[np.ndarray, "judged"]
    statuses: tuple[str, ...]

    def at(self, stamps_ns: Int64[np.ndarray, "rows"]) -> list[str]:
        """What is known at other stamps.

        Labels are often sparser than scans: the word on a labelled frame holds for the scans just after it, as it does
        in the lanes.
        """
        rows = held(self.stamps_ns, stamps_ns).tolist()
        return [self.statuses[row] if row >= 0 else UNLABELED for row in rows]


def judge(track: ModelTrack) -> Judged:
    """What is known of a model's frames."""
    statuses = track.statuses()
    rows = [row for row, status in enumerate(statuses) if status != UNLABELED]
    return Judged(track.stamps_ns[np.array(rows, np.int64)], tuple(statuses[row] for row in rows))


NOTHING_JUDGED = Judged(np.empty(0, np.int64), ())


@dataclass(frozen=True)
class ErrorRun:
    """Wrong frames in a row with the same answer, label and tag."""

    stamp_ns: int
    frames: int
    predicted: str
    label: str
    tag: str

    def text(self) -> str:
        """One line for the log."""
        frames = "1 frame" if self.frames == 1 else f"{self.frames} frames"
        return f"{self.tag or ERROR}: says {self.predicted}, label {self.label} ({frames})"


def error_runs(track: ModelTrack) -> list[ErrorRun]:
    """The errors of a track, one entry for a run of labelled frames that are wrong in the same way."""
    runs: list[ErrorRun] = []
    last: tuple[str, str, str] | None = None
    rows = zip(track.stamps_ns.tolist(), track.predicted, track.labels, track.tags, strict=True)
    for stamp_ns, predicted, label, tag in rows:
        if not label:
            continue
        kind = (predicted, label, tag) if predicted != label else None
        if kind is None:
            last = None
            continue
        if kind == last:
            newest = runs.pop()
            runs.append(ErrorRun(newest.stamp_ns, newest.frames + 1, predicted, label, tag))
        else:
            runs.append(ErrorRun(stamp_ns, 1, predicted, label, tag))
        last = kind
    return runs
