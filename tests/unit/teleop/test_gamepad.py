"""A gamepad's events become what a hand does; one that goes away stops the robot."""

import builtins
import math
import re
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from queue import SimpleQueue
from types import ModuleType, SimpleNamespace

import pytest

from sdt_tools.errors import UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.teleop import gamepad
from sdt_tools.teleop.gamepad import (
    ABS_HAT0X,
    ABS_HAT0Y,
    ABS_X,
    ABS_Y,
    BTN_EAST,
    BTN_NORTH,
    BTN_SOUTH,
    BTN_START,
    BTN_TL,
    BTN_TR,
    EV_ABS,
    EV_KEY,
    Axis,
    Gamepad,
    Stick,
    moved,
    open_gamepad,
)
from sdt_tools.teleop.hand import Hand

AXES = {ABS_X: Axis(-32768, 32767), ABS_Y: Axis(-32768, 32767)}


@dataclass
class Event:
    type: int
    code: int
    value: int


@dataclass
class FakePad:
    """Events from a queue; an exception among them is raised."""

    name: str = "a pad"
    path: str = "/dev/input/event0"
    events: SimpleQueue[Event | Exception] = field(default_factory=SimpleQueue)
    closed: bool = False

    def read_loop(self) -> Iterator[Event]:
        while True:
            event = self.events.get()
            if isinstance(event, Exception):
                raise event
            yield event

    def close(self) -> None:
        self.closed = True
        self.events.put(OSError("closed"))

    def capabilities(self, absinfo: bool = True) -> dict[int, list[object]]:
        info = SimpleNamespace(min=0, max=255)
        axes: list[object] = [(ABS_X, info), (ABS_Y, info)] if absinfo else [ABS_X, ABS_Y]
        return {EV_KEY: [BTN_SOUTH, BTN_EAST], EV_ABS: axes}


def sector(degrees_to_the_left: float) -> MotionClass | None:
    turn = math.radians(degrees_to_the_left)
    return Stick(-math.sin(turn), -math.cos(turn)).motion()


@pytest.mark.parametrize(
    ("degrees", "motion"),
    [
        (0, MotionClass.FORWARD),
        (20, MotionClass.FORWARD),
        (45, MotionClass.LEFT_FORWARD),
        (90, MotionClass.LEFT_FORWARD),
        (135, MotionClass.LEFT_BACKWARD),
        (180, MotionClass.BACKWARD),
        (-135, MotionClass.RIGHT_BACKWARD),
        (-90, MotionClass.RIGHT_FORWARD),
        (-45, MotionClass.RIGHT_FORWARD),
    ],
)
def test_a_stick_drives_where_it_points(degrees: float, motion: MotionClass) -> None:
    assert sector(degrees) is motion


def test_left_and_right_mirror_each_other() -> None:
    for degrees in range(-179, 180, 7):
        one, other = sector(degrees), sector(-degrees)
        assert one is not None
        assert other is one.mirrored


def test_in_the_middle_it_drives_nowhere() -> None:
    assert Stick(0.2, -0.2).motion() is None
    assert Stick(0.0, -0.4).motion() is MotionClass.FORWARD


def test_the_cross_goes_before_the_stick_and_axes_are_scaled() -> None:
    stick = moved(Stick(), Event(EV_ABS, ABS_Y, -32768), AXES)
    assert stick.y == pytest.approx(-1.0)
    assert stick.motion() is MotionClass.FORWARD
    stick = moved(moved(stick, Event(EV_ABS, ABS_HAT0X, 1), AXES), Event(EV_ABS, ABS_HAT0Y, 1), AXES)
    assert stick.motion() is MotionClass.RIGHT_BACKWARD
    assert moved(stick, Event(EV_ABS, 5, 99), AXES) == stick


def until_empty(pad: FakePad) -> None:
    done = threading.Event()

    @dataclass
    class Last(Event):
        @property
        def code(self) -> int:  # read when all before it is done
            done.set()
            return 0

        @code.setter
        def code(self, value: int) -> None:
            pass

    pad.events.put(Last(EV_KEY, 0, 1))
    assert done.wait(10.0)


