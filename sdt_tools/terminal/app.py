"""A terminal app that says when its terminal is too small, and works as soon as it is large enough."""

import asyncio
import os
import signal
from collections.abc import Iterable
from contextlib import suppress
from typing import ClassVar, Final, Generic, TypeVar

from textual import events
from textual.app import App
from textual.binding import BindingType
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import Input, Static

from sdt_tools.terminal.hangup import LastingDriver

ResultT = TypeVar("ResultT")

_LOOK_S: Final = 0.005


def follow_the_terminal() -> None:
    """Forget a size that the environment tells: beside it the terminal's own, which changes, would not be asked for."""
    for name in ("COLUMNS", "LINES"):
        os.environ.pop(name, None)


class TooSmall(ModalScreen[None]):
    """Covers everything, and takes every key but those that quit."""

    CSS = """
    TooSmall { align: center middle; background: #101218; }
    TooSmall Static { width: auto; text-align: center; color: #ffd05c; }
    """

    def __init__(self, least: tuple[int, int]) -> None:
        super().__init__()
        self._least = least

    def compose(self) -> Iterable[Widget]:
        """One sentence."""
        yield Static(self._words(), markup=False)

    def on_resize(self) -> None:
        """Say it anew."""
        self.query_one(Static).update(self._words())

    def _words(self) -> str:
        (width, height), (columns, lines) = self.app.size, self._least
        return f"{width} × {height} is too small\n{columns} × {lines} is needed\nenlarge it · ^q quits"


class TerminalApp(App[ResultT], Generic[ResultT]):
    """An app for terminals of ``LEAST`` columns and lines or more."""

    LEAST: ClassVar[tuple[int, int]] = (80, 24)
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [("ctrl+c", "quit")]

    URGENT: ClassVar[frozenset[str]] = frozenset()
    """Keys that do not wait until those before them are done with."""

    ended_by: signal.Signals | None = None
    """SIGTERM or SIGHUP, where that has ended it. The terminal is given back first, if it is still there."""

    def __init__(self) -> None:
        super().__init__(driver_class=LastingDriver)
        self._loop_of_app: asyncio.AbstractEventLoop | None = None

    def hung_up(self) -> None:
        """End the app, for its terminal is gone. For any thread."""
        if self._loop_of_app is not None:
            with suppress(RuntimeError):  # it has ended
                self._loop_of_app.call_soon_threadsafe(self._end_by, signal.SIGHUP)

    def on_mount(self) -> None:
        """Listen to SIGTERM, and to keys."""
        self._loop_of_app = asyncio.get_running_loop()
        self.listen_to_signals()
        self._typed: asyncio.Queue[events.Key] = asyncio.Queue()
        self.run_worker(self._take_keys())

    async def on_event(self, event: events.Event) -> None:
        """Keys wait for those before them."""
        if isinstance(event, events.Key) and not event.is_forwarded and event.key not in self.URGENT:
            self._typed.put_nowait(event)
        else:
            await super().on_event(event)

    async def _take_keys(self) -> None:
        """One key after the other, each to what the one before it has opened or closed.

        A terminal that was late, as over a slow connection, sends many at once: none of a note may reach the screen
        below, where it means something else.
        """
        while True:
            key = await self._typed.get()
            while not self.screen.is_mounted or self._opens():
                await asyncio.sleep(_LOOK_S)
            screen, target = self.screen, self.focused or self.screen
            await super().on_event(key)
            done = asyncio.Event()
            target.call_later(done.set)
            while not done.is_set() and screen is self.screen:
                with suppress(TimeoutError):
                    await asyncio.wait_for(done.wait(), _LOOK_S)

    def _opens(self) -> bool:
        """Whether the screen has something to type in that does not listen yet."""
        return self.focused is None and bool(self.screen.query(Input))

    def listen_to_signals(self) -> None:
        """Have SIGTERM end the app, as quitting does."""
        with suppress(ValueError, RuntimeError):  # not in the main thread: somebody else listens
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, self._end_by, signal.SIGTERM)

    def _end_by(self, number: signal.Signals) -> None:
        self.ended_by = self.ended_by or number
        self.exit()

    def on_resize(self, event: events.Resize) -> None:
        """Cover the app while the terminal is too small."""
        width, height = event.size
        too_small = width < self.LEAST[0] or height < self.LEAST[1]
        if too_small and not isinstance(self.screen, TooSmall):
            self.push_screen(TooSmall(self.LEAST))
        elif not too_small and isinstance(self.screen, TooSmall):
            self.pop_screen()
