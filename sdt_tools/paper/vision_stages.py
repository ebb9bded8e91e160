"""The stages that train a vision network and attack it, and what pixels alone would tell."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from sdt_tools.dataset.load import PictureSet, load_gestures
from sdt_tools.evaluation.attack_vision import attack_vision
from sdt_tools.models.vision.checkpoint import load_vision_checkpoint
from sdt_tools.models.vision.pictures import decode_picture
from sdt_tools.paper.stage_folders import DATASET, write_note
from sdt_tools.robustness.image_attacks import ImageAttackConfig
from sdt_tools.robustness.image_figure import attacked_image_figure
from sdt_tools.training.vision.config import VisionTrainingConfig
from sdt_tools.training.vision.data import load_vision_data
from sdt_tools.training.vision.train import train_vision

ATTACK: Final = "attack"
ATTACK_FIGURE: Final = "attack.png"
_SIDE: Final = 32
"""Images are shrunk to so many pixels a side for the baseline."""


def train_vision_stage(out: Path, dataset: Path, config: VisionTrainingConfig, name: str, kept: Path) -> None:
    """Train one network, the checkpoint called ``name``, and note how it came out.

    ``kept`` holds the state of an interrupted training, which goes on from there.
    """
    data = load_vision_data(dataset / DATASET, config.preprocess)
    kept.mkdir(exist_ok=True)
    summary = train_vision(data, config, kept / name)
    (kept / name).rename(out / name)
    write_note(
        out,
        {
            "epsilon": summary.epsilon,
            "adversarial_train_accuracy": summary.attacked_train.accuracy,
            "train_accuracy": summary.train.accuracy,
            "val_accuracy": summary.val.accuracy,
            "val_recall": dict(summary.val.recall),
            "val_images": summary.val.frames,
            "epochs": summary.epochs,
            "seconds": summary.seconds,
        },
    )


def attack_stage(
    out: Path, model: Path, dataset: Path, epsilons: Sequence[int], config: ImageAttackConfig, images: int
) -> None:
    """Attack a network on validation images, and draw the attack that tells it best."""
    loaded = load_vision_checkpoint(model)
    val = load_vision_data(dataset / DATASET, loaded.card.preprocess).val
    summary, exhibit = attack_vision(loaded, val.images_u8, val.labels, epsilons, config, images, out / ATTACK)
    attacked_image_figure(
        exhibit.original_u8, exhibit.attacked_u8, exhibit.logits, exhibit.epsilon, exhibit.title, out / ATTACK_FIGURE
    )
    write_note(out, {**asdict(summary), "exhibit": exhibit.title, "exhibit_succeeded": exhibit.succeeded})


def baseline_stage(out: Path, dataset: Path) -> None:
    """Logistic regression on images of 32×32 pixels: what colours in places tell, without any idea of a person."""
    from sklearn.linear_model import LogisticRegression

    data = load_gestures(dataset / DATASET)
    fitted = LogisticRegression(max_iter=300, C=0.01).fit(_pixels(data.train), data.train.labels)
    write_note(
        out,
        {
            "train_accuracy": float(fitted.score(_pixels(data.train), data.train.labels)),
            "val_accuracy": float(fitted.score(_pixels(data.val), data.val.labels)),
        },
    )


def _pixels(pictures: PictureSet) -> Float64[np.ndarray, "images pixels"]:
    return np.stack([_shrunk(decode_picture(data)).ravel() / 255.0 for data in pictures.pictures])


def _shrunk(picture_u8: UInt8[np.ndarray, "rows columns *colours"]) -> UInt8[np.ndarray, "32 32 *colours"]:
    return cv2.resize(picture_u8, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA).astype(np.uint8)
