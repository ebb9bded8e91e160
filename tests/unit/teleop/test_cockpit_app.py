"""The cockpit under a pilot: keys in, the hand, the controls and the screen out."""

import asyncio
import signal
from collections.abc import Awaitable, Callable
from contextlib import nullcontext
from dataclasses import replace
from time import sleep

import pytest
from cockpit_samples import PROGRESS, Clock, Operator, cockpit, recording, seen, wanted
from textual import events
from textual.pilot import Pilot
from textual.widgets import Static

from sdt_tools.errors import RunError
from sdt_tools.frames import Gesture, LogEntry, LogLevel, MotionClass, Received
from sdt_tools.recording.live.control import Wish
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.teleop.app.app import CockpitApp, drive
from sdt_tools.teleop.app.dialogs import HelpDialog, NoteDialog
from sdt_tools.teleop.app.keys import ACTIONS, GROUPS, MOTION_KEYS
from sdt_tools.teleop.app.screen import CockpitScreen
from sdt_tools.teleop.cockpit import Cockpit, Recording
from sdt_tools.terminal.app import TooSmall
from sdt_tools.terminal.line import Line

Use = Callable[[CockpitApp, Pilot], Awaitable[None]]


def use(made: Cockpit, by: Use, size: tuple[int, int] = (80, 24), work: Recording[None] | None = None) -> None:
    async def run() -> None:
        app = CockpitApp(made, work or recording())
        async with app.run_test(size=size) as pilot:
            await pilot.pause()
            await by(app, pilot)

    asyncio.run(run())


def text_of(app: CockpitApp, selector: str) -> str:
    return str(app.screen.query_one(selector, Static).render())


@pytest.mark.parametrize(("key", "motion"), [*MOTION_KEYS.items(), ("W", MotionClass.FORWARD)])
def test_each_key_drives_its_motion(key: str, motion: MotionClass) -> None:
    made = cockpit()

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press(key)
        assert made.hand.held is motion

    use(made, press)


def test_every_motion_has_a_letter_and_a_digit_and_no_key_does_two_things() -> None:
    for keys in ("qweszxc", "7895123"):
        assert {MOTION_KEYS[key] for key in keys} == set(MotionClass)
    names = [name for group in GROUPS.values() for key in group for name in key.names]
    assert len(names) == len(set(names))
    assert not set(names) & set(MOTION_KEYS)
    assert "escape" in ACTIONS


def test_a_motion_decays_when_its_key_is_not_repeated() -> None:
    clock = Clock()
    made = cockpit(clock=clock)

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press("w")
        clock.now_ns = 590_000_000
        assert made.hand.held is MotionClass.FORWARD
        clock.now_ns = 600_000_000
        assert made.hand.held is None

    use(made, press)


def test_space_stops_and_g_gives_back() -> None:
    made = cockpit("policy:follow-0")

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press("w", "space")
        assert (made.hand.held, made.hand.state.stopped) == (None, True)
        assert "g gives back to policy:follow-0" in text_of(app, "#motion")
        await pilot.press("g")
        assert not made.hand.state.stopped
        await pilot.pause(0.15)

    use(made, press)
    assert [act.text for act in wanted(made)] == [
        "stopped by hand; policy:follow-0 waits",
        "the stop by hand is over; policy:follow-0 may drive",
    ]


@pytest.mark.parametrize("opened", [[], ["?"], ["m"], ["m", "a", "b"]], ids=" ".join)
def test_the_emergency_stop_works_whatever_is_open_and_says_how_it_is_released(opened: list[str]) -> None:
    made = cockpit()

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press("w", *opened, "escape")
        await pilot.pause(0.15)
        assert isinstance(app.screen, CockpitScreen)
        assert "EMERGENCY STOP: the key Esc · ^r releases it" in text_of(app, "#heading")
        await pilot.press("w")
        assert made.hand.held is None
        assert "latched" in text_of(app, "#hints") or await pilot.pause(0.15) is None
        await pilot.press("ctrl+r", "w")
        assert made.hand.held is MotionClass.FORWARD

    use(made, press)


def test_in_a_terminal_that_is_too_small_one_can_still_stop() -> None:
    made = cockpit()

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press("w")
        await pilot.resize_terminal(60, 20)
        await pilot.pause()
        assert isinstance(app.screen, TooSmall)
        await pilot.press("w", "space")
        assert made.hand.state.stopped
        await pilot.press("escape")
        assert made.hand.state.emergency
        await pilot.resize_terminal(160, 50)
        await pilot.pause()
        assert isinstance(app.screen, CockpitScreen)
        assert app.screen.has_class("wide")

    use(made, press)


def test_takes_marks_and_notes_are_wanted() -> None:
    made = cockpit()

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press("t")
        made.watch.tell(PROGRESS)
        await pilot.press("t", "n", "v", "ctrl+x", "m")
        assert isinstance(app.screen, NoteDialog)
        await pilot.press("d", "o", "o", "r", "enter", "m", "enter", "ctrl+q")

    use(made, press)
    assert [(act.wish, act.text) for act in wanted(made)] == [
        (Wish.START, ""),
        (Wish.STOP, ""),
        (Wish.NEXT, ""),
        (Wish.TOGGLE, ""),
        (Wish.DISCARD, ""),
        (Wish.MARK, "mark 1"),
        (Wish.MARK, "mark 1: door"),
        (Wish.MARK, "mark 2"),
        (Wish.QUIT, ""),
    ]


