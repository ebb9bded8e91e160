"""The cockpit as a whole: the screen in the main thread, the recording in one of its own."""

import signal
from collections.abc import Callable
from typing import ClassVar, TypeVar

from textual import events
from textual.binding import Binding, BindingType

from sdt_tools.errors import RunError
from sdt_tools.recording.live.control import Wish
from sdt_tools.recording.live.interrupt import Interrupt, deferred_interrupt
from sdt_tools.teleop.app.dialogs import HelpDialog, NoteDialog
from sdt_tools.teleop.app.screen import SHOW_S, CockpitScreen
from sdt_tools.teleop.cockpit import Cockpit, Recording
from sdt_tools.terminal.app import TerminalApp, follow_the_terminal
from sdt_tools.terminal.hangup import hangup_watched

ResultT = TypeVar("ResultT")


class CockpitApp(TerminalApp[None]):
    """Shows ``cockpit`` until ``recording`` is done. Esc stops the robot whatever is open over the screen."""

    TITLE = "sdt record"
    URGENT = frozenset({"escape"})
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "emergency", priority=True)]

    def __init__(self, cockpit: Cockpit, recording: Recording[object]) -> None:
        super().__init__()
        self._recording = recording
        self._cockpit = cockpit
        self._seat = CockpitScreen(cockpit)
        self._asked_to_quit = False

    def on_mount(self) -> None:
        """Begin."""
        self.push_screen(self._seat)
        self.set_interval(SHOW_S, self._look)

    def listen_to_signals(self) -> None:
        """Leave them to ``deferred_interrupt``, which does not wait for the screen."""

    def on_key(self, event: events.Key) -> None:
        """Space stops too while the terminal is too small to show anything."""
        if event.key == "space":
            self._cockpit.hand.stop()

    def action_emergency(self) -> None:
        """Latch the emergency stop, and let the cockpit be seen."""
        self._seat.action_emergency()
        if isinstance(self.screen, HelpDialog | NoteDialog):
            self.pop_screen()

    async def action_quit(self) -> None:
        """End the recording in order; asked twice, without waiting for anything."""
        if self._asked_to_quit:
            self._recording.interrupt.signal = signal.SIGINT
        self._asked_to_quit = True
        self._cockpit.control.want(Wish.QUIT)

    def _look(self) -> None:
        if self._recording.done:
            self.exit()


def drive(cockpit: Cockpit, record: Callable[[Interrupt], ResultT]) -> ResultT:
    """Run ``record`` with the cockpit before it, on this terminal; what came of it.

    The recording does not depend on the screen. Where the terminal hangs up, a signal comes or the screen fails, it is
    told at once, stops the robot and closes its file; then this returns, or raises what ``record`` raises, RunError
    where the screen has failed.
    """
    follow_the_terminal()
    with deferred_interrupt() as interrupt:
        recording = Recording(record, interrupt)
        app = CockpitApp(cockpit, recording)

        def hung_up() -> None:
            interrupt.signal = interrupt.signal or signal.SIGHUP

        with hangup_watched(hung_up):
            recording.start()
            try:
                app.run()
            except BaseException as failure:
                interrupt.failure = RunError(f"the cockpit failed ({type(failure).__name__}: {failure})")
                raise
            finally:
                if app.return_code:
                    interrupt.failure = RunError("the cockpit failed; the robot was stopped")
                elif not recording.done:
                    interrupt.signal = interrupt.signal or signal.SIGINT
                result = recording.result()
    return result
