"""A gamepad, read from the Linux input devices (evdev), as another pair of hands.

The left stick or the cross drives; the stick counts from a third of its way. The lower button stops, the right one is
the emergency stop, START releases it, the upper one gives the robot back, the shoulder buttons change the speed. A
gamepad that goes away is an emergency stop.
"""

import math
import threading
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol, runtime_checkable

from sdt_tools.errors import UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.teleop.hand import Hand

# numbers of linux/input-event-codes.h
EV_KEY: Final = 1
EV_ABS: Final = 3
ABS_X: Final = 0
ABS_Y: Final = 1
ABS_HAT0X: Final = 16
ABS_HAT0Y: Final = 17
BTN_SOUTH: Final = 0x130
BTN_EAST: Final = 0x131
BTN_NORTH: Final = 0x133
BTN_TL: Final = 0x136
BTN_TR: Final = 0x137
BTN_START: Final = 0x13B

DEAD_SHARE: Final = 1.0 / 3.0


@runtime_checkable
class InputEvent(Protocol):
    """An event of an input device."""

    type: int
    code: int
    value: int


@runtime_checkable
class Pad(Protocol):
    """A gamepad that is open."""

    name: str

    def read_loop(self) -> Iterable[InputEvent]:
        """Events as they come, until the device goes away, which raises OSError."""
        ...

    def capabilities(self, *, absinfo: bool = True) -> dict[int, Any]:
        """Codes of its keys and axes by type; those of axes with their limits where ``absinfo``."""
        ...

    def close(self) -> None:
        """Let go of the device, which ends ``read_loop`` with an OSError."""
        ...


@dataclass(frozen=True)
class Axis:
    """The values of an axis at its ends."""

    least: int
    most: int

    def share(self, value: int) -> float:
        """Where ``value`` lies, from -1 to 1."""
        middle, half = (self.least + self.most) / 2, (self.most - self.least) / 2
        return (value - middle) / half if half else 0.0


@dataclass(frozen=True)
class Stick:
    """Where stick and cross point: x to the right, y down, as gamepads have it."""

    x: float = 0.0
    y: float = 0.0
    cross_x: int = 0
    cross_y: int = 0

    def motion(self) -> MotionClass | None:
        """The motion that it points at; None in the middle.

        Eight sectors: ahead and back, four corners, and to either side, which turns ahead as no motion turns in place.
        """
        x, y = (self.cross_x, self.cross_y) if self.cross_x or self.cross_y else (self.x, self.y)
        if math.hypot(x, y) < DEAD_SHARE:
            return None
        sector = round(math.atan2(-x, -y) / (math.pi / 4)) % 8  # 0 ahead, 2 left, 4 back, 6 right
        return _SECTORS[sector]


_SECTORS: Final = (
    MotionClass.FORWARD,
    MotionClass.LEFT_FORWARD,
    MotionClass.LEFT_FORWARD,
    MotionClass.LEFT_BACKWARD,
    MotionClass.BACKWARD,
    MotionClass.RIGHT_BACKWARD,
    MotionClass.RIGHT_FORWARD,
    MotionClass.RIGHT_FORWARD,
)


def moved(stick: Stick, event: InputEvent, axes: dict[int, Axis]) -> Stick:
    """``stick`` after ``event``."""
    if event.type != EV_ABS:
        return stick
    if event.code == ABS_HAT0X:
        return replace(stick, cross_x=event.value)
    if event.code == ABS_HAT0Y:
        return replace(stick, cross_y=event.value)
    axis = axes.get(event.code)
    if event.code == ABS_X and axis is not None:
        return replace(stick, x=axis.share(event.value))
    if event.code == ABS_Y and axis is not None:
        return replace(stick, y=axis.share(event.value))
    return stick


class Gamepad:
    """Moves ``hand`` as ``pad`` says, in a thread of its own; ``close`` it."""

    def __init__(self, pad: Pad, axes: dict[int, Axis], hand: Hand) -> None:
        self.name = pad.name
        self._pad = pad
        self._axes = axes
        self._hand = hand
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="gamepad", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Let go of it. May be called twice."""
        if not self._closed:
            self._closed = True
            self._pad.close()

    def _run(self) -> None:
        stick, why = Stick(), "the gamepad is gone"
        try:
            for event in self._pad.read_loop():
                if event.type == EV_KEY and event.value == 1:
                    self._press(event.code)
                after = moved(stick, event, self._axes)
                if after.motion() is not stick.motion():
                    self._hand.steer(after.motion())
                stick = after
        except OSError as error:
            why = f"the gamepad is gone ({error.strerror or error})"
        except Exception as error:  # whatever it is, the robot must not drive on
            why = f"the gamepad failed ({type(error).__name__}: {error})"
        finally:
            if not self._closed:
                self._hand.stop_at_once(why)

    def _press(self, button: int) -> None:
        hand = self._hand
        action: Callable[[], None] | None = {
            BTN_SOUTH: hand.stop,
            BTN_EAST: lambda: hand.stop_at_once("the gamepad's button"),
            BTN_START: hand.release,
            BTN_NORTH: hand.give_back,
            BTN_TL: lambda: hand.change_speed(-1),
            BTN_TR: lambda: hand.change_speed(1),
        }.get(button)
        if action is not None:
            action()


def connected_gamepads() -> Iterator[Pad]:
    """The gamepads that are connected and may be read, open. Raises ImportError without the package evdev."""
    import evdev  # an extra: most robots have none

    for path in sorted(evdev.list_devices()):
        try:
            device = evdev.InputDevice(path)
        except OSError:
            continue  # not ours to read
        if BTN_SOUTH in device.capabilities().get(EV_KEY, ()) and {ABS_X, ABS_Y} <= set(_axes(device)):
            yield device
        else:
            device.close()


def open_gamepad(hand: Hand) -> Gamepad:
    """The first gamepad that is connected, at work. Raises UsageError without one, or without the package."""
    try:
        device = next(connected_gamepads(), None)
    except ImportError:
        raise UsageError("--driver gamepad needs the package evdev; install sdt-tools[gamepad]") from None
    if device is not None:
        return Gamepad(device, _axes(device), hand)
    raise UsageError(
        "--driver gamepad: no gamepad is connected, or this user may not read /dev/input; "
        "connect it, join the group 'input', or use --driver keyboard"
    )


def _axes(pad: Pad) -> dict[int, Axis]:
    return {code: Axis(info.min, info.max) for code, info in pad.capabilities(absinfo=True).get(EV_ABS, ())}
