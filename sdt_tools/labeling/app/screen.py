"""The labeling app's screen: each key leads to a turn, the turn is written, then it is shown."""

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import ClassVar, Final

import numpy as np
from rich.text import Text
from textual import events
from textual.binding import BindingType
from textual.containers import Container
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Static

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import MotionConfig
from sdt_tools.errors import SdtError
from sdt_tools.frames import MotionClass, Twist
from sdt_tools.labeling.app import state as turns
from sdt_tools.labeling.app.desk import Beside, Desk
from sdt_tools.labeling.app.dialogs import HelpDialog, JumpDialog, ReviewDialog
from sdt_tools.labeling.app.keys import ACTIONS, class_of
from sdt_tools.labeling.app.state import State, Turn
from sdt_tools.labeling.app.strip import BRIGHT, CONFLICT, TimelineStrip, color_of
from sdt_tools.labeling.app.words import HINTS, class_table, frame_words, heading
from sdt_tools.labeling.frame_labels import UNSAID
from sdt_tools.labeling.review import ReviewItem
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.terminal.picture_view import PictureView
from sdt_tools.terminal.raster import style
from sdt_tools.terminal.scan_view import ScanView

TICK_S: Final = 0.05
"""While it plays, the frame moves on so often."""
NEWS_S: Final = 0.5
"""So often the journal is looked at for what others have written."""
SLOW: Final = 0.25
FASTEST: Final = 16.0
WIDE: Final = 120


