"""What the labeling app knows, and how each key changes it: frozen states, nothing of screens or files.

What changes labels comes back as a ``Turn`` with a deed. Whoever keeps the journal writes the deed first and only then
takes the new state (``applied``), so that nothing is ever shown that is not on disk.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import polars as pl
from jaxtyping import Bool, Int8, Int64

from sdt_tools.labeling.frame_labels import UNSAID, FrameLabels, Speaker
from sdt_tools.labeling.history import Deed, History
from sdt_tools.labeling.review import Suspect, contradicting, is_open
from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelSource


@dataclass(frozen=True, eq=False)
class State:
    """Where the labeler stands. ``predicted`` are pre-labels from a file, in place of those of the journal.

    ``anchor`` is where a range begins that ends at ``cursor``; ``carried`` the class that is carried forward while
    ``carrying``; ``speed`` how fast the recording plays, 0 when it stands still; ``words`` what was said last.
    """

    labels: FrameLabels
    labeler: str
    history: History = field(default_factory=History)
    predicted: Int8[np.ndarray, "frames"] | None = None
    suspects: tuple[Suspect, ...] = ()
    cursor: int = 0
    anchor: int | None = None
    carrying: bool = False
    carried: int = UNSAID
    settling: bool = False
    speed: float = 0.0
    words: str = ""

    @property
    def classes(self) -> tuple[str, ...]:
        """The names of the classes."""
        return self.labels.kind.classes

    @cached_property
    def mine(self) -> Int8[np.ndarray, "frames"]:
        """What the labeler himself says."""
        return self.labels.voice(Speaker(LabelSource.HUMAN, self.labeler)).classes

    @cached_property
    def prelabels(self) -> Int8[np.ndarray, "frames"]:
        """What is offered: by the file of predictions, else by the journal."""
        return self.labels.prelabels if self.predicted is None else self.predicted

    @cached_property
    def disagreeing(self) -> Bool[np.ndarray, "frames"]:
        """Where people disagree with each other, or with what is offered."""
        either: Bool[np.ndarray, "frames"] = self.labels.disputed | contradicting(self.labels, self.prelabels)
        return either

    @cached_property
    def suspect(self) -> Bool[np.ndarray, "frames"]:
        """Where a label is probably wrong, and still stands."""
        marks = np.zeros(len(self.labels), bool)
        marks[[one.row for one in self.suspects if is_open(one, self.labels)]] = True
        return marks

    @property
    def has_company(self) -> bool:
        """Whether others have labelled too, or something was settled."""
        return any(
            speaker.source is LabelSource.HUMAN and speaker.labeler != self.labeler for speaker in self.labels.voices
        )

    @property
    def chosen(self) -> tuple[int, int]:
        """First and last frame that the next label is for: the range, or the frame shown."""
        if self.anchor is None:
            return self.cursor, self.cursor
        return min(self.anchor, self.cursor), max(self.anchor, self.cursor)

    def name(self, number: int) -> str:
        """The class with this number; ``none`` for UNSAID."""
        return "none" if number == UNSAID else self.classes[number]

    def saying(self, words: str) -> "State":
        """The same, with something said."""
        return replace(self, words=words)


@dataclass(frozen=True, eq=False)
class Turn:
    """What a key leads to: the next state, once ``deed``, if there is one, is written and applied."""

    state: State
    deed: Deed | None = None


def applied(state: State, deed: Deed, last_act: int) -> State:
    """The state once ``deed`` is in the journal; its last row is act ``last_act``."""
    rows = np.searchsorted(state.labels.stamps_ns, deed.stamps_ns)
    speaker = Speaker(LabelSource.HUMAN, deed.labeler)
    acts = np.arange(last_act + 1 - len(rows), last_act + 1)
    voice = state.labels.voice(speaker).saying(rows, deed.after, acts)
    labels = replace(state.labels, voices={**state.labels.voices, speaker: voice})
    return replace(state, labels=labels, history=state.history.after(deed))


def heard(state: State, acts: pl.DataFrame) -> State:
    """The state after ``acts`` that others have appended."""
    return replace(state, labels=state.labels.heard(acts))


# --- going about ---------------------------------------------------------------------------------------------------


def step(state: State, by: int, now_ns: int) -> Turn:
    """Go ``by`` frames on. Where a class is carried forward, frames passed that have no label of mine get it."""
    cursor = min(max(state.cursor + by, 0), len(state.labels) - 1)
    moved = replace(state, cursor=cursor, words="")
    if not state.carrying or state.carried == UNSAID or state.anchor is not None or cursor <= state.cursor:
        return Turn(moved)
    rows = np.arange(state.cursor + 1, cursor + 1)
    rows = rows[state.mine[rows] == UNSAID]
    return Turn(moved, _deed(state, rows, np.full(len(rows), state.carried, np.int8), state.labeler, now_ns))


def go_to(state: State, row: int) -> Turn:
    """Show frame ``row``; nothing is carried there."""
    return Turn(replace(state, cursor=min(max(row, 0), len(state.labels) - 1), words=""))


def go_to_next(state: State, marks: Bool[np.ndarray, "frames"], what: str, *, backward: bool, runs: bool) -> Turn:
    """Show the next frame of ``marks``, with ``runs`` the next beginning of a run of them; beyond the end from afar."""
    starts = marks.copy()
    if runs:
        starts[1:] &= ~marks[:-1]
    rows = np.flatnonzero(starts)
    if not len(rows):
        return Turn(state.saying(f"no {what}"))
    beyond = rows[rows < state.cursor] if backward else rows[rows > state.cursor]
    if len(beyond):
        return go_to(state, int(beyond[-1] if backward else beyond[0]))
    around = go_to(state, int(rows[-1] if backward else rows[0])).state
    return Turn(around.saying(f"the {'last' if backward else 'first'} {what}: there is none {_side(backward)}"))


def _side(backward: bool) -> str:
    return "before" if backward else "after"


def select(state: State, first: int, last: int) -> Turn:
    """Choose frames ``first`` to ``last``, and show the first."""
    return Turn(replace(go_to(state, first).state, anchor=None if first == last else last, settling=False))


# --- labeling ------------------------------------------------------------------------------------------------------


def label(state: State, number: int, now_ns: int) -> Turn:
    """Give the chosen frames a class, or settle them; UNSAID withdraws. A class given is carried on from here."""
    if state.settling:
        return _settle(state, number, now_ns)
    first, last = state.chosen
    rows = np.arange(first, last + 1)
    deed = _deed(state, rows, np.full(len(rows), number, np.int8), state.labeler, now_ns)
    carried = state.carried if number == UNSAID else number
    words = "" if deed is not None else f"{_frames(len(rows))}: {state.name(number)} already"
    return Turn(replace(state, anchor=None, carried=carried, words=words), deed)


def accept(state: State, now_ns: int) -> Turn:
    """Make the pre-labels of the chosen frames labels of one's own."""
    first, last = state.chosen
    rows = np.arange(first, last + 1)
    rows = rows[state.prelabels[rows] != UNSAID]
    if not len(rows):
        return Turn(state.saying("no pre-label here to accept"))
    offered = state.prelabels[rows]
    deed = _deed(state, rows, offered, state.labeler, now_ns)
    words = f"accepted {_frames(len(rows))}" if deed is not None else "your labels are the pre-labels already"
    return Turn(replace(state, anchor=None, settling=False, carried=int(offered[-1]), words=words), deed)


