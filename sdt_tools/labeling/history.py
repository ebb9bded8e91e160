"""What a person has done to the labels, so that it can be undone and done again: without limit, also after a restart.

Nothing but the journal is needed. All rows of one act carry the same ``created_ns``, by which it is known. Taking an
act back is an act as well: its rows give the frames what they had before, and carry the ``created_ns`` of the act that
is taken back. So the first run of rows with one ``created_ns`` does something, the second undoes it, the third does it
again, and so on.
"""

from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
import polars as pl
from jaxtyping import Int8, Int64

from sdt_tools.labeling.frame_labels import UNSAID, class_numbers
from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelKind, LabelSource


@dataclass(frozen=True, eq=False)
class Deed:
    """One act of a person: what ``labeler`` said of frames before, and after."""

    created_ns: int
    labeler: str
    stamps_ns: Int64[np.ndarray, "frames"]
    before: Int8[np.ndarray, "frames"]
    after: Int8[np.ndarray, "frames"]

    @property
    def reversed(self) -> "Deed":
        """What takes it back."""
        return replace(self, before=self.after, after=self.before)

    def rows(self, kind: LabelKind) -> pl.DataFrame:
        """As ``Journal.append_table`` takes it."""
        names = np.array([*kind.classes, ""])  # UNSAID is -1: the last
        return pl.DataFrame(
            {
                "stamp_ns": self.stamps_ns,
                "label": names[self.after],
                "labeler": [self.labeler] * len(self.stamps_ns),
                "source": [str(LabelSource.HUMAN)] * len(self.stamps_ns),
                "created_ns": [self.created_ns] * len(self.stamps_ns),
            },
            schema={
                "stamp_ns": pl.Int64,
                "label": pl.String,
                "labeler": pl.String,
                "source": pl.String,
                "created_ns": pl.Int64,
            },
        )


@dataclass(frozen=True)
class History:
    """Deeds that can be undone, and those that were undone and can be done again; the next one of each stands last."""

    done: tuple[Deed, ...] = ()
    undone: tuple[Deed, ...] = ()

    def after(self, deed: Deed) -> "History":
        """The history once ``deed`` was done: something new, or the last deed taken back, or done again."""
        done, undone = list(self.done), list(self.undone)
        _take_in(deed, done, undone)
        return History(tuple(done), tuple(undone))


def history_of(acts: pl.DataFrame, kind: LabelKind, labeler: str) -> History:
    """The deeds of ``labeler``, settling among them, in ``acts`` (columns as in a journal, in order)."""
    mine = acts.filter(
        (pl.col("source") == str(LabelSource.HUMAN)) & pl.col("labeler").is_in([labeler, SETTLED_BY + labeler])
    )
    rows = list(
        zip(
            mine["created_ns"].to_list(),
            mine["labeler"].to_list(),
            mine["stamp_ns"].to_list(),
            class_numbers(mine["label"], kind).to_list(),
            strict=True,
        )
    )
    stands: dict[tuple[str, int], int] = {}
    done: list[Deed] = []
    undone: list[Deed] = []
    for created_ns, run in groupby(rows, key=lambda row: row[0]):
        for part in _split(list(run)):
            _take_in(_deed(created_ns, part, stands), done, undone)
    return History(tuple(done), tuple(undone))


def _take_in(deed: Deed, done: list[Deed], undone: list[Deed]) -> None:
    if done and done[-1].created_ns == deed.created_ns:
        undone.append(done.pop())
    elif undone and undone[-1].created_ns == deed.created_ns:
        done.append(undone.pop())
    else:
        done.append(deed)
        undone.clear()


def _split(run: list[tuple[int, str, int, int]]) -> list[list[tuple[int, str, int, int]]]:
    """A run of one ``created_ns`` in parts: an act speaks of a frame once, so the next begins where one comes again."""
    parts: list[list[tuple[int, str, int, int]]] = []
    seen: set[int] = set()
    for row in run:
        if not parts or row[2] in seen:
            parts.append([])
            seen = set()
        parts[-1].append(row)
        seen.add(row[2])
    return parts


def _deed(created_ns: int, rows: list[tuple[int, str, int, int]], stands: dict[tuple[str, int], int]) -> Deed:
    """The deed that ``rows`` are, with what stood before; ``stands`` is brought up to date."""
    labeler = rows[0][1]
    before = [stands.get((labeler, stamp_ns), UNSAID) for _, _, stamp_ns, _ in rows]
    stands.update({(labeler, stamp_ns): after for _, _, stamp_ns, after in rows})
    return Deed(
        created_ns,
        labeler,
        np.array([stamp_ns for _, _, stamp_ns, _ in rows], np.int64),
        np.array(before, np.int8),
        np.array([after for *_, after in rows], np.int8),
    )
