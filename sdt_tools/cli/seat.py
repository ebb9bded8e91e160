"""A person's seat before a recording: the cockpit with its hand, its drivers, and Rerun beside it."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from typing import TYPE_CHECKING

from sdt_tools.cli.keys import at_a_terminal
from sdt_tools.cli.live import Live
from sdt_tools.errors import UsageError
from sdt_tools.teleop.hand import GAMEPAD, KEYBOARD

if TYPE_CHECKING:
    from sdt_tools.config import MotionConfig
    from sdt_tools.control.controller import Controller
    from sdt_tools.protocols import Chooser, Observer
    from sdt_tools.recording.live.scene_session import MakeDriver
    from sdt_tools.scene.source import SceneSource
    from sdt_tools.teleop.cockpit import Cockpit


def in_cockpit(driver: str, asked: bool, gamepad: bool, perturb: bool) -> bool:
    """Whether the recording has a person before it. Raises UsageError where none can be, or where that cannot go."""
    by_hand = driver in (KEYBOARD, GAMEPAD)
    if not (by_hand or asked):
        if gamepad:
            raise UsageError("--gamepad needs --cockpit")
        return False
    call = f"--driver {driver}" if by_hand else "--cockpit"
    if perturb:
        raise UsageError(f"--perturb forces motions on a driver that is a program; leave it out with {call}")
    if not (at_a_terminal() and sys.stderr.isatty()):
        raise UsageError(f"{call} needs a terminal; run it in one, or choose another --driver without --cockpit")
    return True


@contextmanager
def seat(
    driver: str, title: str, how: Live, takes: bool = False, keeps_last: bool = False
) -> "Iterator[tuple[Cockpit, MakeDriver]]":
    """A cockpit and what makes its drivers. Raises UsageError where a gamepad is asked for and none is there."""
    from sdt_tools.cli.drivers import make_driver
    from sdt_tools.teleop.cockpit import Cockpit
    from sdt_tools.teleop.gamepad import open_gamepad
    from sdt_tools.teleop.hand import Hand
    from sdt_tools.teleop.takeover import ByHand, Takeover

    hand, by_hand = Hand(how.hold_s), driver in (KEYBOARD, GAMEPAD)
    cockpit = Cockpit(title, driver, hand, takes, by_hand, keeps_last)

    def make_seated(name: str, source: "SceneSource") -> "Chooser":
        cockpit.operator = source
        if by_hand:
            return ByHand(hand, name)
        takeover = Takeover(make_driver(name, source), hand)
        cockpit.driver = takeover.name
        return takeover

    with closing(open_gamepad(hand)) if how.gamepad or driver == GAMEPAD else nullcontext():
        yield cockpit, make_seated


@contextmanager
def seat_beside(
    driver: str, title: str, how: Live
) -> "Iterator[tuple[Cockpit, Callable[[Controller, SceneSource], Chooser]]]":
    """A cockpit, and what puts its hand beside a controller. Raises UsageError as ``seat``."""
    from sdt_tools.teleop.cockpit import Cockpit
    from sdt_tools.teleop.gamepad import open_gamepad
    from sdt_tools.teleop.hand import Hand
    from sdt_tools.teleop.takeover import Takeover

    hand = Hand(how.hold_s)
    cockpit = Cockpit(title, driver, hand, takes=False, by_hand=False)

    def seated(controller: "Controller", source: "SceneSource") -> "Chooser":
        cockpit.operator = source
        cockpit.driver = controller.name
        return Takeover(controller, hand)

    with closing(open_gamepad(hand)) if how.gamepad else nullcontext():
        yield cockpit, seated


def viewer_observers(wanted: bool, motions: "MotionConfig", realtime: bool) -> "Callable[[], Sequence[Observer]]":
    """Makes what streams to Rerun, for each world anew, in one window; in real time it never holds up the recording.

    Raises ViewerError where no window opens.
    """
    if not wanted:
        return tuple
    keep_rerun_quiet()
    from sdt_tools.view.aside import Aside
    from sdt_tools.view.observer import RerunObserver
    from sdt_tools.view.viewer import open_window, viewer_url

    url = viewer_url(open_window())

    def observers() -> "Sequence[Observer]":
        observer = RerunObserver.to_viewer(url, motions)
        return [Aside(observer) if realtime else observer]

    return observers


def keep_rerun_quiet() -> None:
    """To be called before Rerun is imported: what it logs of a viewer that is gone would lie across the screen."""
    os.environ.setdefault("RUST_LOG", "off")
