"""What opens over the app: where to go, what is in doubt, which keys there are. Esc closes each."""

from collections.abc import Iterable
from typing import ClassVar, Final

import numpy as np
from rich.style import Style
from rich.text import Text
from textual import on
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import OptionList, Static
from textual.widgets.option_list import Option

from sdt_tools.clock import SECOND_NS
from sdt_tools.labeling.app.keys import GROUPS, class_keys
from sdt_tools.labeling.app.state import State
from sdt_tools.labeling.app.strip import AGAINST, BRIGHT, CONFLICT, DIM, SUSPECT
from sdt_tools.labeling.app.words import clock
from sdt_tools.labeling.review import Doubt, ReviewItem, review_queue
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.terminal.line import Line
from sdt_tools.terminal.raster import style

_SIGNS: Final = {Doubt.CONFLICT: ("!", CONFLICT), Doubt.SUSPECT: ("?", SUSPECT), Doubt.PRELABEL: ("≠", AGAINST)}
_FRAME: Final = """
    {0} {{ align: center middle; background: #000000 50%; }}
    {0} > Vertical {{ background: #1a1e28; border: round #40a9ff; padding: 0 1; width: {1}; height: {2}; }}
"""


class JumpDialog(ModalScreen[int | None]):
    """Asks for a time; gives the frame."""

    CSS = _FRAME.format("JumpDialog", "56", "auto")
    BINDINGS: ClassVar[list[BindingType]] = [("escape", "dismiss")]

    def __init__(self, state: State) -> None:
        super().__init__()
        self._state = state

    def compose(self) -> Iterable[Widget]:
        """A line to type in."""
        with Vertical():
            yield Static("Go to 12.5 or 1:02.5 · +3 or -3 seconds · #120 · 50%", markup=False)
            yield Line(self._go)

    def _go(self, text: str) -> None:
        """Give the frame, or say what is meant."""
        place = place_of(text, self._state)
        if place is None:
            self.query_one(Static).update(f"'{text[:12]}' is no time: 12.5 · 1:02.5 · +3 · #120 · 50%")
            self.query_one(Line).action_select_all()  # what is typed next takes its place
        elif self.is_current:  # a key that repeats must not close what is below
            self.dismiss(place)


class ReviewDialog(ModalScreen[ReviewItem | None]):
    """Lists what is in doubt, the gravest first; gives what is chosen."""

    CSS = (
        _FRAME.format("ReviewDialog", "92%", "80%")
        + "ReviewDialog OptionList { height: 1fr; border: none; background: #1a1e28; }"
    )
    BINDINGS: ClassVar[list[BindingType]] = [("escape", "dismiss"), ("l", "dismiss")]
    MOST: Final = 1000

    def __init__(self, state: State) -> None:
        super().__init__()
        self._start_ns = int(state.labels.stamps_ns[0])
        self._stamps_ns = state.labels.stamps_ns
        self.items = review_queue(state.labels, state.prelabels, state.suspects)

    def compose(self) -> Iterable[Widget]:
        """A line an item."""
        with Vertical():
            yield Static(self._title(), markup=False)
            yield OptionList(*(Option(self._line(item)) for item in self.items[: self.MOST]))

    @on(OptionList.OptionSelected)
    def choose(self, event: OptionList.OptionSelected) -> None:
        """Give the item, once."""
        if self.is_current:
            self.dismiss(self.items[event.option_index])

    def _title(self) -> str:
        if not self.items:
            return "nothing is in doubt · Esc closes"
        beyond = f", of which the first {self.MOST:,}" if len(self.items) > self.MOST else ""
        return f"{len(self.items):,} in doubt{beyond} · ! people ? suspect ≠ pre-label · Enter chooses"

    def _line(self, item: ReviewItem) -> Text:
        sign, color = _SIGNS[item.doubt]
        at = clock(int(self._stamps_ns[item.first]), self._start_ns)
        text = Text(no_wrap=True, overflow="ellipsis").append(f"{sign} ", style_of(color))
        return text.append(f"{at:>10}  {item.frames:>5,} fr  ", style_of(DIM)).append(item.words, style_of(BRIGHT))


class HelpDialog(ModalScreen[None]):
    """All keys."""

    CSS = f"""
    {_FRAME.format("HelpDialog", "78", "auto")}
    HelpDialog Static {{ width: 1fr; }}
    HelpDialog Horizontal {{ height: auto; }}
    """
    BINDINGS: ClassVar[list[BindingType]] = [("escape,question_mark,enter,space", "close")]

    def __init__(self, kind: LabelKind) -> None:
        super().__init__()
        self._kind = kind

    def action_close(self) -> None:
        """Close, once."""
        if self.is_current:
            self.dismiss()

    def compose(self) -> Iterable[Widget]:
        """Two columns."""
        labels = Text().append("Classes\n", Style(bold=True))
        for name, (digit, letter) in zip(self._kind.classes, class_keys(self._kind), strict=True):
            labels.append(f"{digit} {letter}".ljust(10), style_of(BRIGHT)).append(f"{name}\n", style_of(DIM))
        with Vertical(), Horizontal():
            yield Static(group("Go"))
            yield Static(Text.assemble(labels, group("Label"), group("See")))


def group(name: str) -> Text:
    """The keys of a group, a line each."""
    text = Text().append(f"{name}\n", Style(bold=True))
    for key in GROUPS[name]:
        if not key.shown:
            continue
        text.append(key.shown.ljust(10), style_of(BRIGHT)).append(f"{key.does}\n", style_of(DIM))
    return text


def style_of(color: tuple[int, int, int]) -> Style:
    """A colour on what is behind it."""
    return Style(color=style(color).color)


def place_of(text: str, state: State) -> int | None:
    """The frame that a person means; None for what nobody can mean.

    ``12.5`` or ``1:02.5`` since the start, ``+3`` or ``-3`` seconds from here, ``#120`` the 120th frame, ``50%`` of the
    way.
    """
    text, stamps_ns = text.strip(), state.labels.stamps_ns
    try:
        if text.startswith("#"):
            return min(max(int(text[1:]) - 1, 0), len(stamps_ns) - 1)
        if text.endswith("%"):
            return min(max(round(float(text[:-1]) / 100 * (len(stamps_ns) - 1)), 0), len(stamps_ns) - 1)
        relative = text[:1] in ("+", "-")
        minutes, _, seconds = text.lstrip("+-").rpartition(":")
        asked_s = 60 * int(minutes or 0) + float(seconds)
    except (ValueError, OverflowError):
        return None
    if not np.isfinite(asked_s):
        return None
    begin_ns = int(stamps_ns[state.cursor if relative else 0])
    asked_ns = begin_ns + round((-asked_s if text.startswith("-") else asked_s) * SECOND_NS)
    return int(np.argmin(np.abs(stamps_ns - min(max(asked_ns, 0), int(stamps_ns[-1])))))