@pytest.mark.parametrize("opened", ["m", "?"])
def test_enter_that_repeats_closes_what_is_open_and_nothing_below(opened: str) -> None:
    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press(opened)
        dialog = app.screen
        for _ in range(3):  # all before it has closed
            if isinstance(dialog, HelpDialog):
                dialog.action_close()
            else:
                await dialog.query_one(Line).on_key(events.Key("enter", None))
        await pilot.pause()
        assert isinstance(app.screen, CockpitScreen)

    use(cockpit(), press)


def test_one_recording_has_no_takes() -> None:
    made = cockpit(takes=False)

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press("t", "n", "ctrl+x", "k")
        await pilot.pause(0.15)
        assert "begin with --keep-last" in text_of(app, "#hints")

    use(made, press)
    assert wanted(made) == []


def test_the_operator_is_asked_for_gestures_where_there_is_one() -> None:
    made = cockpit()
    operator = made.operator
    assert isinstance(operator, Operator)

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press("o", "p", "i")
        made.operator = None
        await pilot.press("o")
        await pilot.pause(0.15)
        assert "no simulated operator" in text_of(app, "#hints")

    use(made, press)
    assert operator.shown == [Gesture.ENABLE, Gesture.DISABLE, Gesture.IDLE]


def test_what_passes_is_shown() -> None:
    clock = Clock()
    made = cockpit("policy:follow-0", clock=clock)
    seen(made, clock, motion=MotionClass.BACKWARD, intervention=True)

    async def look(app: CockpitApp, pilot: Pilot) -> None:
        assert "REC" in text_of(app, "#heading")
        assert "disk 3.2 h" in text_of(app, "#heading")
        assert "keyboard  over policy:follow-0" in text_of(app, "#motion")
        assert "-0.40 m/s +0.00 rad/s" in text_of(app, "#motion")
        assert "enable, wants active" in text_of(app, "#motion")
        assert "scans      50.0/s" in text_of(app, "#streams")
        assert "images     29.8/s" in text_of(app, "#streams")
        made.watch.observe(Received(0, LogEntry(0, LogLevel.ERROR, "the LiDAR is gone")))
        made.watch.tell(replace(PROGRESS, disk_left_s=60.0, dropped=3))
        await pilot.pause(0.15)
        assert "the LiDAR is gone" in text_of(app, "#messages")
        assert "DISK FULL IN 1.0 min" in text_of(app, "#heading")
        assert "dropped 3" in text_of(app, "#streams")
        await pilot.press("?")
        assert isinstance(app.screen, HelpDialog)

    use(made, look)


def test_the_cockpit_ends_when_the_recording_has() -> None:
    made, work = cockpit(), recording()

    async def wait(app: CockpitApp, pilot: Pilot) -> None:
        work.start()
        work.result()
        await pilot.pause(0.3)
        assert not app.is_running or app._exit

    use(made, wait, work=work)


def test_asking_twice_to_quit_does_not_wait() -> None:
    made, work = cockpit(), recording()

    async def press(app: CockpitApp, pilot: Pilot) -> None:
        await pilot.press("ctrl+q")
        assert work.interrupt.signal is None
        await pilot.press("ctrl+c")
        assert work.interrupt.signal == signal.SIGINT

    use(made, press, work=work)


@pytest.fixture
def _a_terminal_that_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sdt_tools.teleop.app.app.hangup_watched", lambda _gone: nullcontext())


def until_told(interrupt: Interrupt) -> str:
    """A recording that goes on until somebody wants its end."""
    while not interrupt.requested:
        sleep(0.01)
    return "whole"


@pytest.mark.usefixtures("_a_terminal_that_stays")
def test_a_screen_that_fails_fails_the_recording_which_is_told_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[BaseException] = []

    def work(interrupt: Interrupt) -> str:
        try:
            return until_told(interrupt)
        except RunError as failure:
            told.append(failure)
            raise

    def fail(self: CockpitApp) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(CockpitApp, "run", fail)
    with pytest.raises(RunError, match=r"the cockpit failed [(]ZeroDivisionError: a bug"):
        drive(cockpit(), work)
    assert len(told) == 1


@pytest.mark.usefixtures("_a_terminal_that_stays")
def test_a_recording_that_fails_says_so_when_the_screen_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    def work(_interrupt: Interrupt) -> str:
        raise RunError("the LiDAR is gone")

    monkeypatch.setattr(CockpitApp, "run", lambda _: None)
    with pytest.raises(RunError, match="the LiDAR is gone"):
        drive(cockpit(), work)


@pytest.mark.usefixtures("_a_terminal_that_stays")
def test_a_screen_that_is_left_ends_the_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(CockpitApp, "run", lambda _: None)
    assert drive(cockpit(), until_told) == "whole"
