"""What claims are judged on: networks with their cards, and their answers to the same frames."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.claims.options import ClaimOptions, LossName
from sdt_tools.error_analysis.labelled import LabelledFrames, frames_of
from sdt_tools.error_analysis.resampling import draw_units, sum_by_unit
from sdt_tools.error_analysis.side_by_side import KEYS, SideBySide
from sdt_tools.errors import UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.models.card import VisionCard
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.models.checkpoint_folder import VISION_KIND, kind_in, read_card
from sdt_tools.replay.predictions import scan_predictions
from sdt_tools.robustness.domains import NOT_FORWARD

_CURVE: Final = "curve.csv"
_CLASSES: Final = tuple(motion.label for motion in MotionClass)


@dataclass(frozen=True)
class Network:
    """What a checkpoint says of its training; None where it does not.

    ``level`` is the safety level it was held to, 0 for none, None for domains of another kind; ``adversarial`` where
    those were balls around the training samples, or a vision network was trained against attacks.
    ``delta`` is the δ asked for and ``bound`` the largest worst-case loss of a domain at the end; ``train_loss`` the
    cross-entropy on the training data at the end, in nats.
    """

    name: str
    kind: str
    level: int | None
    adversarial: bool
    seed: int
    folder: Path
    delta: float | None
    bound: float | None
    train_loss: float | None


@dataclass(frozen=True, eq=False)
class Material:
    """Networks (in the order of ``frames.models``) and the frames that all of them have answered.

    ``draws`` are the resamples of recordings that all intervals share.
    """

    networks: tuple[Network, ...]
    frames: SideBySide
    draws: Int64[np.ndarray, "recordings draws"]

    @property
    def levels(self) -> tuple[int, ...]:
        """The safety levels at hand, 0 among them where there are networks without domains."""
        return tuple(sorted({network.level for network in self.networks if network.level is not None}))

    @property
    def certified_levels(self) -> tuple[int, ...]:
        """The levels of networks that were held to domains."""
        return tuple(level for level in self.levels if level > 0)

    def places(self, level: int) -> list[int]:
        """Where the networks of a level stand."""
        return [place for place, network in enumerate(self.networks) if network.level == level]

    def mean_loss(self, level: int, loss: LossName) -> Float64[np.ndarray, "frames"]:
        """Each frame's loss, averaged over the networks of a level."""
        losses = self.frames.loss_ce if loss == "cross_entropy" else self.frames.wrong
        mean: Float64[np.ndarray, "frames"] = losses[self.places(level)].mean(axis=0, dtype=np.float64)
        return mean

    def inside(self, level: int) -> Bool[np.ndarray, "frames"]:
        """The frames in some domain of a level."""
        inside: Bool[np.ndarray, "frames"] = self.frames.column(f"in_level_{level}").astype(bool)
        return inside

    def distance_m(self, level: int) -> Float64[np.ndarray, "frames"]:
        """Distance of each frame to the nearest domain of a level."""
        name = "domain_distance_m" if level == 4 else f"distance_level_{level}_m"
        return self.frames.column(name).astype(np.float64)

    def sums(self, values: Float64[np.ndarray, "*kinds frames"]) -> Float64[np.ndarray, "*kinds recordings"]:
        """What each recording adds to totals."""
        return sum_by_unit(values, self.frames.recording, self.frames.recordings)

    def frames_with(self, where: Bool[np.ndarray, "frames"]) -> tuple[int, int]:
        """How many frames that is, and of how many recordings."""
        return int(where.sum()), int(np.unique(self.frames.recording[where]).size)

    def labelled(self, place: int, options: ClaimOptions) -> LabelledFrames:
        """The frames under one network, as tags and conditions take them."""
        name = self.networks[place].name
        return self._labelled(name, self.frames.wrong[place], self.frames.loss_ce[place], options)

    def labelled_level(self, level: int, options: ClaimOptions) -> LabelledFrames:
        """The frames under a level's networks: their mean losses, so that a frame is wrong where most of them are."""
        mean_01, mean_ce = self.mean_loss(level, "zero_one"), self.mean_loss(level, "cross_entropy")
        return self._labelled(f"level {level}", mean_01, mean_ce, options)

    def _labelled(self, name: str, loss_01: np.ndarray, loss_ce: np.ndarray, options: ClaimOptions) -> LabelledFrames:
        losses = {"loss_01": loss_01.astype(np.float32), "loss_ce": loss_ce.astype(np.float32)}
        return frames_of(
            self.frames.table.with_columns(**{key: pl.Series(loss) for key, loss in losses.items()}),
            options.errors,
            name,
        )


