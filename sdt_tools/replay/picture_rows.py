"""One recording under one vision network: a row a picture, without a file."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, Literal, Protocol, runtime_checkable

import numpy as np
import polars as pl
from jaxtyping import Float32, UInt8

from sdt_tools.errors import RecordingError
from sdt_tools.frames import CameraImage, Gesture
from sdt_tools.models.vision.pictures import decode_picture
from sdt_tools.recording.messages.topics import CAMERA_IMAGE
from sdt_tools.recording.reader import Recording
from sdt_tools.replay.picture_features import picture_features, picture_measures
from sdt_tools.replay.predictions import PICTURE_SCHEMA
from sdt_tools.replay.rows import cross_entropy
from sdt_tools.replay.signals import read_signals
from sdt_tools.replay.tracks import read_tracks

GESTURES: Final = tuple(gesture.label for gesture in Gesture)
_MEASURES: Final = ("brightness", "contrast", "blown_share", "sharpness")
_LARGEST: Final = float(np.finfo(np.float16).max)


@runtime_checkable
class GestureModel(Protocol):
    """Something that answers pictures, as ``models.vision.loaded.LoadedVisionModel`` does."""

    @property
    def name(self) -> str:
        """What its predictions are filed under."""
        ...

    def pixels(self, picture_bgr_u8: UInt8[np.ndarray, "rows columns *colours"]) -> UInt8[np.ndarray, "height width 3"]:
        """A picture as the network sees it."""
        ...

    def answer(
        self, images_u8: UInt8[np.ndarray, "images height width 3"]
    ) -> tuple[Float32[np.ndarray, "images 3"], Float32[np.ndarray, "images features"]]:
        """One logit a gesture, and places in feature space."""
        ...


@dataclass(frozen=True, eq=False)
class PictureRows:
    """Predictions, and the stamps of pictures that no decoder reads, which were passed over."""

    rows: pl.DataFrame
    unreadable_ns: tuple[int, ...]


@dataclass
class _Batch:
    """Pictures waiting to be answered, and how long making pixels of them took."""

    stamps_ns: list[int] = field(default_factory=list)
    images_u8: list[UInt8[np.ndarray, "height width 3"]] = field(default_factory=list)
    measures: list[tuple[float, float, float, float]] = field(default_factory=list)
    spent_ns: int = 0


def predict_pictures(
    model: GestureModel,
    recording: Recording,
    labels: pl.DataFrame,
    frames: Literal["all", "labelled"],
    batch: int,
) -> PictureRows:
    """Predictions for the pictures of ``recording``, in the columns of ``PICTURE_SCHEMA``, in order of receipt.

    ``labels`` has the columns stamp_ns and label. Pictures are read, answered ``batch`` at a time, and let go of;
    latency is from JPEG to answer. Features are kept in half precision. Raises RecordingError where the recording
    cannot be read.
    """
    wanted_ns = frozenset(labels["stamp_ns"].to_list()) if frames == "labelled" else None
    unreadable_ns: list[int] = []
    answers = [_answered(model, one) for one in _batches(model, recording, wanted_ns, batch, unreadable_ns)]
    if not answers:
        return PictureRows(pl.DataFrame(schema=PICTURE_SCHEMA), tuple(unreadable_ns))
    rows = pl.concat(answers)
    around = picture_features(read_tracks(recording), read_signals(recording), rows["stamp_ns"].to_numpy())
    rows = pl.concat([rows, around], how="horizontal")
    rows = rows.join(labels.select("stamp_ns", "label"), on="stamp_ns", how="left", maintain_order="left")
    session = recording.session
    logits = rows["logits"].to_numpy()
    rows = rows.with_columns(
        recording=pl.lit(recording.stem),
        recording_id=pl.lit(recording.recording_id),
        model=pl.lit(model.name),
        loss_01=(pl.col("label") != pl.col("predicted")).cast(pl.Float32),
        loss_ce=cross_entropy(logits, rows["label"], GESTURES),
        gesture=pl.coalesce("label", "true_gesture"),
        scenario=pl.lit(session.get("scenario") or None),
        light=pl.lit(session.get("light") or None),
        surroundings=pl.lit(session.get("surroundings") or None),
        mask=pl.lit({"yes": True, "no": False}.get(session.get("mask", ""))),
    )
    return PictureRows(
        rows.select(pl.col(name).cast(dtype) for name, dtype in PICTURE_SCHEMA.items()), tuple(unreadable_ns)
    )


def _batches(
    model: GestureModel,
    recording: Recording,
    wanted_ns: frozenset[int] | None,
    size: int,
    unreadable_ns: list[int],
) -> Iterator[_Batch]:
    """Pictures that can be read; the stamps of the others are added to ``unreadable_ns``."""
    waiting = _Batch()
    for received in recording.messages((CAMERA_IMAGE,)):
        image = received.message
        if not isinstance(image, CameraImage) or (wanted_ns is not None and image.stamp_ns not in wanted_ns):
            continue
        began_ns = time.perf_counter_ns()
        try:
            picture_bgr_u8 = decode_picture(image.data)
        except RecordingError:
            unreadable_ns.append(image.stamp_ns)
            continue
        waiting.images_u8.append(model.pixels(picture_bgr_u8))
        waiting.spent_ns += time.perf_counter_ns() - began_ns
        waiting.stamps_ns.append(image.stamp_ns)
        waiting.measures.append(picture_measures(picture_bgr_u8))
        if len(waiting.stamps_ns) == size:
            yield waiting
            waiting = _Batch()
    if waiting.stamps_ns:
        yield waiting


def _answered(model: GestureModel, batch: _Batch) -> pl.DataFrame:
    began_ns = time.perf_counter_ns()
    logits, features = model.answer(np.stack(batch.images_u8))
    spent_ns = batch.spent_ns + time.perf_counter_ns() - began_ns
    measured = np.array(batch.measures)
    half = np.clip(features, -_LARGEST, _LARGEST).astype(np.float16)
    return pl.DataFrame(
        {
            "stamp_ns": batch.stamps_ns,
            "predicted": np.array(GESTURES)[logits.argmax(axis=1)],
            "logits": logits,
            "features": pl.Series(half).arr.to_list(),
            "latency_us": np.full(len(logits), spent_ns / 1000 / len(logits)),
            **{name: measured[:, number] for number, name in enumerate(_MEASURES)},
        }
    )