def test_sticks_and_buttons_move_the_hand() -> None:
    pad, hand = FakePad(), Hand()
    opened = Gamepad(pad, AXES, hand)
    pad.events.put(Event(EV_ABS, ABS_Y, -32768))
    pad.events.put(Event(EV_KEY, BTN_TL, 1))
    until_empty(pad)
    assert (hand.held, hand.state.device, hand.state.speed) == (MotionClass.FORWARD, "gamepad", 0.75)
    pad.events.put(Event(EV_KEY, BTN_TR, 1))
    pad.events.put(Event(EV_ABS, ABS_Y, 0))
    until_empty(pad)
    assert (hand.held, hand.state.speed) == (None, 1.0)
    pad.events.put(Event(EV_KEY, BTN_EAST, 1))
    until_empty(pad)
    assert hand.state.emergency == "the gamepad's button"
    pad.events.put(Event(EV_KEY, BTN_START, 1))
    pad.events.put(Event(EV_KEY, BTN_NORTH, 1))
    until_empty(pad)
    assert (hand.state.emergency, hand.state.stopped) == ("", False)
    pad.events.put(Event(EV_KEY, BTN_SOUTH, 1))
    until_empty(pad)
    assert hand.state.stopped
    opened.close()
    opened._thread.join(10.0)
    assert pad.closed
    assert hand.state.emergency == ""


@pytest.mark.parametrize(
    ("error", "words"), [(OSError(19, "No such device"), "is gone .No such device"), (ValueError("odd"), "failed .Val")]
)
def test_a_gamepad_that_goes_away_is_an_emergency_stop(error: Exception, words: str) -> None:
    pad, hand = FakePad(), Hand()
    opened = Gamepad(pad, AXES, hand)
    pad.events.put(Event(EV_ABS, ABS_Y, -32768))
    pad.events.put(error)
    opened._thread.join(10.0)
    assert hand.held is None
    assert re.search(words, hand.state.emergency)


def fake_evdev(monkeypatch: pytest.MonkeyPatch, pads: dict[str, FakePad | None]) -> None:
    def opened(path: str) -> FakePad:
        pad = pads[path]
        if pad is None:
            raise PermissionError(13, "Permission denied")
        return pad

    module = ModuleType("evdev")
    module.list_devices = lambda: list(pads)  # type: ignore[attr-defined]
    module.InputDevice = opened  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "evdev", module)


def test_the_first_gamepad_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    mouse, pad = FakePad("a mouse"), FakePad()
    monkeypatch.setattr(mouse, "capabilities", lambda **_: {EV_KEY: [0x110]})
    fake_evdev(monkeypatch, {"/dev/input/event0": None, "/dev/input/event1": mouse, "/dev/input/event2": pad})
    opened = open_gamepad(Hand())
    assert opened.name == "a pad"
    assert opened._axes == {ABS_X: Axis(0, 255), ABS_Y: Axis(0, 255)}
    assert mouse.closed
    opened.close()


def test_without_a_gamepad_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    fake_evdev(monkeypatch, {})
    with pytest.raises(UsageError, match="no gamepad is connected, or this user may not read /dev/input; connect it"):
        open_gamepad(Hand())


def test_without_the_package_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    before = builtins.__import__

    def refuse(name: str, *rest: object) -> object:
        if name == "evdev":
            raise ImportError(name)
        return before(name, *rest)  # type: ignore[arg-type]

    monkeypatch.delitem(sys.modules, "evdev", raising=False)
    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(UsageError, match=r"needs the package evdev; install sdt-tools\[gamepad\]"):
        open_gamepad(Hand())


def test_its_numbers_are_those_of_linux() -> None:
    evdev = pytest.importorskip("evdev", reason="evdev is not installed")
    for name in ("EV_KEY", "EV_ABS", "ABS_X", "ABS_Y", "ABS_HAT0X", "ABS_HAT0Y", "BTN_SOUTH", "BTN_EAST", "BTN_NORTH"):
        assert getattr(gamepad, name) == getattr(evdev.ecodes, name)
    for name in ("BTN_TL", "BTN_TR", "BTN_START"):
        assert getattr(gamepad, name) == getattr(evdev.ecodes, name)
