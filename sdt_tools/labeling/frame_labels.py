"""What everybody has said of each frame of a recording, as arrays: one class number a frame and voice.

The same rules as ``resolve``, kept up to date act by act, in microseconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Bool, Int8, Int64

from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelKind, LabelSource

UNSAID: Final = -1
"""The number of no class: nobody has said anything, or it is withdrawn."""

PRELABELS: Final = (LabelSource.IMPORT, LabelSource.TRUTH, LabelSource.COMMAND, LabelSource.MODEL)
"""Sources that are no person, most trusted first."""


@dataclass(frozen=True)
class Speaker:
    """Whose word it is."""

    source: LabelSource
    labeler: str

    @property
    def settles(self) -> bool:
        """Whether it is the word that settles what people disagree about."""
        return self.source is LabelSource.HUMAN and self.labeler.startswith(SETTLED_BY)

    @property
    def is_labeler(self) -> bool:
        """Whether it is a person who labels."""
        return self.source is LabelSource.HUMAN and not self.settles


@dataclass(frozen=True, eq=False)
class Voice:
    """What one speaker says of each frame, and in which act; UNSAID where nothing stands."""

    classes: Int8[np.ndarray, "frames"]
    acts: Int64[np.ndarray, "frames"]

    def saying(
        self, rows: Int64[np.ndarray, "chosen"], classes: Int8[np.ndarray, "chosen"], acts: Int64[np.ndarray, "chosen"]
    ) -> "Voice":
        """The same after more words about frames ``rows``; of several about one frame the last stands."""
        said, when = self.classes.copy(), self.acts.copy()
        said[rows], when[rows] = classes, acts
        return Voice(said, when)


@dataclass(frozen=True, eq=False)
class FrameLabels:
    """The labels of the frames taken at ``stamps_ns``, by speaker. ``strangers`` acts are about no frame of these."""

    kind: LabelKind
    stamps_ns: Int64[np.ndarray, "frames"]
    voices: Mapping[Speaker, Voice]
    strangers: int = 0

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def heard(self, acts: pl.DataFrame) -> "FrameLabels":
        """The same after ``acts`` (columns as in a journal, in order)."""
        stamps_ns = acts["stamp_ns"].to_numpy()
        rows = rows_of(self.stamps_ns, stamps_ns)
        known = acts.with_columns(
            pl.Series("row", rows), class_numbers(acts["label"], self.kind).alias("class")
        ).filter(pl.col("row") >= 0)
        voices = dict(self.voices)
        for (source, labeler), said in known.group_by("source", "labeler", maintain_order=True):
            speaker = Speaker(LabelSource(str(source)), str(labeler))
            last = said.unique("row", keep="last", maintain_order=True)
            voices[speaker] = self.voice(speaker).saying(
                last["row"].to_numpy(), last["class"].to_numpy(), last["act_id"].to_numpy()
            )
        return replace(self, voices=voices, strangers=self.strangers + len(acts) - len(known))

    def voice(self, speaker: Speaker) -> Voice:
        """What ``speaker`` says."""
        silent = Voice(np.full(len(self), UNSAID, np.int8), np.zeros(len(self), np.int64))
        return self.voices.get(speaker, silent)

    @cached_property
    def labelers(self) -> tuple[str, ...]:
        """The people who have labelled, in order of their names."""
        return tuple(sorted(speaker.labeler for speaker in self.voices if speaker.is_labeler))

    @cached_property
    def settled(self) -> Int8[np.ndarray, "frames"]:
        """What was settled."""
        return self._latest([voice for speaker, voice in self.voices.items() if speaker.settles])

    @cached_property
    def disputed(self) -> Bool[np.ndarray, "frames"]:
        """Where people disagree, and nobody has settled it."""
        open_: Bool[np.ndarray, "frames"] = self.differing & (self.settled == UNSAID)
        return open_

    @cached_property
    def differing(self) -> Bool[np.ndarray, "frames"]:
        """Where people have said different things, settled or not."""
        low, high = self._range
        differing: Bool[np.ndarray, "frames"] = (high != UNSAID) & (low != high)
        return differing

    @cached_property
    def human(self) -> Int8[np.ndarray, "frames"]:
        """What people say: settled, or of one mind."""
        _, high = self._range
        agreed = np.where(self.disputed, np.int8(UNSAID), high)
        return np.where(self.settled != UNSAID, self.settled, agreed)

    @cached_property
    def prelabels(self) -> Int8[np.ndarray, "frames"]:
        """What the most trusted source says that is no person; among equals the latest."""
        found = np.full(len(self), UNSAID, np.int8)
        for source in PRELABELS:
            voice = self._latest([voice for speaker, voice in self.voices.items() if speaker.source is source])
            found = np.where(found == UNSAID, voice, found)
        return found

    @cached_property
    def resolved(self) -> Int8[np.ndarray, "frames"]:
        """The label of each frame, as ``resolve`` has it."""
        found = np.where(self.human == UNSAID, self.prelabels, self.human)
        return np.where(self.disputed, np.int8(UNSAID), found)

    def counts(self, classes: Int8[np.ndarray, "frames"]) -> tuple[int, ...]:
        """How many frames have each class, in the order of ``kind.classes``."""
        return tuple(np.bincount(classes[classes >= 0], minlength=len(self.kind.classes)).tolist())

    @cached_property
    def _range(self) -> tuple[Int8[np.ndarray, "frames"], Int8[np.ndarray, "frames"]]:
        """The lowest and the highest class number that people have said."""
        silent = np.full(len(self), UNSAID, np.int8)
        said = [voice.classes for speaker, voice in self.voices.items() if speaker.is_labeler] or [silent]
        high = np.max(said, axis=0)
        low = np.min([np.where(classes == UNSAID, high, classes) for classes in said], axis=0)
        return low, high

    def _latest(self, voices: list[Voice]) -> Int8[np.ndarray, "frames"]:
        """The latest word of several speakers, frame by frame; a withdrawn one is no word."""
        said = np.full(len(self), UNSAID, np.int8)
        when = np.zeros(len(self), np.int64)
        for voice in voices:
            newer = (voice.classes != UNSAID) & (voice.acts > when)
            said, when = np.where(newer, voice.classes, said), np.where(newer, voice.acts, when)
        return said


def labels_of(kind: LabelKind, stamps_ns: Int64[np.ndarray, "frames"], acts: pl.DataFrame) -> FrameLabels:
    """The labels that ``acts`` give to the frames taken at ``stamps_ns``, which ascend."""
    return FrameLabels(kind, stamps_ns, {}).heard(acts)


def rows_of(stamps_ns: Int64[np.ndarray, "frames"], asked_ns: Int64[np.ndarray, "asked"]) -> Int64[np.ndarray, "asked"]:
    """The number of the frame taken at each of ``asked_ns``; -1 where none was."""
    if not len(stamps_ns):
        return np.full(len(asked_ns), -1, np.int64)
    rows = np.minimum(np.searchsorted(stamps_ns, asked_ns), len(stamps_ns) - 1)
    return np.where(stamps_ns[rows] == asked_ns, rows, -1).astype(np.int64)


def class_numbers(labels: pl.Series, kind: LabelKind) -> pl.Series:
    """Label texts as class numbers; an empty one is UNSAID."""
    numbers = {"": UNSAID} | {name: number for number, name in enumerate(kind.classes)}
    return labels.replace_strict(numbers, return_dtype=pl.Int8)
