"""What can go wrong with the emulated camera."""

from enum import StrEnum
from typing import Final

from sdt_tools.emulation.faults import Kinds, Value


class CameraFault(StrEnum):
    """What can go wrong."""

    POWER = "power"
    SILENCE = "silence"
    DELAY = "delay"
    CORRUPT = "corrupt"


KINDS: Final[Kinds] = {
    CameraFault.POWER: None,
    CameraFault.SILENCE: None,
    CameraFault.DELAY: Value(0.1),
    CameraFault.CORRUPT: Value(0.1, is_share=True),
}
FAULTS: Final = "power (switched off), silence (no pictures), delay=SECONDS, corrupt=SHARE (of the pictures, cut off)."
