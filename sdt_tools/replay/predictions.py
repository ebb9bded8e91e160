"""Predictions as files: Parquet, one row a frame and model, with what is needed to ask why a frame is wrong.

A file holds the answers of follow networks to scans, or those of vision networks to pictures; each kind has its
columns. It says in its metadata that it holds predictions, and which classes its logits stand for. Whatever a recording
does not know (the operator in a real drive, the label of an unlabelled frame) is null.
"""

from collections.abc import Container, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Final

import polars as pl

from sdt_tools.errors import UsageError

FORMAT_KEY: Final = "sdt.predictions"
"""Key of the Parquet metadata; its value is the version of the schema below."""
FORMAT_VERSION: Final = "1"
CLASSES_KEY: Final = "sdt.classes"
"""Key of the Parquet metadata; its value names the classes, comma-separated, in the order of the logits."""

_ANSWER: Final[dict[str, pl.DataType]] = {
    "recording": pl.String(),  # stem of the recording's file
    "recording_id": pl.String(),
    "stamp_ns": pl.Int64(),  # of the scan, or of the picture
    "model": pl.String(),
    "label": pl.String(),
    "predicted": pl.String(),
    "logits": pl.List(pl.Float32()),
    "loss_01": pl.Float32(),  # 1 where the prediction is not the label
    "loss_ce": pl.Float32(),  # cross-entropy in nats
    "latency_us": pl.Float32(),  # of the frame's batch, divided by its frames
}
_SITUATION: Final[dict[str, pl.DataType]] = {
    "command": pl.String(),  # the motion that was driven
    "mode": pl.String(),
    "speed_mps": pl.Float32(),  # of the base along its heading, negative backwards
    "scenario": pl.String(),
    "light": pl.String(),
}

SCHEMA: Final[dict[str, pl.DataType]] = {
    **_ANSWER,
    "in_level_1": pl.Boolean(),  # inside some safety domain of the level
    "in_level_2": pl.Boolean(),
    "in_level_3": pl.Boolean(),
    "in_level_4": pl.Boolean(),
    "distance_level_1_m": pl.Float32(),  # root mean square per ray, to the nearest safety domain of the level
    "distance_level_2_m": pl.Float32(),
    "distance_level_3_m": pl.Float32(),
    "domain_distance_m": pl.Float32(),  # to the nearest safety domain of all: levels are nested, so of level 4
    "front_range_m": pl.Float32(),  # nearest valid ray from -60° to 60°
    "operator_range_m": pl.Float32(),  # from the LiDAR
    "operator_bearing_rad": pl.Float32(),  # in the LiDAR frame, left positive
    "motion": pl.String(),  # the right motion: the label; without one, what the expert said
    **_SITUATION,
    "invalid_share": pl.Float32(),  # share of rays without a distance
}
"""A row a scan: what a follow network answered."""

PICTURE_SCHEMA: Final[dict[str, pl.DataType]] = {
    **_ANSWER,
    "features": pl.List(pl.Float16()),  # what the network's last layer saw: the picture's place in feature space
    "operator_range_m": pl.Float32(),  # from the LiDAR
    "operator_bearing_rad": pl.Float32(),  # in the LiDAR frame, left positive
    "operator_turned_rad": pl.Float32(),  # 0 where he faces the robot, π where he shows his back
    "gesture": pl.String(),  # the right gesture: the label; without one, the true gesture
    "behaviour": pl.String(),  # what else his hands do: "none", or what may look like a gesture and is none
    "arms_changed_s": pl.Float32(),  # to the nearest change, before or after, of gesture or behaviour: arms move there
    "brightness": pl.Float32(),  # mean grey of the picture, 0 to 255
    "contrast": pl.Float32(),  # standard deviation of its grey
    "blown_share": pl.Float32(),  # share of its pixels at 250 or above
    "sharpness": pl.Float32(),  # standard deviation of its Laplacian at 320 × 240: small where it is blurred
    **_SITUATION,
    "turn_radps": pl.Float32(),  # of the base, left positive
    "surroundings": pl.String(),
    "mask": pl.Boolean(),  # whether the operator wears one
}
"""A row a picture: what a vision network answered."""


class PredictionKind(StrEnum):
    """What was answered: scans by a follow network, or pictures by a vision network."""

    SCANS = "scans"
    PICTURES = "pictures"


SCHEMAS: Final = {PredictionKind.SCANS: SCHEMA, PredictionKind.PICTURES: PICTURE_SCHEMA}
"""The columns of predictions of each kind."""


def kind_of(columns: Container[str]) -> PredictionKind:
    """The kind of predictions that have these columns."""
    return PredictionKind.PICTURES if "brightness" in columns else PredictionKind.SCANS


def scan_predictions(paths: Sequence[Path]) -> pl.LazyFrame:
    """The rows of prediction files, lazily. Columns beyond the schema are kept where all files have them.

    Raises UsageError naming the first file that is missing, does not hold predictions, or holds those of a vision
    network where the first one's are of a follow network, or the other way round.
    """
    if not paths:
        raise UsageError("no predictions given; name a file that `sdt replay` made")
    frames = [_scan_one(path) for path in paths]
    kinds = [kind_of(frame.collect_schema().names()) for frame in frames]
    for path, kind in zip(paths, kinds, strict=True):
        if kind is not kinds[0]:
            raise UsageError(f"{path}: holds answers to {kind}, but {paths[0]} to {kinds[0]}; give one kind at a time")
    schema = SCHEMAS[kinds[0]]
    shared = set.intersection(*(set(frame.collect_schema().names()) for frame in frames))
    extra = [name for name in frames[0].collect_schema().names() if name in shared and name not in schema]
    return pl.concat([frame.select(*schema, *extra) for frame in frames], how="vertical_relaxed")


def _scan_one(path: Path) -> pl.LazyFrame:
    if not path.exists():
        raise UsageError(f"{path}: no such file; name a file that `sdt replay` made")
    if path.is_dir():
        raise UsageError(f"{path}: is a folder; name the predictions file in it")
    try:
        schema = pl.read_parquet_schema(path)
    except (pl.exceptions.PolarsError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise UsageError(f"{path}: not a predictions file ({reason}); make one with `sdt replay`") from None
    for name, expected in SCHEMAS[kind_of(schema)].items():
        if name not in schema:
            raise UsageError(
                f"{path}: not a predictions file: it lacks the column '{name}'; make one with `sdt replay`"
            )
        if schema[name] != expected:
            raise UsageError(
                f"{path}: not a predictions file: the column '{name}' is {schema[name]}, not {expected}; "
                "make one with `sdt replay`"
            )
    return pl.scan_parquet(path)
