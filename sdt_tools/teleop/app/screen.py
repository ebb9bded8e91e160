"""The cockpit's screen: keys move the hand and say what is wanted; ten times a second the newest is shown."""

from collections.abc import Iterable
from typing import ClassVar, Final

from rich.text import Text
from textual import events
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Static

from sdt_tools.class_colors import MOTIONS
from sdt_tools.frames import Gesture, LidarScan, MotionClass, MotionCommand
from sdt_tools.recording.live.control import Wish
from sdt_tools.teleop.app.dialogs import HelpDialog, NoteDialog
from sdt_tools.teleop.app.keys import ACTIONS, MOTION_KEYS
from sdt_tools.teleop.app.words import BRIGHT, DIM, changes, heading, ink, messages, motion_panel, streams_panel
from sdt_tools.teleop.cockpit import Cockpit
from sdt_tools.terminal.picture_view import PictureView
from sdt_tools.terminal.scan_view import ScanView

SHOW_S: Final = 0.1
"""The screen is renewed so often; driving does not wait for it."""
WORDS_TICKS: Final = 40
WIDE: Final = 120
HINTS: Final = " ? keys  qwe s zxc drive  Space stop  Esc EMERGENCY  t take  m mark  ^q quit"


class CockpitScreen(Screen[None]):
    """One robot, seen and driven."""

    BINDINGS: ClassVar[list[BindingType]] = [("ctrl+c", "app.quit")]
    CSS = """
    CockpitScreen { background: #101218; color: #d8dce4; }
    CockpitScreen Static { text-wrap: nowrap; text-overflow: ellipsis; }
    CockpitScreen .line { height: 1; }
    #hints { background: #1a1e28; }
    #main { height: 1fr; }
    #side { width: 38; }
    #picture { height: 1fr; }
    #motion { height: 7; }
    #streams { height: 5; }
    #messages { height: 2; }
    CockpitScreen.wide #side { width: 39%; }
    CockpitScreen.wide #messages { height: 15%; }
    """

    def __init__(self, cockpit: Cockpit) -> None:
        super().__init__()
        self._cockpit = cockpit
        self._hand = cockpit.hand.state
        self._drawn: tuple[LidarScan | None, MotionCommand | None] = (None, None)
        self._words = ""
        self._words_left = 0
        self._marks = 0

    def compose(self) -> Iterable[Widget]:
        """Heading; scan, picture, motion, streams; messages; keys."""
        yield Static(id="heading", classes="line", markup=False)
        with Horizontal(id="main"):
            yield ScanView(id="scan")
            with Vertical(id="side"):
                yield PictureView(id="picture")
                yield Static(id="motion", markup=False)
                yield Static(id="streams", markup=False)
        yield Static(id="messages", markup=False)
        yield Static(id="hints", classes="line", markup=False)

    def on_mount(self) -> None:
        """Begin to show."""
        self.set_interval(SHOW_S, self.show)
        self.show()

    def on_resize(self, event: events.Resize) -> None:
        """Use the room there is."""
        self.set_class(event.size.width >= WIDE, "wide")
        self.call_after_refresh(self.show)

    async def on_key(self, event: events.Key) -> None:
        """Drive, or do what the key is for."""
        names = [name for name in (event.character, event.key) if name]
        motion = next((MOTION_KEYS[name.lower()] for name in names if name.lower() in MOTION_KEYS), None)
        if motion is not None:
            event.stop()
            self._drive(motion)
            return
        action = next((ACTIONS[name] for name in names if name in ACTIONS), None)
        if action is not None:
            event.stop()
            await self.run_action(action)
            self.show()

    def show(self) -> None:
        """Show the newest of everything."""
        if not self.is_mounted:
            return
        cockpit, view, width = self._cockpit, self._cockpit.watch.view(), self.size.width
        if not width:
            return
        self._tell_changes()
        self.query_one("#heading", Static).update(heading(cockpit, view, width), layout=False)
        self.query_one("#motion", Static).update(motion_panel(cockpit, view), layout=False)
        self.query_one("#streams", Static).update(streams_panel(view), layout=False)
        lines = self.query_one("#messages", Static)
        lines.update(messages(view, lines.size.height, width), layout=False)
        self._words_left = max(self._words_left - 1, 0)
        hint = Text(f" {self._words}", ink(BRIGHT)) if self._words_left else Text(HINTS, ink(DIM))
        self.query_one("#hints", Static).update(hint, layout=False)
        if (view.scan, view.command) != self._drawn:
            self._drawn = view.scan, view.command
            command = view.command
            arrow = (
                None
                if command is None or command.motion is MotionClass.STAY
                else (command.twist, MOTIONS[command.motion.label])
            )
            self.query_one(ScanView).show(view.scan, arrow, "no scan yet")
        self.query_one(PictureView).show(view.image, "no picture")

    # --- what the keys of the table do ------------------------------------------------------------------------------

    def action_stop(self) -> None:
        """Stand."""
        self._cockpit.hand.stop()
        self._say("stopped" if self._cockpit.by_hand else f"stopped; g gives back to {self._cockpit.driver}")

    def action_emergency(self) -> None:
        """Latch the emergency stop."""
        self._cockpit.hand.stop_at_once("the key Esc")
        self._say("emergency stop; ^r releases it")

    def action_release(self) -> None:
        """Release it."""
        was_latched = bool(self._cockpit.hand.state.emergency)
        self._cockpit.hand.release()
        by_hand = self._cockpit.by_hand
        after = "drive on with any motion" if by_hand else f"a motion drives on, g gives back to {self._cockpit.driver}"
        self._say(f"released; {after}" if was_latched else "there is no emergency stop to release")

    def action_give_back(self) -> None:
        """Let the policy drive."""
        if self._cockpit.by_hand:
            self._say("you are the only driver")
        elif self._cockpit.hand.state.emergency:
            self._say("the emergency stop is latched; ^r releases it first")
        else:
            self._cockpit.hand.give_back()
            self._say(f"{self._cockpit.driver} drives")

    def action_speed(self, steps: int) -> None:
        """Change the speed."""
        self._cockpit.hand.change_speed(steps)
        self._say(f"your speed is {self._cockpit.hand.state.speed:.0%}")

    def action_take(self) -> None:
        """Start a take, or end it."""
        progress = self._cockpit.watch.view().progress
        runs = progress is not None and progress.running
        self._want_take(Wish.STOP if runs else Wish.START, "the take ends" if runs else "a take starts")

    def action_next_take(self) -> None:
        """The next take."""
        self._want_take(Wish.NEXT, "the next take")

    def action_discard(self) -> None:
        """To the trash."""
        self._want_take(Wish.DISCARD, "discarded to the trash")

    def action_pause(self) -> None:
        """Pause, or resume."""
        self._cockpit.control.want(Wish.TOGGLE)

    def action_save(self) -> None:
        """Save the last seconds."""
        if self._cockpit.keeps_last:
            self._cockpit.control.want(Wish.SAVE)
            self._say("the last seconds are being saved")
        else:
            self._say("nothing is held in memory; begin with --keep-last")

    def action_mark(self) -> None:
        """Mark the moment, then ask for a note on it."""
        self._marks += 1
        mark = f"mark {self._marks}"
        self._cockpit.control.want(Wish.MARK, mark)

        def note(text: str | None) -> None:
            if text:
                self._cockpit.control.want(Wish.MARK, f"{mark}: {text}")

        self.app.push_screen(NoteDialog(mark), note)

    def action_gesture(self, name: str) -> None:
        """Ask the operator for a gesture."""
        operator = self._cockpit.operator
        if operator is None:
            self._say("no simulated operator is here")
        else:
            operator.show(Gesture[name])
            self._say(f"the operator shows {name.lower()}")

    def action_zoom(self, by: int) -> None:
        """See nearer, or further."""
        self.query_one(ScanView).zoom(by)

    def action_help(self) -> None:
        """Show the keys."""
        self.app.push_screen(HelpDialog())

    async def action_quit(self) -> None:
        """End."""
        await self.app.action_quit()

    # ----------------------------------------------------------------------------------------------------------------

    def _drive(self, motion: MotionClass) -> None:
        if self._cockpit.hand.state.emergency:
            self._say("the emergency stop is latched; ^r releases it")
        self._cockpit.hand.press(motion)

    def _want_take(self, wish: Wish, words: str) -> None:
        if self._cockpit.takes:
            self._cockpit.control.want(wish)
            self._say(words)
        else:
            self._say("this is one recording, ^q ends it; takes need --session")

    def _say(self, words: str) -> None:
        self._words, self._words_left = words, WORDS_TICKS

    def _tell_changes(self) -> None:
        """Have the log say what the hand has done, whichever device it was."""
        before, self._hand = self._hand, self._cockpit.hand.state
        for text in changes(before, self._hand, self._cockpit.driver, self._cockpit.by_hand):
            self._cockpit.control.want(Wish.NOTE, text)
