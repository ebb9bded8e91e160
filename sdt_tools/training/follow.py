"""Training the follow network: a data set in, a checkpoint out."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from jaxtyping import Float32
from pydantic import Field, JsonValue

from sdt_tools.config import Config
from sdt_tools.dataset.load import Dataset, FrameSet, load_dataset
from sdt_tools.errors import DatasetError
from sdt_tools.frames import MotionClass
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.checkpoint_folder import reserve
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.gated_net import GateConfig, GatedFollowNet, GatedNetConfig, new_gated_net
from sdt_tools.models.loaded import logits_of
from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes
from sdt_tools.training.augment import AugmentConfig, VariedBatches
from sdt_tools.training.curve import curve_csv, curve_png
from sdt_tools.training.loop import Batch, LoopConfig, LoopResult, run_loop
from sdt_tools.training.metrics import Score, score
from sdt_tools.training.record import EpochRecord
from sdt_tools.training.safety import SafetyConfig, SafetyDomains
from sdt_tools.training.snapshot import SnapshotFile, unfinished
from sdt_tools.training.specification import SpecificationConfig, specification

Progress = Callable[[EpochRecord, int], None]
"""Called after each epoch with its record and the number of planned epochs."""


class FollowTrainingConfig(Config):
    """All that shapes a follow network beside its data. ``architecture`` is that of the trunk where there is a gate."""

    seed: int = Field(default=0, ge=0)
    batch_size: int = Field(default=64, ge=1)
    arch: Literal["plain", "gate"] = "plain"
    specification: SpecificationConfig = SpecificationConfig()
    architecture: FollowNetConfig = FollowNetConfig()
    gate: GateConfig = GateConfig()
    preprocess: PreprocessConfig = PreprocessConfig()
    augment: AugmentConfig = AugmentConfig()
    safety: SafetyConfig = SafetyConfig()
    loop: LoopConfig = LoopConfig()


@dataclass(frozen=True, eq=False)
class TrainingSummary:
    """What came out. ``satisfied``: whether the safety bound came down to δ; None without domains.

    ``last`` is the record of the last epoch, whose weights stand.
    """

    out: Path
    train: Score
    val: Score
    last: EpochRecord
    satisfied: bool | None
    seconds: float


def train_follow(
    dataset_dir: Path, config: FollowTrainingConfig, out: Path, progress: Progress | None = None
) -> TrainingSummary:
    """Train on a motion data set and write the checkpoint ``out``, the learning curve in it (curve.csv, curve.png).

    Interrupted (KeyboardInterrupt), it leaves its state in ``unfinished(out)``, and the same call goes on from there to
    the same weights. A network whose safety bound stays above δ is written all the same; the summary says so.
    Raises OutputExistsError, DatasetError for a data set that is missing, damaged or not of motions, ConfigError for
    domains that are wrong or a training of other settings that is unfinished at ``out``, and RunError when the training
    diverges.
    """
    reserve(out)
    dataset = load_dataset(dataset_dir)
    _check_classes(dataset)
    started = time.monotonic()
    network = _new_network(config)
    settings = {"dataset": dataset.hash, **config.model_dump(mode="json")}
    snapshot = SnapshotFile(unfinished(out), settings, EpochRecord)
    result = _fit(network, dataset, config, progress or _no_progress, snapshot)
    seconds = time.monotonic() - started
    train, val = (_score(network, frames) for frames in (dataset.train, dataset.val))
    summary = TrainingSummary(out, train, val, result.history[-1], result.satisfied, seconds)
    title = f"{out.name}: {len(dataset.train)} training, {len(dataset.val)} validation frames"
    attachments = {"curve.csv": curve_csv(result.history), "curve.png": curve_png(result.history, title)}
    save_checkpoint(out, network, _card(config, dataset, summary), attachments)
    snapshot.discard()
    return summary


def _new_network(config: FollowTrainingConfig) -> FollowNet:
    if config.arch == "gate":
        return new_gated_net(
            GatedNetConfig(trunk=config.architecture, gate=config.gate), config.preprocess, config.seed
        )
    return new_follow_net(config.architecture, config.preprocess, config.seed)


def _no_progress(record: EpochRecord, epochs: int) -> None:
    """Nobody looks."""


def _check_classes(dataset: Dataset) -> None:
    expected = tuple(motion.label for motion in MotionClass)
    if dataset.classes != expected:
        raise DatasetError(
            f"{dataset.folder}: its classes are {', '.join(dataset.classes)}, but a follow network answers "
            f"{', '.join(expected)}; build a data set of motions"
        )


def _fit(
    network: FollowNet,
    dataset: Dataset,
    config: FollowTrainingConfig,
    progress: Progress,
    snapshot: SnapshotFile[EpochRecord],
) -> LoopResult:
    ranges_m, labels = dataset.train.ranges_m.astype(np.float32), dataset.train.labels
    batches = VariedBatches(ranges_m, labels, config.batch_size, config.augment, config.preprocess, config.seed)
    validation = Batch(torch.from_numpy(_resolved(dataset.val, config)), torch.tensor(dataset.val.labels))
    safety = None
    if not config.specification.empty:
        parts = specification(config.specification, _resolved(dataset.train, config), labels)
        safety = SafetyDomains(parts, network, config.safety, config.seed)
    return run_loop(
        network,
        batches,
        validation,
        config.loop,
        config.seed,
        lambda record: progress(record, config.loop.epochs),
        safety,
        snapshot,
    )


def _resolved(frames: FrameSet, config: FollowTrainingConfig) -> Float32[np.ndarray, "frames rays"]:
    return resolve_codes(frames.ranges_m.astype(np.float32), config.preprocess)


def _score(network: FollowNet, frames: FrameSet) -> Score:
    return score(logits_of(network, frames.ranges_m), frames.labels)


def _card(config: FollowTrainingConfig, dataset: Dataset, summary: TrainingSummary) -> ModelCard:
    training: dict[str, JsonValue] = config.model_dump(
        mode="json", exclude_none=True, exclude={"architecture", "gate", "preprocess", "specification"}
    )
    training |= config.specification.model_dump(mode="json", exclude_none=True)
    run: dict[str, JsonValue] = {"epochs": summary.last.epoch, "seconds": round(summary.seconds, 1)}
    if summary.satisfied is not None:
        run |= {
            "satisfied": summary.satisfied,
            "bound": summary.last.bound,
            "certified_share": summary.last.certified_share,
            "worst_margin": summary.last.worst_margin,
        }
    gated = GatedNetConfig(trunk=config.architecture, gate=config.gate)
    return ModelCard(
        kind=GatedFollowNet.kind if config.arch == "gate" else FollowNet.kind,
        seed=config.seed,
        dataset=dataset.folder.name,
        dataset_hash=dataset.hash,
        architecture=gated if config.arch == "gate" else config.architecture,
        preprocess=config.preprocess,
        training=training,
        metrics=run | summary.train.as_metrics("train") | summary.val.as_metrics("val"),
    )
