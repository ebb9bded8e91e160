"""The keys of the cockpit: one table, for the keyboard, the help and the line at the bottom."""

from dataclasses import dataclass
from typing import Final

from sdt_tools.frames import MotionClass

MOTION_KEYS: Final[dict[str, MotionClass]] = {
    "q": MotionClass.LEFT_FORWARD,
    "w": MotionClass.FORWARD,
    "e": MotionClass.RIGHT_FORWARD,
    "s": MotionClass.STAY,
    "z": MotionClass.LEFT_BACKWARD,
    "x": MotionClass.BACKWARD,
    "c": MotionClass.RIGHT_BACKWARD,
    "7": MotionClass.LEFT_FORWARD,
    "8": MotionClass.FORWARD,
    "9": MotionClass.RIGHT_FORWARD,
    "5": MotionClass.STAY,
    "1": MotionClass.LEFT_BACKWARD,
    "2": MotionClass.BACKWARD,
    "3": MotionClass.RIGHT_BACKWARD,
    "left": MotionClass.LEFT_FORWARD,
    "up": MotionClass.FORWARD,
    "right": MotionClass.RIGHT_FORWARD,
    "shift+left": MotionClass.LEFT_BACKWARD,
    "down": MotionClass.BACKWARD,
    "shift+right": MotionClass.RIGHT_BACKWARD,
}
"""Letters lie as they lead, and so do the digits of a number pad; arrows turn ahead, and with shift back."""


@dataclass(frozen=True)
class Key:
    """``names`` are the keys as the terminal tells them; ``shown`` what is on the keyboard; ``action`` what they do."""

    names: tuple[str, ...]
    shown: str
    action: str
    does: str


GROUPS: Final[dict[str, tuple[Key, ...]]] = {
    "Stop": (
        Key(("space",), "Space", "stop", "stop; a policy waits for g"),
        Key(("escape",), "Esc", "emergency", "EMERGENCY STOP, latched"),
        Key(("ctrl+r",), "^r", "release", "release the emergency stop"),
        Key(("g",), "g", "give_back", "give back to the policy"),
    ),
    "Speed": (
        Key(("+", "="), "+", "speed(1)", "faster"),
        Key(("-",), "-", "speed(-1)", "slower"),
    ),
    "Takes": (
        Key(("t",), "t", "take", "start a take; keep it and stop"),
        Key(("n",), "n", "next_take", "keep it and start the next"),
        Key(("v",), "v", "pause", "pause, resume"),
        Key(("ctrl+x",), "^x", "discard", "discard it, or the last one"),
        Key(("m",), "m", "mark", "mark the moment; then a note"),
        Key(("k",), "k", "save", "save the last seconds"),
        Key(("ctrl+q", "ctrl+c"), "^q ^c", "quit", "stop, keep, quit"),
    ),
    "Operator (scene)": (
        Key(("o",), "o", "gesture('ENABLE')", "shows enable"),
        Key(("p",), "p", "gesture('DISABLE')", "shows disable"),
        Key(("i",), "i", "gesture('IDLE')", "shows nothing"),
    ),
    "See": (
        Key(("[",), "[", "zoom(-1)", "nearer"),
        Key(("]",), "]", "zoom(1)", "further"),
        Key(("?",), "?", "help", "these keys"),
    ),
}
"""What keys do, but for those that drive."""

ACTIONS: Final = {name: key.action for keys in GROUPS.values() for key in keys for name in key.names}