def gather(networks: Sequence[Network], frames: SideBySide, options: ClaimOptions) -> Material:
    """Networks in the order of the frames' models. Raises UsageError for models without a network."""
    by_name = {network.name: network for network in networks}
    missing = [name for name in frames.models if name not in by_name]
    if missing:
        raise UsageError(f"predictions of {', '.join(missing)}, but no such checkpoint; add it with --model")
    draws = draw_units(frames.recordings, options.resamples, options.seed)
    return Material(tuple(by_name[name] for name in frames.models), frames, draws)


def read_network(folder: Path) -> Network:
    """What the checkpoint in ``folder`` says of itself, of a follow or a vision network. Raises CheckpointError."""
    if kind_in(folder) == VISION_KIND:
        return _read_vision_network(folder)
    card = load_checkpoint(folder).card
    safety = card.training.get("safety")
    level = int(_number(card.training.get("level")) or 0)
    adversarial = card.training.get("epsilon_m") is not None
    other = adversarial or card.training.get("domains") is not None
    curve = folder / _CURVE
    return Network(
        name=folder.resolve().name,
        kind=card.kind,
        level=None if other else level,
        adversarial=adversarial,
        seed=card.seed,
        folder=folder,
        delta=_number(safety.get("delta")) if isinstance(safety, dict) and (level or other) else None,
        bound=_number(card.metrics.get("bound")),
        train_loss=_last_train_loss(curve) if curve.is_file() else None,
    )


def _read_vision_network(folder: Path) -> Network:
    card = read_card(folder, VisionCard, (VISION_KIND,))
    attacked = card.training.get("adversarial")
    curve = folder / _CURVE
    return Network(
        name=folder.resolve().name,
        kind=card.kind,
        level=None,
        adversarial=isinstance(attacked, dict) and (_number(attacked.get("epsilon")) or 0.0) > 0.0,
        seed=card.seed,
        folder=folder,
        delta=None,
        bound=None,
        train_loss=_last_train_loss(curve) if curve.is_file() else None,
    )


def allowed_loss(paths: Sequence[Path], model: str, frames: SideBySide, level: int) -> Float64[np.ndarray, "inside"]:
    """-log of the probability mass of the classes that a level allows, for the frames inside its domains."""
    keys = frames.table.filter(pl.col(f"in_level_{level}")).select(KEYS)
    rows = scan_predictions(paths).filter((pl.col("model") == model) & pl.col(f"in_level_{level}"))
    logits = keys.join(rows.select(*KEYS, "logits").collect(), on=KEYS, how="left")["logits"].to_list()
    values = np.array(logits, dtype=np.float64).reshape(-1, len(_CLASSES))
    kept = values[:, sorted(NOT_FORWARD)]
    loss: Float64[np.ndarray, "inside"] = np.logaddexp.reduce(values, axis=1) - np.logaddexp.reduce(kept, axis=1)
    return loss


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _last_train_loss(curve: Path) -> float | None:
    with curve.open(encoding="utf-8") as stream:
        losses = [row.get("train_loss") for row in csv.DictReader(stream)]
    try:
        return float(losses[-1]) if losses and losses[-1] else None
    except ValueError:
        return None
