"""What a classifier of motions gets right and wrong."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64
from pydantic import JsonValue

from sdt_tools.frames import FORWARD_CLASSES, MotionClass

_FORWARD = sorted(int(motion) for motion in FORWARD_CLASSES)


@dataclass(frozen=True, eq=False)
class Score:
    """Counts of frames: ``confusion[label, predicted]``, both in the order of ``MotionClass``."""

    confusion: Int64[np.ndarray, "classes classes"]

    @property
    def frames(self) -> int:
        """How many frames were answered."""
        return int(self.confusion.sum())

    @property
    def accuracy(self) -> float:
        """Share of the frames answered with their label."""
        return _share(int(np.trace(self.confusion)), self.frames)

    @property
    def forward_recall(self) -> float:
        """Share of the frames labelled with a forward class that are answered with any of the three."""
        rows = self.confusion[_FORWARD]
        return _share(int(rows[:, _FORWARD].sum()), int(rows.sum()))

    @property
    def recall(self) -> Mapping[str, float]:
        """For each class, the share of its frames that are answered with it."""
        return {
            motion.label: _share(int(self.confusion[motion, motion]), int(self.confusion[motion].sum()))
            for motion in MotionClass
        }

    def as_metrics(self, prefix: str) -> dict[str, JsonValue]:
        """The numbers for a model card, their names beginning with ``prefix``; recalls without frames are left out."""
        recall = {label: round(share, 6) for label, share in self.recall.items() if not np.isnan(share)}
        metrics: dict[str, JsonValue] = {
            f"{prefix}_frames": self.frames,
            f"{prefix}_accuracy": round(self.accuracy, 6),
            f"{prefix}_recall": dict(recall),
            f"{prefix}_confusion": self.confusion.tolist(),
        }
        if not np.isnan(self.forward_recall):
            metrics[f"{prefix}_forward_recall"] = round(self.forward_recall, 6)
        return metrics


def score(logits: Float[np.ndarray, "frames classes"], labels: Int64[np.ndarray, "frames"]) -> Score:
    """Compare the likeliest classes with the labels."""
    confusion = np.zeros((len(MotionClass), len(MotionClass)), np.int64)
    np.add.at(confusion, (labels, logits.argmax(axis=1)), 1)
    return Score(confusion)


def _share(part: int, whole: int) -> float:
    return part / whole if whole else float("nan")
