"""Predictions as files: Parquet, one row a frame and model, with what is needed to ask why a frame is wrong.

A file says in its metadata that it holds predictions, and which classes its logits stand for. Whatever a recording does
not know (the operator in a real drive, the label of an unlabelled frame) is null.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import polars as pl

from sdt_tools.errors import UsageError

FORMAT_KEY: Final = "sdt.predictions"
"""Key of the Parquet metadata; its value is the version of the schema below."""
FORMAT_VERSION: Final = "1"
CLASSES_KEY: Final = "sdt.classes"
"""Key of the Parquet metadata; its value names the classes, comma-separated, in the order of the logits."""

SCHEMA: Final[dict[str, pl.DataType]] = {
    "recording": pl.String(),  # stem of the recording's file
    "recording_id": pl.String(),
    "stamp_ns": pl.Int64(),  # of the scan
    "model": pl.String(),
    "label": pl.String(),
    "predicted": pl.String(),
    "logits": pl.List(pl.Float32()),
    "loss_01": pl.Float32(),  # 1 where the prediction is not the label
    "loss_ce": pl.Float32(),  # cross-entropy in nats
    "latency_us": pl.Float32(),  # of the frame's batch, divided by its frames
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
    "command": pl.String(),  # the motion that was driven
    "mode": pl.String(),
    "speed_mps": pl.Float32(),  # of the base along its heading, negative backwards
    "scenario": pl.String(),
    "light": pl.String(),
    "invalid_share": pl.Float32(),  # share of rays without a distance
}


def scan_predictions(paths: Sequence[Path]) -> pl.LazyFrame:
    """The rows of prediction files, lazily. Columns beyond the schema are kept where all files have them.

    Raises UsageError naming the first file that is missing or does not hold predictions.
    """
    if not paths:
        raise UsageError("no predictions given; name a file that `sdt replay` made")
    frames = [_scan_one(path) for path in paths]
    shared = set.intersection(*(set(frame.collect_schema().names()) for frame in frames))
    extra = [name for name in frames[0].collect_schema().names() if name in shared and name not in SCHEMA]
    return pl.concat([frame.select(*SCHEMA, *extra) for frame in frames], how="vertical_relaxed")


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
    for name, expected in SCHEMA.items():
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
