"""What a classifier gets right and wrong."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float, Int64
from pydantic import JsonValue

from sdt_tools.frames import FORWARD_CLASSES, Gesture, MotionClass

_FORWARD = sorted(int(motion) for motion in FORWARD_CLASSES)


@dataclass(frozen=True, eq=False)
class ClassScore:
    """Counts of frames: ``confusion[label, predicted]``, both in the order of ``classes``."""

    confusion: Int64[np.ndarray, "classes classes"]
    classes: ClassVar[type[MotionClass] | type[Gesture]]

    @property
    def frames(self) -> int:
        """How many frames were answered."""
        return int(self.confusion.sum())

    @property
    def accuracy(self) -> float:
        """Share of the frames answered with their label."""
        return _share(int(np.trace(self.confusion)), self.frames)

    @property
    def recall(self) -> Mapping[str, float]:
        """For each class, the share of its frames that are answered with it."""
        return {
            one.label: _share(int(self.confusion[one, one]), int(self.confusion[one].sum())) for one in self.classes
        }

    def as_metrics(self, prefix: str) -> dict[str, JsonValue]:
        """The numbers for a model card, their names beginning with ``prefix``; recalls without frames are left out."""
        recall = {label: round(share, 6) for label, share in self.recall.items() if not np.isnan(share)}
        return {
            f"{prefix}_frames": self.frames,
            f"{prefix}_accuracy": round(self.accuracy, 6),
            f"{prefix}_recall": dict(recall),
            f"{prefix}_confusion": self.confusion.tolist(),
        }


class Score(ClassScore):
    """The score of motions."""

    classes = MotionClass

    @property
    def forward_recall(self) -> float:
        """Share of the frames labelled with a forward class that are answered with any of the three."""
        rows = self.confusion[_FORWARD]
        return _share(int(rows[:, _FORWARD].sum()), int(rows.sum()))

    def as_metrics(self, prefix: str) -> dict[str, JsonValue]:
        """The numbers for a model card, their names beginning with ``prefix``; recalls without frames are left out."""
        metrics = super().as_metrics(prefix)
        if not np.isnan(self.forward_recall):
            metrics[f"{prefix}_forward_recall"] = round(self.forward_recall, 6)
        return metrics


class GestureScore(ClassScore):
    """The score of gestures."""

    classes = Gesture


def score(logits: Float[np.ndarray, "frames classes"], labels: Int64[np.ndarray, "frames"]) -> Score:
    """Compare the likeliest motions with the labels."""
    return Score(_confusion(logits, labels))


def gesture_score(logits: Float[np.ndarray, "frames classes"], labels: Int64[np.ndarray, "frames"]) -> GestureScore:
    """Compare the likeliest gestures with the labels."""
    return GestureScore(_confusion(logits, labels))


def _confusion(
    logits: Float[np.ndarray, "frames classes"], labels: Int64[np.ndarray, "frames"]
) -> Int64[np.ndarray, "classes classes"]:
    confusion = np.zeros((logits.shape[1], logits.shape[1]), np.int64)
    np.add.at(confusion, (labels, logits.argmax(axis=1)), 1)
    return confusion


def _share(part: int, whole: int) -> float:
    return part / whole if whole else float("nan")
