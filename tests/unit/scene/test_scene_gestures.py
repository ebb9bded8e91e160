"""When the arms do what, and what the truth calls it."""

import numpy as np
import pytest

from sdt_tools.frames import Gesture, Mode
from sdt_tools.scene.gestures import Arms, arms_at, behaviour_at, commanded_mode_at, gesture_at, signals_at
from sdt_tools.scene.layout import Behaviour, BehaviourEvent, GestureEvent
from sdt_tools.scene.manners import with_manners

GESTURES = (GestureEvent(1.0, Gesture.ENABLE, 2.0), GestureEvent(8.0, Gesture.DISABLE, 2.0))
CALLS = (BehaviourEvent(4.0, Behaviour.PHONE_CALL, 2.0),)


@pytest.mark.parametrize(
    ("time_s", "expected"),
    [
        (0.0, (Gesture.IDLE, 1.0)),
        (1.0, (Gesture.ENABLE, 0.0)),
        (1.3, (Gesture.ENABLE, 0.5)),
        (2.0, (Gesture.ENABLE, 1.0)),
        (3.3, (Gesture.ENABLE, 0.5)),
        (4.3, (Behaviour.PHONE_CALL, 0.5)),
        (5.0, (Behaviour.PHONE_CALL, 1.0)),
        (7.0, (Behaviour.PHONE_CALL, 0.0)),
        (9.0, (Gesture.DISABLE, 1.0)),
    ],
)
def test_arms_follow_gestures_and_behaviours(time_s: float, expected: tuple[Gesture | Behaviour, float]) -> None:
    arms = arms_at(GESTURES, CALLS, time_s)

    assert (arms.makes, pytest.approx(arms.share)) == expected


def test_a_gesture_goes_before_a_behaviour() -> None:
    whole_time = (BehaviourEvent(0.0, Behaviour.CARRY_BOX, 20.0),)

    assert arms_at(GESTURES, whole_time, 2.0) == Arms(Gesture.ENABLE, 1.0)
    assert arms_at(GESTURES, whole_time, 6.0).makes is Behaviour.CARRY_BOX


def test_what_looks_like_a_gesture_is_idle_and_asks_for_nothing() -> None:
    assert gesture_at(GESTURES, 5.0) is Gesture.IDLE
    assert behaviour_at(CALLS, 5.0) is Behaviour.PHONE_CALL
    assert behaviour_at(CALLS, 3.9) is None
    assert behaviour_at(CALLS, 6.0) is None
    assert [commanded_mode_at(GESTURES, time_s, Mode.IDLE) for time_s in (0.0, 5.0, 9.0)] == [
        Mode.IDLE,
        Mode.ACTIVE,
        Mode.IDLE,
    ]


def test_varied_gestures_are_half_made_when_they_begin_and_end() -> None:
    even = tuple(GestureEvent(5.0 * number, Gesture.ENABLE, 2.0) for number in range(80))
    events = with_manners(even, np.random.default_rng(1))

    shares = [arms_at(events, (), event.at_s + passed).share for event in events for passed in (0.0, event.lasts_s)]

    assert shares == pytest.approx([0.5] * len(shares))
    assert len({event.moves_s for event in events}) == len(events)
    assert len({event.manner for event in events}) == len(events)
    assert 2 < sum(event.manner.other_hand for event in events) < 30


def test_he_signals_from_turning_round_until_his_arms_are_down() -> None:
    slow = (GestureEvent(5.0, Gesture.ENABLE, 2.0, moves_s=0.6, lead_s=0.3), GestureEvent(9.0, Gesture.IDLE, 2.0))

    assert [signals_at(slow, time_s) for time_s in (3.7, 3.9, 5.0, 7.2, 7.4, 9.5)] == [
        False,
        True,
        True,
        True,
        False,
        False,
    ]
