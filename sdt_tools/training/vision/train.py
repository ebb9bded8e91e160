"""Training the vision network: images in, a checkpoint out."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch

from sdt_tools.models.card import VisionCard
from sdt_tools.models.checkpoint_folder import reserve
from sdt_tools.models.vision.checkpoint import save_vision_checkpoint
from sdt_tools.models.vision.loaded import torch_logits
from sdt_tools.models.vision.net import VisionNet, draw_classifier, draw_vision_weights
from sdt_tools.models.vision.pretrained import load_pretrained
from sdt_tools.robustness.image_attacks import ImageAttackConfig, attack_images
from sdt_tools.training.curve import curve_csv
from sdt_tools.training.metrics import GestureScore, gesture_score
from sdt_tools.training.snapshot import SnapshotFile, unfinished
from sdt_tools.training.vision.config import VisionTrainingConfig
from sdt_tools.training.vision.curve import vision_curve_png
from sdt_tools.training.vision.data import ImageSet, VisionData
from sdt_tools.training.vision.loop import VisionEpoch, run_vision_loop

Progress = Callable[[VisionEpoch, int], None]
"""Called after each epoch with its record and the number of epochs."""


@dataclass(frozen=True, eq=False)
class VisionSummary:
    """What came out: scores of the last weights on images as they are, and on training images attacked by ``epsilon``.

    ``seconds`` are those of the training itself.
    """

    out: Path
    epsilon: int
    attacked_train: GestureScore
    train: GestureScore
    val: GestureScore
    epochs: int
    seconds: float


def train_vision(
    data: VisionData, config: VisionTrainingConfig, out: Path, progress: Progress | None = None
) -> VisionSummary:
    """Fine-tune on ``data`` and write the checkpoint ``out``, the learning curve in it (curve.csv, curve.png).

    Interrupted (KeyboardInterrupt), it leaves its state in ``unfinished(out)``, and the same call goes on from there to
    the same weights. Raises OutputExistsError, CheckpointError for pretrained weights that are missing or do not fit,
    ConfigError for a training of other settings that is unfinished at ``out``, and RunError when the training diverges.
    """
    reserve(out)
    started = time.monotonic()
    network = new_vision_net(config)
    report = progress or _no_progress
    settings = {"dataset": data.hash, **config.model_dump(mode="json")}
    snapshot = SnapshotFile(unfinished(out), settings, VisionEpoch)
    history = run_vision_loop(network, data, config, lambda record: report(record, config.epochs), snapshot)
    seconds = time.monotonic() - started
    epsilon = config.adversarial.epsilon
    train, val = (gesture_score(torch_logits(network, part.images_u8), part.labels) for part in (data.train, data.val))
    attacked = attacked_score(network, data.train, epsilon) if epsilon else train
    summary = VisionSummary(out, epsilon, attacked, train, val, len(history), seconds)
    title = f"{out.name}: ε = {epsilon}, {len(data.train)} training, {len(data.val)} validation images"
    attachments = {"curve.csv": curve_csv(history), "curve.png": vision_curve_png(history, title)}
    save_vision_checkpoint(out, network, _card(config, data, summary), attachments)
    snapshot.discard()
    return summary


def new_vision_net(config: VisionTrainingConfig) -> VisionNet:
    """The network before its training. Raises CheckpointError where ImageNet weights are missing or do not fit."""
    network = VisionNet(config.architecture, config.preprocess).eval()
    if config.pretrained:
        load_pretrained(network, config.weights)
        draw_classifier(network, config.seed)
    else:
        draw_vision_weights(network, config.seed)
    return network


def attacked_score(network: VisionNet, images: ImageSet, epsilon: int) -> GestureScore:
    """The answers to images attacked by the fast gradient sign, rounded to 8 bits: adversarial accuracy."""
    images_u8 = torch.from_numpy(images.images_u8).permute(0, 3, 1, 2)
    found = attack_images(network, images_u8, torch.from_numpy(images.labels), ImageAttackConfig(epsilon=epsilon))
    return gesture_score(found.logits.numpy(), images.labels)


def _no_progress(record: VisionEpoch, epochs: int) -> None:
    """Nobody looks."""


def _card(config: VisionTrainingConfig, data: VisionData, summary: VisionSummary) -> VisionCard:
    training = config.model_dump(mode="json", exclude_none=True, exclude={"architecture", "preprocess", "seed"})
    return VisionCard(
        kind=VisionNet.kind,
        seed=config.seed,
        dataset=data.name,
        dataset_hash=data.hash,
        architecture=config.architecture,
        preprocess=config.preprocess,
        training=training,
        metrics={
            "epochs": summary.epochs,
            "seconds": round(summary.seconds, 1),
            "epsilon": summary.epsilon,
            **summary.attacked_train.as_metrics("adversarial_train"),
            **summary.train.as_metrics("train"),
            **summary.val.as_metrics("val"),
        },
    )
