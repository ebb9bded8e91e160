"""Predictions whose errors are known, as files and side by side."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Bool

from sdt_tools.error_analysis.claims.material import Material, Network
from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.error_analysis.resampling import draw_units
from sdt_tools.error_analysis.side_by_side import SideBySide
from sdt_tools.frames import MotionClass
from sdt_tools.replay.predictions import SCHEMA

OPTIONS = ClaimOptions(resamples=400)
CLASSES = tuple(motion.label for motion in MotionClass)


def frames_table(recordings: int = 12, frames: int = 50, seed: int = 0) -> pl.DataFrame:
    """Frames without answers: labels, distances and scenarios drawn; inside level k where its distance is 0."""
    rng = np.random.default_rng(seed)
    count = recordings * frames
    number = np.repeat(np.arange(recordings), frames)
    distance_m = np.maximum(rng.uniform(-0.3, 2.0, count), 0.0)
    label = np.array(CLASSES)[rng.integers(0, 7, count)]
    label[distance_m == 0.0] = "backward"
    known: dict[str, object] = {
        "recording": [f"drive_{one:03d}" for one in number],
        "recording_id": [f"id-{one:03d}" for one in number],
        "stamp_ns": np.tile(np.arange(frames) * 100_000_000, recordings),
        "label": label,
        "motion": label,
        "scenario": np.array(["plain", "around_boxes", "through_gate"])[number % 3],
        "front_range_m": rng.uniform(0.2, 3.0, count),
        "speed_mps": rng.normal(0.0, 0.3, count),
        "domain_distance_m": distance_m,
        **{f"distance_level_{level}_m": distance_m for level in (1, 2, 3)},
        **{f"in_level_{level}": distance_m == 0.0 for level in (1, 2, 3, 4)},
    }
    columns = {name: known.get(name, [None] * count) for name in SCHEMA}
    return pl.DataFrame(columns, schema_overrides=dict(SCHEMA))


def with_answers(table: pl.DataFrame, model: str, wrong: Bool[np.ndarray, "frames"]) -> pl.DataFrame:
    """Predictions of ``model``: the class after the label where it is wrong; logits 3 for the answer and 0."""
    right = np.array([CLASSES.index(label) for label in table["label"].fill_null("stay")])
    answer = np.where(wrong, (right + 1) % 7, right)
    logits = 3.0 * (answer[:, None] == np.arange(7)[None])
    loss = np.log(np.exp(logits).sum(axis=1)) - logits[np.arange(len(right)), right]
    unknown = table["label"].is_null()
    return table.with_columns(
        model=pl.lit(model),
        predicted=pl.Series([CLASSES[code] for code in answer]),
        logits=pl.Series(logits.tolist(), dtype=pl.List(pl.Float32)),
        loss_01=pl.when(unknown).then(None).otherwise(pl.Series(wrong.astype(np.float32))),
        loss_ce=pl.when(unknown).then(None).otherwise(pl.Series(loss.astype(np.float32))),
        latency_us=pl.lit(1.0, pl.Float32),
    ).select(*SCHEMA)


def write_predictions(path: Path, table: pl.DataFrame, model: str, wrong: Bool[np.ndarray, "frames"]) -> Path:
    """A predictions file."""
    with_answers(table, model, wrong).write_parquet(path)
    return path


def side_by_side(table: pl.DataFrame, wrong: Mapping[str, Bool[np.ndarray, "frames"]]) -> SideBySide:
    """Models that answer ``table``, wrong where told."""
    answered = {name: with_answers(table, name, errors) for name, errors in wrong.items()}
    predicted = [[CLASSES.index(answer) for answer in rows["predicted"]] for rows in answered.values()]
    return SideBySide(
        models=tuple(wrong),
        table=table.drop("model", "predicted", "logits", "loss_01", "loss_ce", "latency_us"),
        recording=table.select(pl.col("recording_id").rle_id().cast(pl.Int64)).to_series().to_numpy(),
        wrong=np.array(list(wrong.values())),
        loss_ce=np.array([rows["loss_ce"].cast(pl.Float64).to_numpy() for rows in answered.values()]),
        predicted=np.array(predicted, dtype=np.int64),
        classes=CLASSES,
        mismatches=(),
    )


def material(table: pl.DataFrame, wrong: Mapping[int, list[np.ndarray]], options: ClaimOptions = OPTIONS) -> Material:
    """Networks by level, wrong where told; all trained to bounds below their training loss."""
    named = {f"level{level}-{seed}": errors for level, several in wrong.items() for seed, errors in enumerate(several)}
    networks = tuple(
        Network(f"level{level}-{seed}", "follow_plain", level, False, seed, Path(), 0.2, 0.1, 0.9)
        for level, several in wrong.items()
        for seed in range(len(several))
    )
    frames = side_by_side(table, named)
    return Material(networks, frames, draw_units(frames.recordings, options.resamples, options.seed))
