"""What the cockpit's screen and the recording share, and a recording that runs beside the screen."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from sdt_tools.protocols import Gesturing
from sdt_tools.recording.live.control import Control
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.teleop.hand import Hand
from sdt_tools.teleop.watch import Watch

ResultT_co = TypeVar("ResultT_co", covariant=True)


@dataclass
class Cockpit:
    """One robot and whoever sits before it.

    ``title`` names what is recorded, ``driver`` who drives while no hand does. ``takes``: take after take, or one file.
    """

    title: str
    driver: str
    hand: Hand
    takes: bool
    by_hand: bool = True
    """Whether nobody but the hand drives."""
    keeps_last: bool = False
    """Whether the last seconds are held in memory, to be saved at a key."""
    watch: Watch = field(default_factory=Watch)
    control: Control = field(default_factory=Control)
    operator: Gesturing | None = None
    """Whose gestures can be asked for; it changes where one world follows another."""


class Recording(Generic[ResultT_co]):
    """A recording in a thread of its own: ``work`` is told of signals and failures by the interrupt."""

    def __init__(self, work: Callable[[Interrupt], ResultT_co], interrupt: Interrupt) -> None:
        self.interrupt = interrupt
        self._work = work
        self._result: list[ResultT_co] = []
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="recording")

    @property
    def done(self) -> bool:
        """Whether it has ended, its file closed."""
        return self._thread.ident is not None and not self._thread.is_alive()

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def result(self) -> ResultT_co:
        """Wait for the end; what came of it. Raises what it raised."""
        self._thread.join()
        if self._failure is not None:
            raise self._failure
        return self._result[0]

    def _run(self) -> None:
        try:
            self._result.append(self._work(self.interrupt))
        except BaseException as failure:  # raised again by whoever asks for the result
            self._failure = failure
