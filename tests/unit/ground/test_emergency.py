"""The emergency stop's latch, and the hand that shares it."""

import pytest

from sdt_tools.emergency import EmergencyStop
from sdt_tools.frames import MotionClass
from sdt_tools.teleop.hand import Hand


def test_it_latches_with_its_first_reason_and_tells_each_turn_once() -> None:
    emergency, heard = EmergencyStop(), []
    emergency.tell(heard.append)
    emergency.pull("first")
    emergency.pull("second")
    assert emergency.reason == "first"
    emergency.release()
    emergency.release()
    assert heard == ["first", ""]


def test_who_comes_late_hears_of_it_too() -> None:
    emergency, heard = EmergencyStop(), []
    emergency.pull("before")
    emergency.tell(heard.append)
    assert heard == ["before"]


def test_it_is_not_pulled_without_a_reason() -> None:
    with pytest.raises(ValueError, match="has a reason"):
        EmergencyStop().pull("")


def test_a_hand_lets_go_when_another_pulls_it_and_another_hears_the_hand() -> None:
    emergency = EmergencyStop()
    hand = Hand(latch=emergency)
    hand.press(MotionClass.FORWARD)
    emergency.pull("the base's button")
    assert hand.held is None
    assert (hand.state.emergency, hand.state.stopped) == ("the base's button", True)
    hand.release()
    assert not emergency.reason
    hand.stop_at_once("Esc")
    assert emergency.reason == "Esc"
