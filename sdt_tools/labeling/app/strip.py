"""The recording in time: a close-up with a frame a cell, and all of it in one line."""

from typing import Final

import numpy as np
from jaxtyping import Bool, Int8, Int64
from rich.segment import Segment
from textual.strip import Strip
from textual.widget import Widget

from sdt_tools.class_colors import GESTURES, MOTIONS, Rgb
from sdt_tools.clock import SECOND_NS
from sdt_tools.labeling.app.state import State
from sdt_tools.labeling.frame_labels import UNSAID, FrameLabels
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.terminal.raster import BLANK, style

NAME_CELLS: Final = 7
EMPTY: Final[Rgb] = (34, 38, 48)
DIM: Final[Rgb] = (120, 128, 142)
BRIGHT: Final[Rgb] = (245, 245, 245)
CONFLICT: Final[Rgb] = (255, 82, 82)
AGAINST: Final[Rgb] = (255, 152, 0)
SUSPECT: Final[Rgb] = (255, 235, 59)
RANGE: Final[Rgb] = (64, 169, 255)
COLORS: Final[dict[LabelKind, tuple[Rgb, ...]]] = {
    LabelKind.MOTION: tuple(MOTIONS[name] for name in LabelKind.MOTION.classes),
    LabelKind.GESTURE: tuple(GESTURES[name] for name in LabelKind.GESTURE.classes),
}
LINES: Final = 6


def color_of(state: State, number: int) -> Rgb:
    """The colour of a class; that of nothing for UNSAID."""
    return EMPTY if number == UNSAID else COLORS[state.labels.kind][number]


def majority(classes: Int8[np.ndarray, "frames"], count: int, cells: int) -> Int8[np.ndarray, "cells"]:
    """What most labelled frames of each cell are, when all are shared out evenly to ``cells``; else UNSAID."""
    cell = np.arange(len(classes)) * cells // len(classes)
    said = classes != UNSAID
    votes = np.bincount(cell[said] * count + classes[said], minlength=cells * count).reshape(cells, count)
    return np.where(votes.any(axis=1), votes.argmax(axis=1), UNSAID).astype(np.int8)


def any_in(marks: Bool[np.ndarray, "frames"], cells: int) -> Bool[np.ndarray, "cells"]:
    """Whether a frame of each cell is marked, shared out the same way."""
    found = np.zeros(cells, bool)
    found[np.flatnonzero(marks) * cells // len(marks)] = True
    return found


class TimelineStrip(Widget):
    """Six lines: one's own labels, those of all people, pre-labels and marks around the frame; then all frames."""

    DEFAULT_CSS = f"TimelineStrip {{ width: 1fr; height: {LINES}; }}"

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self._strips: list[Strip] = []
        self._state: State | None = None
        self._whole: tuple[FrameLabels, int, tuple[np.ndarray, ...]] | None = None

    def show(self, state: State) -> None:
        """Show where ``state`` stands."""
        self._state = state
        self._draw()

    def on_resize(self) -> None:
        """Draw anew."""
        self._draw()

    def render_line(self, y: int) -> Strip:
        """One line."""
        return self._strips[y] if y < len(self._strips) else Strip.blank(self.size.width, style(BLANK))

    def _draw(self) -> None:
        cells = self.size.width - NAME_CELLS
        if self._state is not None and cells > 0:
            self._strips = [*_close_up(self._state, cells), *self._all(self._state, cells)]
        self.refresh()

    def _all(self, state: State, cells: int) -> list[Strip]:
        frames, count = len(state.labels), len(state.classes)
        width = min(cells, frames)
        if self._whole is None or self._whole[0] is not state.labels or self._whole[1] != width:
            found = (
                majority(state.mine, count, width),
                majority(state.prelabels, count, width),
                any_in(state.labels.disputed, width),
                any_in(state.disagreeing, width),
                any_in(state.suspect, width),
            )
            self._whole = state.labels, width, found
        mine, offered, disputed, against, suspect = self._whole[2]
        bar = [
            Segment("▀", style(color_of(state, one), color_of(state, other)))
            for one, other in zip(mine.tolist(), offered.tolist(), strict=True)
        ]
        marks = _marks(disputed, against, suspect)
        first, last = (row * width // frames for row in state.chosen)
        if state.anchor is not None:
            marks[first : last + 1] = [("━", RANGE)] * (last + 1 - first)
        marks[state.cursor * width // frames] = ("▲", BRIGHT)
        return [_named("all", bar, cells), _named("", [Segment(text, style(color)) for text, color in marks], cells)]


def _close_up(state: State, cells: int) -> list[Strip]:
    first = state.cursor - cells // 2
    rows = np.arange(first, first + cells)
    inside = (rows >= 0) & (rows < len(state.labels))
    at = np.clip(rows, 0, len(state.labels) - 1)

    def around(classes: Int8[np.ndarray, "frames"]) -> list[int]:
        numbers: list[int] = np.where(inside, classes[at], UNSAID - 1).tolist()
        return numbers

    mine = [_cell(state, number, str(number + 1)) for number in around(state.mine)]
    people = [_cell(state, number, " ") for number in around(state.labels.human)]
    offered = [
        Segment("▂", style(color_of(state, number))) if number >= 0 else Segment(" ", style(DIM))
        for number in around(state.prelabels)
    ]
    here = inside & (at == rows)
    marks = _marks(state.labels.disputed[at] & here, state.disagreeing[at] & here, state.suspect[at] & here)
    if state.anchor is not None:
        begin, end = state.chosen
        marks = [("━", RANGE) if begin <= row <= end else mark for row, mark in zip(rows.tolist(), marks, strict=True)]
    marks[cells // 2] = ("▲", BRIGHT)
    second = ("people", people) if state.has_company else ("", _ruler(state.labels.stamps_ns, first, cells))
    lines = [("you", mine), second, ("pre", offered), ("", [Segment(text, style(color)) for text, color in marks])]
    return [_named(name, line, cells) for name, line in lines]


def _ruler(stamps_ns: Int64[np.ndarray, "frames"], first: int, cells: int) -> list[Segment]:
    """A tick where each full second begins, with the seconds behind it."""
    text = [" "] * cells
    low, high = max(first, 1), min(first + cells, len(stamps_ns))
    seconds = (stamps_ns[low - 1 : high] - stamps_ns[0]) // SECOND_NS
    for place in (np.flatnonzero(np.diff(seconds)) + low - first).tolist():
        words = f"╵{seconds[place + first - low + 1]} s"
        text[place : place + len(words)] = words[: cells - place]
    return [Segment("".join(text), style(DIM))]


def _cell(state: State, number: int, text: str) -> Segment:
    if number < UNSAID:
        return Segment(" ", style(DIM))
    if number == UNSAID:
        return Segment("·", style(DIM, EMPTY))
    return Segment(text, style(BLANK, color_of(state, number), bold=True))


def _marks(
    disputed: Bool[np.ndarray, "cells"], against: Bool[np.ndarray, "cells"], suspect: Bool[np.ndarray, "cells"]
) -> list[tuple[str, Rgb]]:
    kinds: Int64[np.ndarray, "cells"] = np.where(disputed, 3, np.where(suspect, 2, np.where(against, 1, 0)))
    signs = ((" ", DIM), ("≠", AGAINST), ("?", SUSPECT), ("!", CONFLICT))
    return [signs[kind] for kind in kinds.tolist()]


def _named(name: str, segments: list[Segment], cells: int) -> Strip:
    strip = Strip([Segment(name.ljust(NAME_CELLS), style(DIM)), *segments]).simplify()
    return strip.adjust_cell_length(NAME_CELLS + cells, style(BLANK))
