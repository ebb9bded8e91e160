"""Which motion a hand holds, when it decays, and what stops it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import MotionClass
from sdt_tools.teleop.hand import (
    SPEEDS,
    Hand,
    HandState,
    emergency,
    faster,
    given_back,
    pressed,
    released,
    steered,
    stopped,
)

HOLD_NS = 600_000_000
FORWARD, LEFT = MotionClass.FORWARD, MotionClass.LEFT_FORWARD


def test_a_motion_holds_for_a_while_after_its_key_and_then_decays() -> None:
    state = pressed(HandState(), FORWARD, 1000, HOLD_NS)
    assert state.held(1000) is FORWARD
    assert state.held(1000 + HOLD_NS - 1) is FORWARD
    assert state.held(1000 + HOLD_NS) is None


def test_a_key_that_repeats_holds_on_and_lets_go_sooner() -> None:
    state = pressed(HandState(), FORWARD, 0, HOLD_NS)
    state = pressed(state, FORWARD, 500_000_000, HOLD_NS)  # as late as a keyboard's first repetition
    for at_ns in range(530_000_000, 3 * SECOND_NS, 30_000_000):
        assert state.held(at_ns) is FORWARD
        state = pressed(state, FORWARD, at_ns, HOLD_NS)
    assert state.until_ns - at_ns == HOLD_NS // 2


def test_another_key_takes_over_and_holds_as_long_as_a_first_one() -> None:
    state = pressed(pressed(HandState(), FORWARD, 0, HOLD_NS), LEFT, 100, HOLD_NS)
    assert state.held(101) is LEFT
    assert state.until_ns == 100 + HOLD_NS


def test_a_key_after_its_motion_has_decayed_is_a_first_one() -> None:
    state = pressed(HandState(), FORWARD, 0, HOLD_NS)
    assert pressed(state, FORWARD, HOLD_NS, HOLD_NS).until_ns == 2 * HOLD_NS


def test_a_stop_lets_go_at_once_and_lasts_until_a_motion_or_until_given_back() -> None:
    state = stopped(pressed(HandState(), FORWARD, 0, HOLD_NS))
    assert state.held(1) is None
    assert state.stopped
    assert not pressed(state, FORWARD, 5, HOLD_NS).stopped
    assert not given_back(state).stopped


def test_an_emergency_stop_is_deaf_to_everything_but_its_release() -> None:
    state = emergency(pressed(HandState(), FORWARD, 0, HOLD_NS), "the key Esc")
    assert state.held(1) is None
    for turn in (pressed(state, LEFT, 2, HOLD_NS), steered(state, LEFT), given_back(state), stopped(state)):
        assert turn.held(3) is None
        assert turn.emergency == "the key Esc"
    assert emergency(state, "another reason").emergency == "the key Esc"
    after = released(state)
    assert (after.emergency, after.held(3), after.stopped) == ("", None, True)
    assert pressed(after, LEFT, 4, HOLD_NS).held(5) is LEFT


def test_a_stick_holds_until_it_is_let_go_whatever_the_time() -> None:
    state = steered(HandState(), LEFT)
    assert state.held(10**18) is LEFT
    assert steered(state, None).held(0) is None


def test_letting_go_of_the_stick_does_not_let_go_of_the_key() -> None:
    state = pressed(steered(HandState(), LEFT), FORWARD, 0, HOLD_NS)
    assert steered(state, None).held(1) is FORWARD


def test_speed_has_steps_with_ends() -> None:
    state = HandState()
    assert state.speed == 1.0
    assert faster(state, 1).speed == 1.0
    assert [faster(state, -n).speed for n in range(5)] == [1.0, 0.75, 0.5, 0.25, 0.25]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["key", "stop", "emergency", "release", "speed", "back"]),
            st.sampled_from(list(MotionClass)),
            st.integers(0, SECOND_NS),
        ),
        max_size=40,
    )
)
def test_without_keys_nothing_is_ever_held_for_longer_than_the_hold(acts: list[tuple[str, MotionClass, int]]) -> None:
    state, now_ns = HandState(), 0
    for what, motion, later_ns in acts:
        now_ns += later_ns
        turns = {
            "key": pressed(state, motion, now_ns, HOLD_NS),
            "stop": stopped(state),
            "emergency": emergency(state, "it"),
            "release": released(state),
            "speed": faster(state, -1),
            "back": given_back(state),
        }
        state = turns[what]
        assert state.held(now_ns + HOLD_NS) is None
        assert state.speed in SPEEDS
        assert not (state.emergency and state.held(now_ns) is not None)


@pytest.mark.parametrize(("hold_s", "held"), [(0.3, False), (0.6, True)])
def test_how_long_is_configurable(hold_s: float, held: bool) -> None:
    now_ns = 0
    hand = Hand(hold_s, lambda: now_ns)
    hand.press(FORWARD)
    now_ns = 400_000_000
    assert (hand.held is FORWARD) is held
