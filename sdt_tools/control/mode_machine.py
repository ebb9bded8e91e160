"""The two states of the controller, and what switches between them (the paper's state machine).

Idle, only an enable gesture counts, and active, only a disable gesture: every other answer of the vision network leaves
the mode as it is, so that many of its errors have no effect.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from sdt_tools.frames import Gesture, Mode

SWITCHES: Final[Mapping[Mode, Gesture]] = {Mode.IDLE: Gesture.ENABLE, Mode.ACTIVE: Gesture.DISABLE}
"""The one gesture that leads out of each mode, into the other."""
_OTHER: Final[Mapping[Mode, Mode]] = {Mode.IDLE: Mode.ACTIVE, Mode.ACTIVE: Mode.IDLE}


@dataclass(frozen=True)
class ModeState:
    """The mode, and how many readings in a row, the first of them of ``since_ns``, have asked for the other one."""

    mode: Mode = Mode.IDLE
    asked: int = 0
    since_ns: int = 0


def after_reading(state: ModeState, gesture: Gesture, stamp_ns: int, debounce: int = 1) -> ModeState:
    """The state after a picture of ``stamp_ns`` was read as ``gesture``.

    The mode switches when ``debounce`` readings in a row have asked for it: with 1, as in the paper, at once. After a
    switch ``since_ns`` is still the stamp of the first reading that asked for it.
    """
    if gesture is not SWITCHES[state.mode]:
        return ModeState(state.mode)
    asked = state.asked + 1
    since_ns = stamp_ns if state.asked == 0 else state.since_ns
    if asked < debounce:
        return ModeState(state.mode, asked, since_ns)
    return ModeState(_OTHER[state.mode], 0, since_ns)
