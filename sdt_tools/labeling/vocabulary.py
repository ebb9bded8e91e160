"""What can be labelled, by whose word, and where the journal of a recording lies."""

from enum import StrEnum
from pathlib import Path
from typing import Final

from sdt_tools.errors import LabelError
from sdt_tools.frames import Gesture, MotionClass


class LabelKind(StrEnum):
    """What is labelled: the motion for a scan, or the operator's gesture in an image."""

    MOTION = "motion"
    GESTURE = "gesture"

    @property
    def classes(self) -> tuple[str, ...]:
        """The label texts of this kind, in the order of the network's logits."""
        return _CLASSES[self]


class LabelSource(StrEnum):
    """Where a label comes from, most trusted first."""

    HUMAN = "human"
    IMPORT = "import"
    TRUTH = "truth"
    COMMAND = "command"
    MODEL = "model"


SETTLED_BY: Final = "settled:"
"""Begins the labeler of an act that settles what people disagree about; the name of the one who settled it follows."""

_CLASSES: dict[LabelKind, tuple[str, ...]] = {
    LabelKind.MOTION: tuple(motion.label for motion in MotionClass),
    LabelKind.GESTURE: tuple(gesture.label for gesture in Gesture),
}


def check_labeler(name: str) -> None:
    """Raises LabelError for a name that a journal cannot hold."""
    if not name.strip() or set(name) & set(',"\r\n#') or name.startswith(SETTLED_BY):
        raise LabelError(
            f"'{name}': cannot be a labeler's name; use one without commas, quotes, '#' and '{SETTLED_BY}'"
        )


def journal_path(labels_dir: Path, stem: str, kind: LabelKind) -> Path:
    """The journal of the recording whose file name is ``stem`` without its suffix."""
    return labels_dir / f"{stem}.{kind}.csv"


def journal_kind(path: Path) -> LabelKind:
    """The kind that a journal's name tells. Raises LabelError for another name."""
    for kind in LabelKind:
        if path.name.endswith(f".{kind}.csv"):
            return kind
    raise LabelError(f"{path}: not a journal's name; call it <recording>.motion.csv or <recording>.gesture.csv")
