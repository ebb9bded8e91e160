"""The state machine of the paper: idle and active, enable and disable."""

import itertools

import pytest

from sdt_tools.control.mode_machine import ModeState, after_reading
from sdt_tools.frames import Gesture, Mode

IDLE, ENABLE, DISABLE = Gesture.IDLE, Gesture.ENABLE, Gesture.DISABLE


def modes(gestures: list[Gesture], debounce: int = 1) -> list[Mode]:
    state, found = ModeState(), []
    for stamp_ns, gesture in enumerate(gestures):
        state = after_reading(state, gesture, stamp_ns, debounce)
        found.append(state.mode)
    return found


@pytest.mark.parametrize(
    ("before", "gesture", "after"),
    [
        (Mode.IDLE, IDLE, Mode.IDLE),
        (Mode.IDLE, ENABLE, Mode.ACTIVE),
        (Mode.IDLE, DISABLE, Mode.IDLE),
        (Mode.ACTIVE, IDLE, Mode.ACTIVE),
        (Mode.ACTIVE, ENABLE, Mode.ACTIVE),
        (Mode.ACTIVE, DISABLE, Mode.IDLE),
    ],
)
def test_only_enable_leads_out_of_idle_and_only_disable_out_of_active(
    before: Mode, gesture: Gesture, after: Mode
) -> None:
    assert after_reading(ModeState(before), gesture, 0).mode is after


def test_with_a_debounce_as_many_readings_in_a_row_switch() -> None:
    assert modes([ENABLE, ENABLE, ENABLE], 3) == [Mode.IDLE, Mode.IDLE, Mode.ACTIVE]
    assert modes([ENABLE, ENABLE, IDLE, ENABLE, ENABLE], 3)[-1] is Mode.IDLE
    assert modes([ENABLE, DISABLE, ENABLE], 2)[-1] is Mode.IDLE


def test_a_switch_knows_the_first_reading_that_asked_for_it() -> None:
    state = ModeState()
    for stamp_ns, gesture in [(5, IDLE), (10, ENABLE), (20, ENABLE), (30, ENABLE)]:
        state = after_reading(state, gesture, stamp_ns, 3)

    assert state == ModeState(Mode.ACTIVE, 0, 10)


@pytest.mark.parametrize("debounce", [1, 2, 3])
def test_every_sequence_of_six_readings_does_what_its_longest_streaks_say(debounce: int) -> None:
    for gestures in itertools.product(Gesture, repeat=6):
        mode, streak = Mode.IDLE, 0
        for gesture, found in zip(gestures, modes(list(gestures), debounce), strict=True):
            wanted = ENABLE if mode is Mode.IDLE else DISABLE
            streak = streak + 1 if gesture is wanted else 0
            if streak == debounce:
                mode, streak = Mode(1 - mode), 0
            assert found is mode