def ask_to_settle(state: State) -> Turn:
    """The next class settles what people disagree about in the chosen frames."""
    if state.settling:
        return Turn(replace(state, settling=False, words=""))
    first, last = state.chosen
    open_ = int(state.labels.differing[first : last + 1].sum())
    if not open_:
        return Turn(state.saying("nobody disagrees here"))
    return Turn(replace(state, settling=True, words=f"settle {_frames(open_)}: press the class that is right"))


def _settle(state: State, number: int, now_ns: int) -> Turn:
    first, last = state.chosen
    rows = np.arange(first, last + 1)
    rows = rows[state.labels.differing[rows]]
    deed = _deed(state, rows, np.full(len(rows), number, np.int8), SETTLED_BY + state.labeler, now_ns)
    said = "withdrawn" if number == UNSAID else f"settled as {state.name(number)}"
    return Turn(replace(state, anchor=None, settling=False, words=f"{_frames(len(rows))} {said}"), deed)


def undo(state: State) -> Turn:
    """Take back what was done last."""
    if not state.history.done:
        return Turn(state.saying("nothing to undo"))
    return _again(state, state.history.done[-1].reversed, "undone")


def redo(state: State) -> Turn:
    """Do again what was taken back last."""
    if not state.history.undone:
        return Turn(state.saying("nothing to do again"))
    return _again(state, state.history.undone[-1], "done again")


def toggle_range(state: State) -> Turn:
    """Begin a range here, or give it up."""
    if state.anchor is not None:
        return Turn(replace(state, anchor=None, settling=False, words=""))
    return Turn(replace(state, anchor=state.cursor, words="range: go to its other end, then press a class"))


def toggle_carry(state: State) -> Turn:
    """Begin or end to carry a class forward: that of the frame shown, else the one given last."""
    if state.carrying:
        return Turn(replace(state, carrying=False, words=""))
    here = int(state.mine[state.cursor])
    carried = state.carried if here == UNSAID else here
    words = (
        "carry: press the class that begins here" if carried == UNSAID else f"carrying {state.name(carried)} forward"
    )
    return Turn(replace(state, carrying=True, carried=carried, words=words))


def let_go(state: State) -> Turn:
    """Give up range, settling and playing; where none of them was begun, carrying."""
    if state.carrying and state.anchor is None and not state.settling and not state.speed:
        return toggle_carry(state)
    return Turn(replace(state, anchor=None, settling=False, speed=0.0, words=""))


def _again(state: State, deed: Deed, what: str) -> Turn:
    row = int(np.searchsorted(state.labels.stamps_ns, deed.stamps_ns[0]))
    words = (
        f"{what}: {_frames(len(deed.stamps_ns))} {state.name(int(deed.before[0]))} → {state.name(int(deed.after[0]))}"
    )
    return Turn(replace(go_to(state, row).state, anchor=None, settling=False, speed=0.0, words=words), deed)


def _deed(
    state: State, rows: Int64[np.ndarray, "rows"], classes: Int8[np.ndarray, "rows"], labeler: str, now_ns: int
) -> Deed | None:
    """What gives the frames ``rows`` these classes; None where it changes nothing."""
    said = state.labels.voice(Speaker(LabelSource.HUMAN, labeler)).classes[rows]
    changed = said != classes
    if not changed.any():
        return None
    newest = max((deed.created_ns for deed in (*state.history.done[-1:], *state.history.undone)), default=0)
    stamps_ns = state.labels.stamps_ns[rows[changed]]
    return Deed(max(now_ns, newest + 1), labeler, stamps_ns, said[changed], classes[changed])


def _frames(count: int) -> str:
    return "1 frame" if count == 1 else f"{count:,} frames"
