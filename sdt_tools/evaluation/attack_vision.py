"""An attack on a vision network, whole: how often it succeeds, and the picture that tells it best."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
import torch
from jaxtyping import Bool, Float32, Int64, UInt8
from torch import Tensor

from sdt_tools.errors import DatasetError, OutputExistsError
from sdt_tools.frames import Gesture
from sdt_tools.models.vision.loaded import LoadedVisionModel
from sdt_tools.robustness.image_attacks import ImageAttackConfig, ImageAttackResult, Method, attack_images
from sdt_tools.statistics import wilson

IMAGES_FILE: Final = "images.parquet"
SUMMARY_FILE: Final = "attack.json"
_METHODS: Final[tuple[Method, ...]] = ("fgsm", "pgd")

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class AttackRate:
    """How many of the images that were answered rightly an attack turned.

    With a ``target``, images of another gesture (``source``) turned into it; without, into anything else.
    """

    method: str
    epsilon: int
    source: str
    target: str
    images: int
    succeeded: int
    wilson: tuple[float, float]


@dataclass(frozen=True, eq=False)
class ImageExhibit:
    """The attack to be shown: an image, what was made of it, and the logits of both."""

    original_u8: UInt8[np.ndarray, "height width 3"]
    attacked_u8: UInt8[np.ndarray, "height width 3"]
    logits: tuple[Float32[np.ndarray, "3"], Float32[np.ndarray, "3"]]
    epsilon: int
    succeeded: bool
    title: str


@dataclass(frozen=True)
class VisionAttackSummary:
    """Images that were drawn, those answered rightly, and what became of these."""

    model: str
    images: int
    answered_rightly: int
    rates: tuple[AttackRate, ...]


def attack_vision(
    model: LoadedVisionModel,
    images_u8: UInt8[np.ndarray, "images height width 3"],
    labels: Int64[np.ndarray, "images"],
    epsilons: Sequence[int],
    config: ImageAttackConfig,
    count: int,
    out: Path,
    progress: Progress | None = None,
) -> tuple[VisionAttackSummary, ImageExhibit]:
    """Attack ``count`` of the images, as many of each gesture, by both methods at every ε; write it to ``out``.

    Of ``config`` count the steps, restarts and seed. Shown is a disable image that is answered rightly, if there is
    one. Raises OutputExistsError, and DatasetError where there is no image of disable at all.
    """
    if out.exists():
        raise OutputExistsError(out)
    chosen = _chosen(labels, count, config.seed)
    right = chosen[model.predict_logits(images_u8[chosen]).argmax(axis=1) == labels[chosen]]
    disabling = chosen[labels[chosen] == Gesture.DISABLE]
    if not len(disabling):
        raise DatasetError("no image of disable among the validation images, so that none can be turned into enable")
    counted = disabling[np.isin(disabling, right)]
    disabling = counted if len(counted) else disabling
    report = progress or _no_progress
    rates: list[AttackRate] = []
    tables: list[pl.DataFrame] = []
    tasks = [(method, epsilon, aim) for epsilon in epsilons for method in _METHODS for aim in (None, Gesture.ENABLE)]
    exhibit: ImageExhibit | None = None
    for done, (method, epsilon, aim) in enumerate(tasks):
        report(done, len(tasks))
        places = right if aim is None else disabling
        if not len(places):
            rates.append(_rate(method, epsilon, aim, np.zeros(0, np.bool_)))
            continue
        asked = config.model_copy(update={"method": method, "epsilon": epsilon})
        found = attack_images(model.network, _tensor(images_u8[places]), torch.from_numpy(labels[places]), asked, aim)
        rates.append(_rate(method, epsilon, aim, found.succeeded.numpy()[np.isin(places, right)]))
        tables.append(_table(method, epsilon, aim, places, labels, found))
        if aim is not None and method == "pgd":  # of the larger ε, which comes last, is shown
            exhibit = _exhibit(model, images_u8[places], found, epsilon)
    assert exhibit is not None
    report(len(tasks), len(tasks))
    summary = VisionAttackSummary(model.name, len(chosen), len(right), tuple(rates))
    out.mkdir(parents=True)
    pl.concat(tables).write_parquet(out / IMAGES_FILE)
    settings = {"attack": config.model_dump(exclude={"method", "epsilon"}), "epsilons": list(epsilons)}
    (out / SUMMARY_FILE).write_text(json.dumps(asdict(summary) | settings, indent=2) + "\n", encoding="utf-8")
    return summary, exhibit


def _no_progress(done: int, total: int) -> None:
    """Nobody looks."""


def _chosen(labels: Int64[np.ndarray, "images"], count: int, seed: int) -> Int64[np.ndarray, "chosen"]:
    """As many images of each gesture, by chance."""
    rng = np.random.default_rng(seed)
    each = -(-count // len(Gesture))
    drawn = [rng.permutation(np.flatnonzero(labels == gesture))[:each] for gesture in Gesture]
    return np.sort(np.concatenate(drawn))


def _tensor(images_u8: UInt8[np.ndarray, "images height width 3"]) -> UInt8[Tensor, "images 3 height width"]:
    return torch.from_numpy(images_u8).permute(0, 3, 1, 2)


def _rate(method: Method, epsilon: int, aim: Gesture | None, turned: Bool[np.ndarray, "images"]) -> AttackRate:
    images, succeeded = len(turned), int(turned.sum())
    source, target = ("any", "any other") if aim is None else (Gesture.DISABLE.label, aim.label)
    return AttackRate(method, epsilon, source, target, images, succeeded, wilson(succeeded, images))


def _table(
    method: Method,
    epsilon: int,
    aim: Gesture | None,
    places: Int64[np.ndarray, "attacked"],
    labels: Int64[np.ndarray, "images"],
    found: ImageAttackResult,
) -> pl.DataFrame:
    return pl.DataFrame(
        {
            "method": [method] * len(places),
            "epsilon": [epsilon] * len(places),
            "target": ["" if aim is None else aim.label] * len(places),
            "image": places,
            "label": [Gesture(int(label)).label for label in labels[places]],
            "answer": [Gesture(int(answer)).label for answer in found.logits.argmax(1)],
            "succeeded": found.succeeded.numpy(),
            "logits": found.logits.tolist(),
        }
    )


def _exhibit(
    model: LoadedVisionModel,
    originals_u8: UInt8[np.ndarray, "images height width 3"],
    found: ImageAttackResult,
    epsilon: int,
) -> ImageExhibit:
    """The image whose answer moved farthest: surely disable before, surely enable after."""
    before, after = model.predict_logits(originals_u8), found.logits.numpy()
    best = int(np.argmax(_margin(after, Gesture.ENABLE) + np.minimum(_margin(before, Gesture.DISABLE), 2.0)))
    attacked_u8 = np.ascontiguousarray(found.images_u8[best].permute(1, 2, 0).numpy())
    answer = Gesture(int(model.predict_logits(attacked_u8[None])[0].argmax()))
    succeeded = answer is Gesture.ENABLE
    told = f"answered with {answer.label}" if succeeded else f"answered with {answer.label}: the attack failed"
    title = f"{model.name}: disable, moved by at most ±{epsilon} steps of 8-bit colour, is {told}"
    return ImageExhibit(originals_u8[best], attacked_u8, (before[best], after[best]), epsilon, succeeded, title)


def _margin(logits: Float32[np.ndarray, "images 3"], gesture: Gesture) -> Float32[np.ndarray, "images"]:
    others = np.delete(logits, int(gesture), axis=1).max(axis=1)
    margin: Float32[np.ndarray, "images"] = logits[:, gesture] - others
    return margin
