"""A terminal app that says when its terminal is too small, and works as soon as it is large enough."""

import asyncio
import os
import signal
from collections.abc import Iterable
from contextlib import suppress
from typing import ClassVar, Generic, TypeVar

from textual import events
from textual.app import App
from textual.binding import BindingType
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import Static

ResultT = TypeVar("ResultT")


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

    terminated = False
    """Whether SIGTERM has ended it; the terminal is given back first."""

    def on_mount(self) -> None:
        """Listen to SIGTERM."""
        self.listen_to_signals()

    def listen_to_signals(self) -> None:
        """Have SIGTERM end the app, as quitting does."""
        with suppress(ValueError, RuntimeError):  # not in the main thread: somebody else listens
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, self._terminate)

    def _terminate(self) -> None:
        self.terminated = True
        self.exit()

    def on_resize(self, event: events.Resize) -> None:
        """Cover the app while the terminal is too small."""
        width, height = event.size
        too_small = width < self.LEAST[0] or height < self.LEAST[1]
        if too_small and not isinstance(self.screen, TooSmall):
            self.push_screen(TooSmall(self.LEAST))
        elif not too_small and isinstance(self.screen, TooSmall):
            self.pop_screen()
