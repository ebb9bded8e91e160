"""What a labeler should look at again, the most doubtful first."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import polars as pl
from jaxtyping import Bool, Int8, Int64

from sdt_tools.labeling.frame_labels import UNSAID, FrameLabels, Speaker, rows_of
from sdt_tools.labeling.vocabulary import LabelSource


class Doubt(IntEnum):
    """Why a frame should be looked at, the gravest first."""

    CONFLICT = 0
    SUSPECT = 1
    PRELABEL = 2


@dataclass(frozen=True)
class ReviewItem:
    """Frames ``first`` to ``last`` (inclusive) that are in doubt for one reason; ``score`` orders those of a kind."""

    doubt: Doubt
    first: int
    last: int
    score: float
    words: str
    """What speaks against what, as in ``anna: stay · ben: forward``."""

    @property
    def frames(self) -> int:
        """How many frames."""
        return self.last - self.first + 1


@dataclass(frozen=True)
class Suspect:
    """A label of frame ``row`` that is probably wrong, and what it should rather be."""

    row: int
    label: str
    suggested: str
    score: float


def suspects_in(labels: FrameLabels, table: pl.DataFrame) -> tuple[Suspect, ...]:
    """The suspects in ``table`` (see ``read_suspects``) that are frames, the most suspect first."""
    rows = rows_of(labels.stamps_ns, table["stamp_ns"].to_numpy()).tolist()
    found = zip(rows, table["label"], table["suggested"], table["score"], strict=True)
    return tuple(Suspect(*row) for row in found if row[0] >= 0)


def is_open(suspect: Suspect, labels: FrameLabels) -> bool:
    """Whether the suspect label still stands: it goes when somebody labels the frame otherwise."""
    number = int(labels.resolved[suspect.row])
    return number == UNSAID or labels.kind.classes[number] == suspect.label


def review_queue(
    labels: FrameLabels, prelabels: Int8[np.ndarray, "frames"], suspects: tuple[Suspect, ...]
) -> tuple[ReviewItem, ...]:
    """All that is in doubt; neighbouring frames of one kind are one item.

    Conflicts between people by how evenly they are split and how long it lasts, then suspects by their score, then
    people against the pre-labels, the longest first.
    """
    items = [_conflict(labels, first, last) for first, last in _stretches(labels.disputed, _words(labels))]
    items += [
        ReviewItem(Doubt.SUSPECT, one.row, one.row, one.score, f"{one.label}, rather {one.suggested}")
        for one in suspects
        if is_open(one, labels)
    ]
    against = contradicting(labels, prelabels)
    pairs = np.where(against, labels.human.astype(np.int64) * 100 + prelabels, -1)
    for first, last in _stretches(against, pairs):
        said, pre = (labels.kind.classes[int(of[first])] for of in (labels.human, prelabels))
        items.append(ReviewItem(Doubt.PRELABEL, first, last, float(last - first + 1), f"{said}, pre-label {pre}"))
    return tuple(sorted(items, key=lambda item: (item.doubt, -item.score, item.first)))


def contradicting(labels: FrameLabels, prelabels: Int8[np.ndarray, "frames"]) -> Bool[np.ndarray, "frames"]:
    """Where people say something else than the pre-labels."""
    both = (labels.human != UNSAID) & (prelabels != UNSAID)
    against: Bool[np.ndarray, "frames"] = both & (labels.human != prelabels)
    return against


def _conflict(labels: FrameLabels, first: int, last: int) -> ReviewItem:
    said = {name: int(labels.voice(Speaker(LabelSource.HUMAN, name)).classes[first]) for name in labels.labelers}
    said = {name: number for name, number in said.items() if number != UNSAID}
    shares = np.bincount(list(said.values())) / len(said)
    split = 1.0 - float(shares.max())
    words = " · ".join(f"{name}: {labels.kind.classes[number]}" for name, number in said.items())
    return ReviewItem(Doubt.CONFLICT, first, last, split * 1e9 + last - first + 1, words)


def _words(labels: FrameLabels) -> Int64[np.ndarray, "frames"]:
    """A number a frame that differs where what people say differs."""
    base = len(labels.kind.classes) + 1
    number = np.zeros(len(labels), np.int64)
    for name in labels.labelers:
        classes = labels.voice(Speaker(LabelSource.HUMAN, name)).classes.astype(np.int64)
        number = np.unique(number * base + classes + 1, return_inverse=True)[1].astype(np.int64)
    return number


def _stretches(chosen: Bool[np.ndarray, "frames"], words: Int64[np.ndarray, "frames"]) -> list[tuple[int, int]]:
    """First and last frame of each run of chosen frames with equal ``words``."""
    rows = np.flatnonzero(chosen)
    if not len(rows):
        return []
    breaks = np.flatnonzero((np.diff(rows) > 1) | (words[rows[1:]] != words[rows[:-1]])) + 1
    return [(int(part[0]), int(part[-1])) for part in np.split(rows, breaks)]
