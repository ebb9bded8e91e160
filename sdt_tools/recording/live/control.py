"""What whoever holds the controls wants: from a key, a cockpit or another thread, to the loop."""

from dataclasses import dataclass
from enum import StrEnum
from queue import Empty, SimpleQueue


class Wish(StrEnum):
    """What can be wanted of a session."""

    START = "start"
    """A take, unless one runs."""
    STOP = "stop"
    """The take that runs ends and is kept."""
    NEXT = "next"
    """Both: the take that runs ends, the next one starts."""
    PAUSE = "pause"
    RESUME = "resume"
    TOGGLE = "toggle"
    """Pause or resume."""
    DISCARD = "discard"
    """The take that runs, or the last one kept, goes to the trash."""
    MARK = "mark"
    NOTE = "note"
    """A line for the log, about the controls themselves."""
    SAVE = "save"
    """What the ring holds is written out."""
    QUIT = "quit"
    """The take that runs is kept and the session ends."""


@dataclass(frozen=True)
class Act:
    """A wish; ``text`` is that of a mark or note, or why the ring is to be saved."""

    wish: Wish
    text: str = ""


class Control:
    """Carries wishes from any thread to the one that records, in order."""

    def __init__(self) -> None:
        self._acts: SimpleQueue[Act] = SimpleQueue()

    def want(self, wish: Wish, text: str = "") -> None:
        """Ask for ``wish``; it is heard at the next tick."""
        self._acts.put(Act(wish, text))

    def heard(self) -> list[Act]:
        """What was asked for since the last call."""
        acts: list[Act] = []
        while (act := self.wait(0.0)) is not None:
            acts.append(act)
        return acts

    def wait(self, timeout_s: float) -> Act | None:
        """The next wish, waited for; None where none comes in time."""
        try:
            return self._acts.get(timeout=timeout_s) if timeout_s > 0 else self._acts.get_nowait()
        except Empty:
            return None
