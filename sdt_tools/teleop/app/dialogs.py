"""What opens over the cockpit: the keys, and a line for a note."""

from collections.abc import Iterable
from typing import ClassVar

from rich.style import Style
from rich.text import Text
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import Static

from sdt_tools.teleop.app.keys import GROUPS, Key
from sdt_tools.teleop.app.words import BRIGHT, DIM, bold, ink
from sdt_tools.terminal.line import Line

_DRIVE = (
    ("↖ ↑ ↗", "q w e   7 8 9   ← ↑ →"),
    ("  ■  ", "  s       5     Space"),
    ("↙ ↓ ↘", "z x c   1 2 3   ⇧← ↓ ⇧→"),
)


class HelpDialog(ModalScreen[None]):
    """All keys. The robot goes on meanwhile; Esc closes this and stops it."""

    CSS = """
    HelpDialog { align: center middle; background: #000000 50%; }
    HelpDialog > Vertical { background: #1a1e28; border: round #40a9ff; padding: 0 1; width: 78; height: auto; }
    HelpDialog Horizontal { height: auto; }
    HelpDialog Static { width: 1fr; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [("question_mark,enter,space", "close")]

    def compose(self) -> Iterable[Widget]:
        """Two columns."""
        with Vertical(), Horizontal():
            yield Static(Text.assemble(_driving(), *(_group(name) for name in ("Stop", "Speed"))))
            yield Static(Text.assemble(*(_group(name) for name in ("Takes", "Operator (scene)", "See"))))

    def action_close(self) -> None:
        """Close, once: a key that repeats must not close what is below."""
        if self.is_current:
            self.dismiss()


class NoteDialog(ModalScreen[str]):
    """Asks for a note on a moment that is marked already; gives it, empty where there is none."""

    CSS = """
    NoteDialog { align: center bottom; background: #000000 0%; }
    NoteDialog > Vertical { background: #1a1e28; border: round #40a9ff; padding: 0 1; width: 100%; height: auto; }
    NoteDialog Line { border: none; height: 1; padding: 0; background: #1a1e28; }
    """

    def __init__(self, name: str) -> None:
        super().__init__()
        self._mark = name

    def compose(self) -> Iterable[Widget]:
        """A line to type in."""
        with Vertical():
            yield Static(f"{self._mark} is set. A note on it? Enter ends it · Esc is the emergency stop", markup=False)
            yield Line(self._give)

    def _give(self, note: str) -> None:
        """Once: a key that repeats must not close what is below."""
        if self.is_current:
            self.dismiss(note.strip())


def _driving() -> Text:
    text = Text("Drive: letters, number pad, arrows\n", Style(bold=True))
    for signs, keys in _DRIVE:
        text.append(f"{signs}  ", bold(BRIGHT)).append(f"{keys}\n", ink(DIM))
    return text.append("A key that repeats holds on.\n", ink(DIM))


def _group(name: str) -> Text:
    text = Text(f"{name}\n", Style(bold=True))
    for key in GROUPS[name]:
        text.append_text(_line(key))
    return text


def _line(key: Key) -> Text:
    return Text(key.shown.ljust(7), bold(BRIGHT)).append(f"{key.does}\n", ink(DIM))
