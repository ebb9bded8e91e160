"""Faults that come and go: power, cable, connection and silence, again and again."""

from enum import Enum
from threading import Event

from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx


class Trouble(Enum):
    """What happens to the device now and then."""

    POWER = "power"
    CABLE = "cable"
    HANG_UP = "hang-up"
    SILENCE = "silence"


def make_trouble(emulator: EmulatedLms1xx, trouble: Trouble, lasting_s: float, ending: Event) -> None:
    """Let ``trouble`` happen, and end after ``lasting_s`` or with ``ending``."""
    match trouble:
        case Trouble.POWER:
            emulator.switch_off()
            ending.wait(lasting_s)
            emulator.switch_on()
        case Trouble.CABLE:
            emulator.unplug()
            ending.wait(lasting_s)
            emulator.unplug(False)
        case Trouble.HANG_UP:
            emulator.hang_up()
        case Trouble.SILENCE:
            emulator.silent = True
            ending.wait(lasting_s)
            emulator.silent = False
