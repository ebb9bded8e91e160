"""The keys of the labeling app: one table, for the keyboard, the help and the line at the bottom."""

from dataclasses import dataclass
from typing import Final

from sdt_tools.labeling.vocabulary import LabelKind


@dataclass(frozen=True)
class Key:
    """``names`` are the keys as the terminal tells them; ``shown`` what is on the keyboard; ``action`` what they do."""

    names: tuple[str, ...]
    shown: str
    action: str
    does: str


GROUPS: Final[dict[str, tuple[Key, ...]]] = {
    "Go": (
        Key(("right", "."), "→ .", "step(1)", "a frame on"),
        Key(("left", ","), "← ,", "step(-1)", "a frame back"),
        Key(("shift+right", "pagedown"), "⇧→ PgDn", "step(10)", "ten frames on"),
        Key(("shift+left", "pageup"), "⇧← PgUp", "step(-10)", "ten frames back"),
        Key(("home",), "Home", "first", "the first frame"),
        Key(("end",), "End", "last", "the last frame"),
        Key(("n",), "n", "unlabelled", "next frame without your label"),
        Key(("N",), "N", "unlabelled_before", "the one before"),
        Key(("j",), "j", "disagreement", "next disagreement"),
        Key(("J",), "J", "disagreement_before", "the one before"),
        Key(("k",), "k", "suspect", "next suspect label"),
        Key(("K",), "K", "suspect_before", "the one before"),
        Key(("l",), "l", "review", "list of all that is in doubt"),
        Key(("g",), "g", "jump", "go to a time or frame"),
        Key(("space",), "Space", "play", "play, stop"),
        Key(("o",), "o", "play_slowly", "play at a quarter of the speed"),
        Key(("+",), "+", "faster", "play faster"),
        Key(("-",), "-", "slower", "play slower"),
    ),
    "Label": (
        Key(("0", "backspace", "delete"), "0 ⌫", "withdraw", "withdraw the label"),
        Key(("v",), "v", "range", "begin a range, give it up"),
        Key(("f",), "f", "carry", "carry forward while you go on"),
        Key(("a",), "a", "accept", "accept the pre-label"),
        Key(("=",), "=", "settle", "settle what people disagree about"),
        Key(("u", "ctrl+z"), "u ^z", "undo", "undo"),
        Key(("r", "ctrl+y"), "r ^y", "redo", "do again"),
        Key(("escape",), "Esc", "let_go", "give up range, settling, playing"),
    ),
    "See": (
        Key(("[",), "[", "zoom(-1)", "nearer"),
        Key(("]",), "]", "zoom(1)", "further"),
        Key(("?",), "?", "help", "these keys"),
        Key(("ctrl+q", "ctrl+c"), "^q ^c", "quit", "quit; all is on disk already"),
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
