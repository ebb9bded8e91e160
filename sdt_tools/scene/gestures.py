"""What the operator says and does with his arms, at a time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from sdt_tools.frames import Gesture, Mode
from sdt_tools.scene.layout import AS_EVER, Behaviour, BehaviourEvent, GestureEvent, Manner


@dataclass(frozen=True)
class Arms:
    """What the arms are making, how far they are in it from 0 (at rest) to 1, and in which manner."""

    makes: Gesture | Behaviour
    share: float
    manner: Manner = AS_EVER


_TURNS_ROUND_S: Final = 1.2
"""How long before his arms are up he begins to turn to the robot."""
ARMS_AT_REST = Arms(Gesture.IDLE, 1.0)


def arms_at(gestures: Sequence[GestureEvent], behaviours: Sequence[BehaviourEvent], time_s: float) -> Arms:
    """What the arms are making at ``time_s``: a gesture, else a behaviour, else nothing."""
    arms = _arms_in(gestures, time_s)
    return arms if arms.makes is not Gesture.IDLE and arms.share > 0.0 else _arms_in(behaviours, time_s, arms)


def _arms_in(events: Sequence[GestureEvent | BehaviourEvent], time_s: float, otherwise: Arms = ARMS_AT_REST) -> Arms:
    for event in reversed(events):
        begun_s = time_s - event.at_s + event.lead_s
        if begun_s >= 0.0:
            rising = begun_s / event.moves_s
            sinking = 1.0 - (begun_s - event.lasts_s) / event.moves_s
            makes = event.gesture if isinstance(event, GestureEvent) else event.does
            return Arms(makes, min(1.0, max(0.0, min(rising, sinking))), event.manner)
    return otherwise


def behaviour_at(behaviours: Sequence[BehaviourEvent], time_s: float) -> Behaviour | None:
    """What he does with his hands at ``time_s`` beside any gesture; None for nothing."""
    for event in reversed(behaviours):
        if event.at_s <= time_s:
            return event.does if time_s < event.at_s + event.lasts_s else None
    return None


def gesture_at(gestures: Sequence[GestureEvent], time_s: float) -> Gesture:
    """The gesture shown at ``time_s``: the latest begun, while it lasts."""
    for event in reversed(gestures):
        if event.at_s <= time_s:
            return event.gesture if time_s < event.at_s + event.lasts_s else Gesture.IDLE
    return Gesture.IDLE


def signals_at(gestures: Sequence[GestureEvent], time_s: float) -> bool:
    """Whether the operator is at a gesture at ``time_s``: about to show it, showing it, or letting his arms sink."""
    return any(
        event.at_s - _TURNS_ROUND_S <= time_s < event.at_s + event.lasts_s + event.moves_s - event.lead_s
        for event in gestures
        if event.gesture is not Gesture.IDLE
    )


def first_mode(planned: Sequence[GestureEvent]) -> Mode:
    """What the operator wants at first: one who does not plan to gesture wants the robot active throughout."""
    return Mode.IDLE if planned else Mode.ACTIVE


def commanded_mode_at(gestures: Sequence[GestureEvent], time_s: float, mode: Mode) -> Mode:
    """What the operator has asked for until ``time_s``, after ``mode`` at first."""
    for event in gestures:
        if event.at_s <= time_s and event.gesture is not Gesture.IDLE:
            mode = Mode.ACTIVE if event.gesture is Gesture.ENABLE else Mode.IDLE
    return mode
