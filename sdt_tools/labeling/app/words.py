"""What the app says in words: where one is, what is said of the frame, how far one has come."""

from typing import Final

import numpy as np
from rich.style import Style
from rich.text import Text

from sdt_tools.labeling.app.keys import class_keys
from sdt_tools.labeling.app.state import State
from sdt_tools.labeling.app.strip import AGAINST, BRIGHT, CONFLICT, DIM, EMPTY, RANGE, SUSPECT, color_of
from sdt_tools.labeling.frame_labels import UNSAID
from sdt_tools.labeling.review import is_open
from sdt_tools.labeling.vocabulary import LabelSource
from sdt_tools.terminal.raster import BLANK, style

HINTS: Final[str] = " ? keys  ←→ go  n unlabelled  j differing  v range  f carry  u undo  Space play"
COUNT_CELLS: Final = 7
_ON: Final = Style(bold=True)


def clock(stamp_ns: int, start_ns: int) -> str:
    """Time since the beginning, as in ``1:02.340``."""
    since_ms = (stamp_ns - start_ns) // 1_000_000
    minutes, rest_ms = divmod(since_ms, 60_000)
    return f"{minutes}:{rest_ms / 1000:06.3f}"


def heading(state: State, name: str, width: int) -> Text:
    """What is labelled, by whom, and where one is."""
    stamps_ns = state.labels.stamps_ns
    start_ns = int(stamps_ns[0])
    at = clock(int(stamps_ns[state.cursor]), start_ns)
    place = f"{state.cursor + 1:,}/{len(stamps_ns):,}  {at} of {clock(int(stamps_ns[-1]), start_ns)} "
    flags = Text()
    for text, color in _flags(state):
        flags.append(f" {text} ", style(BLANK, color, bold=True)).append(" ")
    left = Text(f" {state.labels.kind}  ", style(DIM)).append(state.labeler, _ON).append("  ").append_text(flags)
    if width - len(place) - left.cell_len - 2 < len(name):
        place = f"{state.cursor + 1:,}/{len(stamps_ns):,}  {at} "
    room = width - len(place) - left.cell_len - 2
    title = name if len(name) <= room else f"…{name[-max(room - 1, 0) :]}" if room > 1 else ""
    line = Text(f" {title}", style(BRIGHT)).append_text(left)
    return line.append(" " * max(width - line.cell_len - len(place), 0)).append(place, style(BRIGHT))


def _flags(state: State) -> list[tuple[str, tuple[int, int, int]]]:
    flags = []
    if state.speed:
        flags.append((f"▶ {state.speed:g}×", BRIGHT))
    if state.carrying:
        flags.append((f"CARRY {'…' if state.carried == UNSAID else state.name(state.carried)}", AGAINST))
    if state.settling:
        flags.append(("SETTLE", CONFLICT))
    if state.anchor is not None:
        first, last = state.chosen
        flags.append((f"RANGE {last - first + 1:,}", RANGE))
    return flags


def class_table(state: State, width: int) -> Text:
    """The classes with their keys and how many frames the labeler has given each; below, how far the labeling is."""
    counts = state.labels.counts(state.mine)
    here, offered = int(state.mine[state.cursor]), int(state.prelabels[state.cursor])
    text = Text(no_wrap=True)
    for number, ((digit, letter), count) in enumerate(zip(class_keys(state.labels.kind), counts, strict=True)):
        sign = "●" if number == here else "○" if number == offered else " "
        text.append(f" {digit} {letter}", style(BLANK, color_of(state, number), bold=True))
        name, room = f" {sign} {state.classes[number]}", width - 4 - COUNT_CELLS
        text.append(f"{name:<{room}.{room}}", _ON if number == here else style(DIM))
        text.append(f"{count:>{COUNT_CELLS},}\n")
    return text.append_text(_progress(state, width))


def _progress(state: State, width: int) -> Text:
    frames = len(state.labels)
    mine = int(np.count_nonzero(state.mine != UNSAID))
    people = int(np.count_nonzero((state.labels.human != UNSAID) | state.labels.disputed))
    text = Text()
    done = mine * (width - 1) // frames
    text.append(" " + "━" * done, style(BRIGHT)).append("━" * (width - 1 - done), style(EMPTY)).append("\n")
    text.append(f" you    {mine:>9,} {mine / frames:>6.1%}\n", style(BRIGHT))
    text.append(f" people {people:>9,} {people / frames:>6.1%}\n", style(DIM))
    conflicts, suspects = int(state.labels.disputed.sum()), int(state.suspect.sum())
    text.append(f" ! conflicts {conflicts:,}\n", style(CONFLICT if conflicts else DIM))
    return text.append(f" ? suspects  {suspects:,}", style(SUSPECT if suspects else DIM))


def frame_words(state: State) -> Text:
    """Who says what of the frame shown."""
    row, text = state.cursor, Text(no_wrap=True, overflow="ellipsis")

    def said(who: str, number: int, sign: str = "") -> None:
        text.append(f" {who:<8.8} ", style(DIM))
        name = state.name(number) if number != UNSAID else "–"
        text.append(f"{name}{sign}\n", style(DIM if number == UNSAID else color_of(state, number)))

    said("you", int(state.mine[row]))
    for speaker, voice in state.labels.voices.items():
        number = int(voice.classes[row])
        if number == UNSAID or (speaker.is_labeler and speaker.labeler == state.labeler):
            continue
        if speaker.settles:
            said("settled", number, f" by {speaker.labeler.partition(':')[2]}")
        elif speaker.source is LabelSource.HUMAN:
            said(speaker.labeler, number)
        else:
            said(str(speaker.source), number, " (pre)")
    if state.predicted is not None:
        said("model", int(state.predicted[row]), " (pre)")
    if state.labels.disputed[row]:
        text.append(" ! differing: = settles\n", style(CONFLICT))
    for one in state.suspects:
        if one.row == row and is_open(one, state.labels):
            text.append(f" ? {one.score:.2f} rather {one.suggested}\n", style(SUSPECT))
    return text