class LabelingScreen(Screen[None]):
    """One recording being labelled."""

    BINDINGS: ClassVar[list[BindingType]] = [("ctrl+c", "app.quit")]
    CSS = """
    LabelingScreen { background: #101218; color: #d8dce4; }
    LabelingScreen .line { height: 1; }
    #hints { background: #1a1e28; color: #78808e; }
    #main { layout: grid; grid-size: 3 2; grid-columns: 1fr 24 28; grid-rows: 9 1fr; height: 1fr; }
    #scan { row-span: 2; }
    #classes { row-span: 2; }
    #classes, #said { height: 100%; }
    LabelingScreen.wide #main { grid-columns: 1fr 34 1fr; grid-rows: 1fr 13; grid-gutter: 0 1; }
    LabelingScreen.wide #picture { column-span: 2; }
    LabelingScreen.wide #classes { row-span: 1; }
    """

    def __init__(self, desk: Desk, beside: Beside | None = None, now_ns: Callable[[], int] = time.time_ns) -> None:
        super().__init__()
        self._desk = desk
        self._beside = beside
        self._now_ns = now_ns
        self.state: State = desk.opened
        self._shown: tuple[int, int] | None = None
        self._playing_ns = 0.0
        self._alarm = False

    def compose(self) -> Iterable[Widget]:
        """Heading, the frame and what is said of it, the recording in time, a message, keys."""
        yield Static(id="heading", classes="line", markup=False)
        with Container(id="main"):
            yield ScanView(id="scan")
            yield PictureView(id="picture")
            yield Static(id="classes", markup=False)
            yield Static(id="said", markup=False)
        yield TimelineStrip(id="strip")
        yield Static(id="message", classes="line", markup=False)
        yield Static(HINTS, id="hints", classes="line", markup=False)

    def on_mount(self) -> None:
        """Show the frame that one left at, and begin to listen."""
        self._player = self.set_interval(TICK_S, self._play_on, pause=True)
        self.set_interval(NEWS_S, self.listen)
        self._show()

    def on_resize(self, event: events.Resize) -> None:
        """Use the room there is."""
        self.set_class(event.size.width >= WIDE, "wide")
        self.call_after_refresh(self._show)

    async def on_key(self, event: events.Key) -> None:
        """Give a class, or do what the key is for."""
        names = [name for name in (event.character, event.key) if name]
        number = next((found for name in names if (found := class_of(name, self._kind)) is not None), None)
        if number is not None:
            event.stop()
            self._take(turns.label(self.state, number, self._now_ns()))
            return
        action = next((ACTIONS[name] for name in names if name in ACTIONS), None)
        if action is not None:
            event.stop()
            await self.run_action(action)

    def listen(self) -> None:
        """Take in what other labelers have written."""
        try:
            news = self._desk.catch_up(self.state)
        except SdtError as error:
            self._alarmed(error)
            return
        if news is not self.state:
            self.state = news
            self._show()

    # --- what the keys of the table do ------------------------------------------------------------------------------

    def action_step(self, by: int) -> None:
        """Go on, or back."""
        self._take(turns.step(self.state, by, self._now_ns()))

    def action_first(self) -> None:
        """Go to the beginning."""
        self._take(turns.go_to(self.state, 0))

    def action_last(self) -> None:
        """Go to the end."""
        self._take(turns.go_to(self.state, len(self.state.labels) - 1))

    def action_unlabelled(self) -> None:
        """Go to the next frame that one has not labelled."""
        self._to_next(self.state.mine == UNSAID, "frame without your label", backward=False, runs=False)

    def action_unlabelled_before(self) -> None:
        """The same, back."""
        self._to_next(self.state.mine == UNSAID, "frame without your label", backward=True, runs=False)

    def action_disagreement(self) -> None:
        """Go to where the next disagreement begins."""
        self._to_next(self.state.disagreeing, "disagreement", backward=False, runs=True)

    def action_disagreement_before(self) -> None:
        """The same, back."""
        self._to_next(self.state.disagreeing, "disagreement", backward=True, runs=True)

    def action_suspect(self) -> None:
        """Go to the next suspect label."""
        self._to_next(self.state.suspect, "suspect label", backward=False, runs=False)

    def action_suspect_before(self) -> None:
        """The same, back."""
        self._to_next(self.state.suspect, "suspect label", backward=True, runs=False)

    def action_withdraw(self) -> None:
        """Take the label away."""
        self._take(turns.label(self.state, UNSAID, self._now_ns()))

    def action_accept(self) -> None:
        """Make the pre-label one's own."""
        self._take(turns.accept(self.state, self._now_ns()))

    def action_settle(self) -> None:
        """Ask for the class that settles a conflict."""
        self._take(turns.ask_to_settle(self.state))

    def action_range(self) -> None:
        """Begin a range."""
        self._take(turns.toggle_range(self.state))

    def action_carry(self) -> None:
        """Carry forward."""
        self._take(turns.toggle_carry(self.state))

    def action_undo(self) -> None:
        """Undo."""
        self._take(turns.undo(self.state))

    def action_redo(self) -> None:
        """Do again."""
        self._take(turns.redo(self.state))

    def action_let_go(self) -> None:
        """Give up what was begun."""
        self._take(turns.let_go(self.state))

    def action_play(self) -> None:
        """Play, or stop."""
        self._play(0.0 if self.state.speed else 1.0)

    def action_play_slowly(self) -> None:
        """Play slowly, or stop."""
        self._play(0.0 if self.state.speed == SLOW else SLOW)

    def action_faster(self) -> None:
        """Play twice as fast."""
        self._play(min((self.state.speed or 1.0) * 2.0, FASTEST))

    def action_slower(self) -> None:
        """Play half as fast."""
        self._play(max((self.state.speed or 1.0) / 2.0, 1.0 / FASTEST))

    def action_zoom(self, by: int) -> None:
        """See nearer, or further."""
        self.query_one(ScanView).zoom(by)

    def action_jump(self) -> None:
        """Ask where to go."""
        self._play(0.0)
        self.app.push_screen(JumpDialog(self.state), self._jump)

    def action_review(self) -> None:
        """List what is in doubt."""
        self._play(0.0)
        self.app.push_screen(ReviewDialog(self.state), self._review)

    def action_help(self) -> None:
        """Show the keys."""
        self._play(0.0)
        self.app.push_screen(HelpDialog(self._kind))

    def action_quit(self) -> None:
        """End."""
        self.app.exit()

    # --- turns ------------------------------------------------------------------------------------------------------

    @property
    def _kind(self) -> LabelKind:
        return self.state.labels.kind

    def _take(self, turn: Turn) -> None:
        """Write what the turn does, then show it; where it cannot be written nothing has changed."""
        try:
            self.state = self._desk.perform(turn)
        except SdtError as error:
            self._alarmed(error)
            return
        self._alarm = False
        self._show()

    def _alarmed(self, error: SdtError) -> None:
        self.state = replace(self.state, speed=0.0, words=str(error))
        self._player.pause()
        self._alarm = True
        self._show()

    def _to_next(self, marks: np.ndarray, what: str, *, backward: bool, runs: bool) -> None:
        self._take(turns.go_to_next(self.state, marks, what, backward=backward, runs=runs))

    def _jump(self, row: int | None) -> None:
        if row is not None:
            self._take(turns.go_to(self.state, row))

    def _review(self, item: ReviewItem | None) -> None:
        if item is not None:
            self._take(turns.select(self.state, item.first, item.last))

    def _play(self, speed: float) -> None:
        self.state = replace(self.state, speed=speed)
        self._playing_ns = float(self.state.labels.stamps_ns[self.state.cursor])
        if speed:
            self._player.resume()
        else:
            self._player.pause()
        self._show()

    def _play_on(self) -> None:
        state = self.state
        stamps_ns = state.labels.stamps_ns
        here_ns = float(stamps_ns[state.cursor])
        if not state.speed or state.cursor == len(stamps_ns) - 1:
            self._play(0.0)
            return
        # someone has gone elsewhere meanwhile: play on from there
        gone = not here_ns <= self._playing_ns <= float(stamps_ns[state.cursor + 1])
        self._playing_ns = (here_ns if gone else self._playing_ns) + TICK_S * state.speed * SECOND_NS
        row = int(np.searchsorted(stamps_ns, self._playing_ns, side="right")) - 1
        if row > state.cursor:
            self._take(turns.step(state, row - state.cursor, self._now_ns()))

    # --- showing ----------------------------------------------------------------------------------------------------

    def _show(self) -> None:
        state = self.state
        width = self.size.width
        if not width:
            return
        classes = self.query_one("#classes", Static)
        self.query_one("#heading", Static).update(heading(state, self._desk.task.recording.stem, width), layout=False)
        classes.update(class_table(state, max(classes.size.width, 28)), layout=False)
        self.query_one("#said", Static).update(frame_words(state), layout=False)
        self.query_one("#strip", TimelineStrip).show(state)
        message = Text(f" {state.words}", style(CONFLICT if self._alarm else BRIGHT), no_wrap=True, overflow="ellipsis")
        self.query_one("#message", Static).update(message, layout=False)
        self._show_frame()

    def _show_frame(self) -> None:
        state = self.state
        stamp_ns, number = int(state.labels.stamps_ns[state.cursor]), int(state.mine[state.cursor])
        if self._shown == (stamp_ns, number):
            return
        scan_view, picture_view = self.query_one("#scan", ScanView), self.query_one("#picture", PictureView)
        try:
            words = "no scan near this frame" if self._desk.has_scans else "no scans in this recording"
            scan_view.show(self._desk.scan_at(stamp_ns), self._motion(number), words)
        except SdtError:
            scan_view.show(None, words="this scan is damaged")
        try:
            words = "no picture near" if self._desk.has_images else "no camera"
            picture_view.show(self._desk.image_at(stamp_ns), words)
        except SdtError:
            picture_view.show(None, words="damaged")
        if self._beside is not None and (self._shown is None or self._shown[0] != stamp_ns):
            self._show_beside(stamp_ns)
        self._shown = stamp_ns, number

    def _motion(self, number: int) -> tuple[Twist, tuple[int, int, int]] | None:
        """The arrow of the label: where the robot would go."""
        if self._kind is not LabelKind.MOTION or number == UNSAID:
            return None
        return MotionConfig().twist(MotionClass(number)), color_of(self.state, number)

    def _show_beside(self, stamp_ns: int) -> None:
        assert self._beside is not None
        try:
            self._beside.show(self._desk.messages_at(stamp_ns), stamp_ns)
        except SdtError as error:
            self._beside = None
            self.query_one("#message", Static).update(Text(f" {error}", style(CONFLICT), no_wrap=True), layout=False)
