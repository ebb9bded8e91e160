"""What the operator says with his arms, at a time."""

from collections.abc import Sequence

from sdt_tools.frames import Gesture, Mode
from sdt_tools.scene.layout import GestureEvent


def gesture_at(gestures: Sequence[GestureEvent], time_s: float) -> Gesture:
    """The gesture shown at ``time_s``: the latest begun, while it lasts."""
    for event in reversed(gestures):
        if event.at_s <= time_s:
            return event.gesture if time_s < event.at_s + event.lasts_s else Gesture.IDLE
    return Gesture.IDLE


def first_mode(planned: Sequence[GestureEvent]) -> Mode:
    """What the operator wants at first: one who does not plan to gesture wants the robot active throughout."""
    return Mode.IDLE if planned else Mode.ACTIVE


def commanded_mode_at(gestures: Sequence[GestureEvent], time_s: float, mode: Mode) -> Mode:
    """What the operator has asked for until ``time_s``, after ``mode`` at first."""
    for event in gestures:
        if event.at_s <= time_s and event.gesture is not Gesture.IDLE:
            mode = Mode.ACTIVE if event.gesture is Gesture.ENABLE else Mode.IDLE
    return mode
