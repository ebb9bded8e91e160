"""The keys of the labeling app: one table, for the keyboard, the help and the line at the bottom."""

from dataclasses import dataclass
from typing import Final

from sdt_tools.labeling.vocabulary import LabelKind


@dataclass(frozen=True)
class Key:
    """``names`` are the keys as the terminal tells them; ``shown`` what is on the keyboard; ``action`` what they do.

    Where nothing is ``shown``, the line of the key before says it.
    """

    names: tuple[str, ...]
    shown: str
    action: str
    does: str


GROUPS: Final[dict[str, tuple[Key, ...]]] = {
    "Go": (
        Key(("right", "."), "→ ← . ,", "step(1)", "a frame on, back"),
        Key(("left", ","), "", "step(-1)", ""),
        Key(("shift+right", "pagedown"), "PgDn PgUp", "step(10)", "ten frames on, back"),
        Key(("shift+left", "pageup"), "⇧→ ⇧←", "step(-10)", "the same"),
        Key(("home",), "Home End", "first", "first frame, last"),
        Key(("end",), "", "last", ""),
        Key(("n",), "n N", "unlabelled", "next unlabelled, previous"),
        Key(("N",), "", "unlabelled_before", ""),
        Key(("j",), "j J", "disagreement", "next difference, previous"),
        Key(("J",), "", "disagreement_before", ""),
        Key(("k",), "k K", "suspect", "next suspect, previous"),
        Key(("K",), "", "suspect_before", ""),
        Key(("l",), "l", "review", "list all that is in doubt"),
        Key(("g",), "g", "jump", "go to a time or frame"),
        Key(("space",), "Space", "play", "play, stop"),
        Key(("o",), "o", "play_slowly", "play slowly"),
        Key(("+",), "+ -", "faster", "play faster, slower"),
        Key(("-",), "", "slower", ""),
    ),
    "Label": (
        Key(("0", "backspace", "delete"), "0 ⌫", "withdraw", "withdraw the label"),
        Key(("v",), "v", "range", "begin a range, give it up"),
        Key(("f",), "f", "carry", "carry forward as you go"),
        Key(("a",), "a", "accept", "accept the pre-label"),
        Key(("=",), "=", "settle", "settle a disagreement"),
        Key(("u", "ctrl+z"), "u ^z", "undo", "undo"),
        Key(("r", "ctrl+y"), "r ^y", "redo", "do again"),
        Key(("escape",), "Esc", "let_go", "give up what was begun"),
    ),
    "See": (
        Key(("[",), "[ ]", "zoom(-1)", "nearer, further"),
        Key(("]",), "", "zoom(1)", ""),
        Key(("?",), "?", "help", "these keys"),
        Key(("ctrl+q", "ctrl+c"), "^q ^c", "quit", "quit; all is on disk"),
    ),
}
"""What keys do, but for those that give a class."""

ACTIONS: Final = {name: key.action for keys in GROUPS.values() for key in keys for name in key.names}

_LETTERS: Final = {LabelKind.MOTION: "swqexzc", LabelKind.GESTURE: "ied"}
"""One a class, in their order. Motions lie on the keyboard as they lead: q w e ahead, s stays, z x c back."""


def class_keys(kind: LabelKind) -> tuple[tuple[str, str], ...]:
    """The two keys of each class: its number, from 1, and a letter."""
    return tuple((str(number), letter) for number, letter in enumerate(_LETTERS[kind], 1))


def class_of(key: str, kind: LabelKind) -> int | None:
    """The class that ``key`` gives."""
    return next((number for number, keys in enumerate(class_keys(kind)) if key in keys), None)
