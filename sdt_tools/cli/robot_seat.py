"""A person's seat before a robot: the cockpit, whose emergency stop is the robot's own."""

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, nullcontext
from typing import TYPE_CHECKING

from sdt_tools.cli.live import Live
from sdt_tools.teleop.hand import GAMEPAD, KEYBOARD

if TYPE_CHECKING:
    from sdt_tools.emergency import EmergencyStop
    from sdt_tools.protocols import Chooser, Driver
    from sdt_tools.teleop.cockpit import Cockpit


@contextmanager
def robot_seat(
    driver: str, title: str, how: Live, emergency: "EmergencyStop", takes: bool = False, keeps_last: bool = False
) -> "Iterator[tuple[Cockpit, Callable[[Driver | Chooser | None], Chooser]]]":
    """A cockpit, and what puts its hand at the wheel: alone, or beside a driver.

    Raises UsageError where a gamepad is asked for and none is there.
    """
    from sdt_tools.teleop.cockpit import Cockpit
    from sdt_tools.teleop.gamepad import open_gamepad
    from sdt_tools.teleop.hand import Hand
    from sdt_tools.teleop.takeover import ByHand, Takeover

    hand, by_hand = Hand(how.hold_s, latch=emergency), driver in (KEYBOARD, GAMEPAD)
    cockpit = Cockpit(title, driver, hand, takes, by_hand, keeps_last)

    def seated(beside: "Driver | Chooser | None") -> "Chooser":
        if beside is None:
            return ByHand(hand, driver)
        cockpit.driver = beside.name
        return Takeover(beside, hand)

    with closing(open_gamepad(hand)) if how.gamepad or driver == GAMEPAD else nullcontext():
        yield cockpit, seated
