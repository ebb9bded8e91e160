"""Training a follow network on a data set."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from pydantic import Field, JsonValue

from sdt_tools.config import Config
from sdt_tools.dataset.load import Dataset, FrameSet, load_dataset
from sdt_tools.errors import DatasetError
from sdt_tools.frames import MotionClass
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import reserve, save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.loaded import logits_of
from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes
from sdt_tools.training.augment import AugmentConfig, VariedBatches
from sdt_tools.training.curve import curve_csv, curve_png
from sdt_tools.training.loop import Batch, EpochRecord, LoopConfig, LoopResult, run_loop
from sdt_tools.training.metrics import Score, score

Progress = Callable[[EpochRecord, int], None]
"""Called after each epoch with its record and the number of epochs in all."""


class FollowTrainingConfig(Config):
    """All that shapes a follow network beside its data."""

    seed: int = Field(default=0, ge=0)
    batch_size: int = Field(default=64, ge=1)
    architecture: FollowNetConfig = FollowNetConfig()
    preprocess: PreprocessConfig = PreprocessConfig()
    augment: AugmentConfig = AugmentConfig()
    loop: LoopConfig = LoopConfig()


@dataclass(frozen=True, eq=False)
class TrainingSummary:
    """What came out; ``kept_epoch`` is the last, or after an interruption the best on validation."""

    out: Path
    train: Score
    val: Score
    epochs: int
    kept_epoch: int
    interrupted: bool
    seconds: float


def train_follow(
    dataset_dir: Path, config: FollowTrainingConfig, out: Path, progress: Progress | None = None
) -> TrainingSummary:
    """Train on a motion data set and write the checkpoint ``out``, the learning curve in it (curve.csv, curve.png).

    Interrupted (KeyboardInterrupt) after an epoch, it keeps the best one so far. Raises OutputExistsError, DatasetError
    for a data set that is missing, damaged or not of motions, and RunError when the training diverges.
    """
    reserve(out)
    dataset = load_dataset(dataset_dir)
    _check_classes(dataset)
    started = time.monotonic()
    network = new_follow_net(config.architecture, config.preprocess, config.seed)
    result = _fit(network, dataset, config, progress or _no_progress)
    seconds = time.monotonic() - started
    train, val = (_score(network, frames) for frames in (dataset.train, dataset.val))
    summary = TrainingSummary(out, train, val, len(result.history), result.kept_epoch, result.interrupted, seconds)
    title = f"{out.name}: {len(dataset.train)} training, {len(dataset.val)} validation frames"
    attachments = {
        "curve.csv": curve_csv(result.history),
        "curve.png": curve_png(result.history, result.kept_epoch, title),
    }
    save_checkpoint(out, network, _card(config, dataset, summary), attachments)
    return summary


def _no_progress(record: EpochRecord, epochs: int) -> None:
    """Nobody looks."""


def _check_classes(dataset: Dataset) -> None:
    expected = tuple(motion.label for motion in MotionClass)
    if dataset.classes != expected:
        raise DatasetError(
            f"{dataset.folder}: its classes are {', '.join(dataset.classes)}, but a follow network answers "
            f"{', '.join(expected)}; build a data set of motions"
        )


def _fit(network: FollowNet, dataset: Dataset, config: FollowTrainingConfig, progress: Progress) -> LoopResult:
    batches = VariedBatches(
        dataset.train.ranges_m.astype(np.float32),
        dataset.train.labels,
        config.batch_size,
        config.augment,
        config.preprocess,
        config.seed,
    )
    resolved = resolve_codes(dataset.val.ranges_m.astype(np.float32), config.preprocess)
    validation = Batch(torch.from_numpy(resolved), torch.tensor(dataset.val.labels))
    return run_loop(
        network, batches, validation, config.loop, config.seed, lambda record: progress(record, config.loop.epochs)
    )


def _score(network: FollowNet, frames: FrameSet) -> Score:
    return score(logits_of(network, frames.ranges_m), frames.labels)


def _card(config: FollowTrainingConfig, dataset: Dataset, summary: TrainingSummary) -> ModelCard:
    training: dict[str, JsonValue] = config.model_dump(
        mode="json", exclude_none=True, exclude={"architecture", "preprocess"}
    )
    run: dict[str, JsonValue] = {
        "epochs": summary.epochs,
        "kept_epoch": summary.kept_epoch,
        "interrupted": summary.interrupted,
        "seconds": round(summary.seconds, 1),
    }
    return ModelCard(
        kind=FollowNet.kind,
        seed=config.seed,
        dataset=dataset.folder.name,
        dataset_hash=dataset.hash,
        architecture=config.architecture,
        preprocess=config.preprocess,
        training=training,
        metrics=run | summary.train.as_metrics("train") | summary.val.as_metrics("val"),
    )
