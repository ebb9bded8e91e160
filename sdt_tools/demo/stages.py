"""The stages of the demonstration, each a function that fills a folder from what the stages before have made."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import polars as pl

from sdt_tools.dataset.build import build_dataset
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.error_analysis.analyse import analyse_errors
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.labeling.auto import label_automatically
from sdt_tools.labeling.journal import read_journal
from sdt_tools.labeling.resolve import resolve
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, journal_path
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.protocols import Driver
from sdt_tools.recording.live.drivers import ExpertDriver
from sdt_tools.recording.live.scene_session import SceneRecordingConfig, record_scene
from sdt_tools.recording.messages.topics import LIDAR_SCAN
from sdt_tools.replay.predictions import scan_predictions
from sdt_tools.replay.replay import replay
from sdt_tools.robustness.conflicts import conflict_check
from sdt_tools.scene.source import SceneSource
from sdt_tools.training.follow import FollowTrainingConfig, Progress, train_follow
from sdt_tools.view.log import write_rrd

SUMMARY: Final = "summary.json"
MODEL: Final = "follow-0"
DATASET: Final = "follow"
PREDICTIONS: Final = "predictions.parquet"
ERRORS: Final = "follow-0"
RRD: Final = "demo.rrd"


def record_stage(out: Path, configs: Sequence[SceneRecordingConfig]) -> None:
    """Record scenes, each to ``<scenario>_<seed>.mcap``, the expert at the wheel."""
    frames = dropped = 0
    for config in configs:
        summary = record_scene(config, out / f"{config.scenario}_{config.seed:04d}.mcap", _expert_driver)
        frames += summary.frames.get(LIDAR_SCAN, 0)
        dropped += summary.lost_frames
    _note(out, {"frames": frames, "dropped": dropped})


def label_stage(out: Path, recordings: Sequence[Path]) -> None:
    """Label every decision with what the expert would have done."""
    for recording in recordings_in(recordings):
        label_automatically(recording, LabelKind.MOTION, LabelSource.TRUTH, out)


def dataset_stage(out: Path, recordings: Sequence[Path], labels: Path, config: DatasetConfig) -> None:
    """Draw the data set; labels that a safety domain forbids are refused unless ``config`` allows them."""
    summary = build_dataset(
        recordings_in(recordings), labels, config, out / DATASET, conflict_check(config.conflict_level)
    )
    _note(out, {"train_frames": summary.train_frames, "val_frames": summary.val_frames, "counts": summary.counts})


def train_stage(out: Path, dataset: Path, config: FollowTrainingConfig, progress: Progress | None = None) -> None:
    """Train the network of level 0."""
    summary = train_follow(dataset / DATASET, config, out / MODEL, progress)
    _note(
        out,
        {
            "train_accuracy": summary.train.accuracy,
            "val_accuracy": summary.val.accuracy,
            "val_forward_recall": summary.val.forward_recall,
            "val_recall": dict(summary.val.recall),
            "seconds": summary.seconds,
        },
    )


def replay_stage(
    out: Path, model: Path, dataset: Path, practice: Sequence[Path], others: Sequence[Path], labels: Path
) -> None:
    """Replay the network over recordings that it has not learnt from: the held-out practice ones, and ``others``."""
    held_out = held_out_recordings(dataset / DATASET)
    recordings = [path for path in recordings_in(practice) if path.stem in held_out] + recordings_in(others)
    summary = replay(load_checkpoint(model / MODEL), recordings, labels, out / PREDICTIONS, model_folder=model / MODEL)
    _note(
        out,
        {
            "recordings": summary.recordings,
            "frames": summary.frames,
            "labelled": summary.labelled,
            "wrong": summary.wrong,
            "frames_per_s": summary.frames_per_s,
        },
    )


def errors_stage(
    out: Path, predictions: Path, recordings: Sequence[Path], options: ErrorOptions, found_at: Path
) -> None:
    """Tag every wrong frame; ``found_at`` is where the stage's folder will lie."""
    report = analyse_errors(predictions / PREDICTIONS, recordings, options, out / ERRORS, found_at=found_at / ERRORS)
    _note(out, report.document())


def view_stage(out: Path, recording: Path, labels: Path, predictions: Path, errors: Path) -> None:
    """One recording with all that is known of it, for Rerun."""
    (path,) = recordings_in([recording])[:1]
    journal = read_journal(journal_path(labels, path.stem, LabelKind.MOTION))
    write_rrd(
        path,
        out / RRD,
        labels=resolve(journal),
        predictions=[scan_predictions([predictions / PREDICTIONS]).filter(pl.col("recording") == path.stem).collect()],
        tags=[pl.read_parquet(errors / ERRORS / "tags.parquet").filter(pl.col("recording") == path.stem)],
    )


def recordings_in(folders: Sequence[Path]) -> list[Path]:
    """The recordings in some folders, by name."""
    return sorted(path for folder in folders for path in folder.glob("*.mcap"))


def held_out_recordings(dataset: Path) -> set[str]:
    """Stems of the recordings that a data set keeps for validation."""
    frames = pl.scan_parquet(dataset / "frames.parquet").filter(pl.col("split") == "val")
    return set(frames.select(pl.col("recording").cast(pl.String).unique()).collect()["recording"])


def read_note(folder: Path) -> dict[str, Any]:
    """What a stage said of itself."""
    note: dict[str, Any] = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    return note


def _expert_driver(name: str, source: SceneSource) -> Driver:
    assert name == "expert"
    return ExpertDriver(source.expert)


def _note(out: Path, document: dict[str, object]) -> None:
    (out / SUMMARY).write_text(json.dumps(document, indent=2, default=str) + "\n", encoding="utf-8")
