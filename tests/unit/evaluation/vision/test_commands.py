"""Planned misreadings of a scripted network give exactly the planned mode errors, missed commands and reactions."""

from collections.abc import Sequence

import pytest

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS
from sdt_tools.control.controller import VisionDecision
from sdt_tools.control.mode_machine import ModeState, after_reading
from sdt_tools.evaluation.vision.commands import ModeTally, commands_of, tally_modes
from sdt_tools.frames import Gesture, Mode
from sdt_tools.scene.gestures import arms_at, gesture_at
from sdt_tools.scene.layout import GestureEvent

IDLE, ENABLE, DISABLE = Gesture.IDLE, Gesture.ENABLE, Gesture.DISABLE
HZ = 5
PLAN = (
    GestureEvent(3.0, ENABLE, 2.0, moves_s=0.4, lead_s=0.2),
    GestureEvent(12.0, DISABLE, 2.0, moves_s=0.4, lead_s=0.2),
)
"""Arms are in enable from 2.8 s to 5.2 s, in disable from 11.8 s to 14.2 s."""


def drive(
    wrong: dict[float, Gesture | None],
    plan: Sequence[GestureEvent] = PLAN,
    debounce: int = 1,
    deaf: tuple[float, float] = (0.0, 0.0),
    end_s: float = 20.0,
) -> ModeTally:
    """Reads what is shown, but for ``wrong`` moments, and nothing at all in ``deaf``."""
    state, decisions = ModeState(), []
    for number in range(round(end_s * HZ)):
        time_s = number / HZ
        read = IDLE if deaf[0] <= time_s < deaf[1] else gesture_at(plan, time_s)
        read = wrong.get(time_s, read)
        stamp_ns, before = FAST_EPOCH_NS + number * SECOND_NS // HZ, state
        if read is not None:
            state = after_reading(state, read, stamp_ns, debounce)
        since_ns = state.since_ns if state.mode is not before.mode else stamp_ns
        decisions.append(VisionDecision(stamp_ns, read, before.mode, state.mode, since_ns, 0.0))
    return tally_modes(decisions, plan, FAST_EPOCH_NS, end_s, Mode.IDLE)


def test_a_network_that_reads_right_makes_no_error_and_misses_nothing() -> None:
    tally = drive({})

    assert (tally.errors, tally.missed, tally.moot, tally.misread) == ((), (), 0, 0)
    assert tally.commands == tally.heard == 2
    assert tally.reactions_s == pytest.approx((0.0, 0.0))


def test_misreadings_that_switch_are_errors_and_those_that_do_not_are_none() -> None:
    tally = drive({1.0: ENABLE, 1.4: DISABLE, 8.0: ENABLE, 17.0: DISABLE, 18.0: ENABLE})

    # At 1.0 on, at 1.4 off again; enable while active and disable while idle change nothing; at 18 on.
    assert [(one.time_s, one.mode) for one in tally.errors] == [
        (1.0, Mode.ACTIVE),
        (1.4, Mode.IDLE),
        (18.0, Mode.ACTIVE),
    ]
    assert [one.against for one in tally.errors] == [True, False, True]
    assert tally.misread == 5
    assert (len(tally.missed), tally.moot) == (0, 0)


def test_a_command_that_finds_the_mode_there_already_is_moot() -> None:
    tally = drive({2.0: ENABLE})

    assert (len(tally.errors), tally.moot, len(tally.missed), tally.heard) == (1, 1, 0, 1)


def test_a_command_that_is_not_read_is_missed_and_the_one_after_it_is_moot() -> None:
    tally = drive({}, deaf=(2.5, 6.0))

    assert [command.gesture for command in tally.missed] == [ENABLE]
    assert (tally.moot, tally.errors) == (1, ())


def test_a_late_misreading_does_not_make_up_for_a_missed_command() -> None:
    tally = drive({7.0: ENABLE}, deaf=(2.5, 6.0))

    assert [(one.time_s, one.against) for one in tally.errors] == [(7.0, False)]
    assert [command.gesture for command in tally.missed] == [ENABLE]


@pytest.mark.parametrize(("at_s", "errors"), [(2.6, 1), (2.8, 0), (5.0, 0), (5.2, 1), (5.4, 1)])
def test_arms_on_the_way_count_as_the_gesture(at_s: float, errors: int) -> None:
    """``arms_at`` is the other witness: what is no error there has the arms in the gesture, or on the way."""
    tally = drive({at_s: ENABLE}, deaf=(2.5, 6.0))

    assert len(tally.errors) == errors
    arms = arms_at(PLAN, (), at_s + 1e-9)
    assert (arms.makes is ENABLE and arms.share > 0.0) is (errors == 0)


def test_with_a_debounce_a_switch_is_commanded_by_any_of_its_pictures() -> None:
    tally = drive({5.0: ENABLE, 5.2: ENABLE}, debounce=3, deaf=(2.5, 4.8))

    assert tally.errors == ()  # at 4.8 and 5.0 his arms are in it; the third reading, at 5.2, is wrong
    assert tally.reactions_s == pytest.approx((2.2, 2.0 / HZ))


def test_a_command_that_the_end_cuts_off_does_not_count() -> None:
    assert drive({}, end_s=14.0).commands == 1
    assert drive({}, end_s=14.4).commands == 2


def test_exposed_are_the_pictures_in_which_a_misreading_could_have_been_an_error() -> None:
    tally = drive({})

    # Active from 3.0: all but the 12 of disable are exposed up to 12.0; before, all but 2.8; then all, idle.
    assert tally.decisions == 100
    assert tally.exposed == 100 - 2 - 2  # 2.8 and 3.0 to enable, 11.8 and 12.0 to disable


def test_pictures_that_were_not_read_are_counted_apart() -> None:
    tally = drive({0.0: None, 0.2: None})

    assert (tally.unreadable, tally.decisions, tally.errors) == (2, 100, ())


def test_a_gesture_that_is_asked_for_at_once_ends_the_one_before() -> None:
    first, second = commands_of([GestureEvent(1.0, ENABLE, 2.0), GestureEvent(2.0, DISABLE, 2.0)])

    assert (first.from_s, first.until_s) == (1.0, 2.0)
    assert (second.mode, second.until_s) == (Mode.IDLE, 4.6)
