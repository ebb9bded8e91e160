"""The hand at the controls: which motion it holds, how fast, and whether it has stopped the robot.

A terminal tells of keys that go down, and again while they are held, but never that one is let go. So a motion holds
for a while after its key, and a key that repeats holds it on: a hand that is gone drives for no longer than that.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.emergency import EmergencyStop
from sdt_tools.frames import MotionClass

HOLD_S: Final = 0.6
"""Longer than a keyboard waits before a key that is held repeats: half a second on most."""
SPEEDS: Final = (0.25, 0.5, 0.75, 1.0)
"""Shares of a motion's twist."""
KEYBOARD: Final = "keyboard"
GAMEPAD: Final = "gamepad"
_FOR_EVER_NS: Final = 1 << 62


@dataclass(frozen=True)
class HandState:
    """What the hand did last. ``motion`` holds until ``until_ns``.

    ``stopped``: it has stopped the robot and not touched a motion since. ``emergency`` says why the emergency stop is
    latched, and is empty where it is not.
    """

    motion: MotionClass = MotionClass.STAY
    until_ns: int = 0
    device: str = KEYBOARD
    speed_step: int = len(SPEEDS) - 1
    stopped: bool = False
    emergency: str = ""

    def held(self, now_ns: int) -> MotionClass | None:
        """The motion that the hand holds at ``now_ns``; None where it holds none."""
        return self.motion if now_ns < self.until_ns and not self.emergency else None

    @property
    def speed(self) -> float:
        """The share of a motion's twist that is driven."""
        return SPEEDS[self.speed_step]


def pressed(state: HandState, motion: MotionClass, now_ns: int, hold_ns: int) -> HandState:
    """A key of ``motion`` has come at ``now_ns``: it holds for ``hold_ns``, and for half of that where it repeats."""
    if state.emergency:
        return state
    repeats = state.device == KEYBOARD and state.held(now_ns) is motion
    until_ns = now_ns + (hold_ns // 2 if repeats else hold_ns)
    return replace(state, motion=motion, until_ns=until_ns, device=KEYBOARD, stopped=False)


def steered(state: HandState, motion: MotionClass | None) -> HandState:
    """A stick is pushed towards ``motion``, which holds until it is elsewhere; None where it is let go."""
    if state.emergency:
        return state
    if motion is None:
        return replace(state, until_ns=0) if state.device == GAMEPAD else state
    return replace(state, motion=motion, until_ns=_FOR_EVER_NS, device=GAMEPAD, stopped=False)


def stopped(state: HandState) -> HandState:
    """Nothing is held any more, and whoever drives otherwise is not to, until the robot is given back."""
    return replace(state, until_ns=0, stopped=True)


def given_back(state: HandState) -> HandState:
    """Whoever drives otherwise may drive again."""
    return replace(state, until_ns=0, stopped=False)


def emergency(state: HandState, why: str) -> HandState:
    """Latched: no motion until it is released. The first reason stands."""
    return replace(state, until_ns=0, stopped=True, emergency=state.emergency or why)


def released(state: HandState) -> HandState:
    """The emergency stop is over; the robot stands until a motion is touched or it is given back."""
    return replace(state, emergency="")


def faster(state: HandState, steps: int) -> HandState:
    """Drive ``steps`` steps faster, or slower where that is negative."""
    return replace(state, speed_step=min(max(state.speed_step + steps, 0), len(SPEEDS) - 1))


class Hand:
    """The state of a hand, for those who move it and those who drive by it, each in a thread of its own.

    Its emergency stop is ``latch``, which others may pull and hear too: the base, say, with a button of its own.
    """

    def __init__(
        self,
        hold_s: float = HOLD_S,
        now_ns: Callable[[], int] = time.monotonic_ns,
        latch: EmergencyStop | None = None,
    ) -> None:
        self.state = HandState()
        self._hold_ns = round(hold_s * SECOND_NS)
        self._now_ns = now_ns
        self._lock = threading.Lock()
        self._latch = EmergencyStop() if latch is None else latch
        self._latch.tell(self._latched)

    @property
    def held(self) -> MotionClass | None:
        """The motion that is held now."""
        return self.state.held(self._now_ns())

    def press(self, motion: MotionClass) -> None:
        """A key of ``motion`` has come."""
        self._turn(lambda state: pressed(state, motion, self._now_ns(), self._hold_ns))

    def steer(self, motion: MotionClass | None) -> None:
        """A stick points at ``motion``, or at none."""
        self._turn(lambda state: steered(state, motion))

    def stop(self) -> None:
        """Stand."""
        self._turn(stopped)

    def give_back(self) -> None:
        """Let whoever drives otherwise drive."""
        self._turn(given_back)

    def stop_at_once(self, why: str) -> None:
        """Latch the emergency stop."""
        self._latch.pull(why)

    def release(self) -> None:
        """End the emergency stop."""
        self._latch.release()

    def change_speed(self, steps: int) -> None:
        """Drive faster, or slower."""
        self._turn(lambda state: faster(state, steps))

    def _latched(self, why: str) -> None:
        self._turn((lambda state: emergency(state, why)) if why else released)

    def _turn(self, turn: Callable[[HandState], HandState]) -> None:
        with self._lock:
            self.state = turn(self.state)
