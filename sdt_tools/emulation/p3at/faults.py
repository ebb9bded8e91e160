"""What can go wrong with the emulated base."""

from enum import StrEnum
from typing import Final

from sdt_tools.emulation.faults import HOW, Kinds, Value


class FaultKind(StrEnum):
    """What can go wrong: first on the wire, then in the base."""

    SPLIT = "split"
    MERGE = "merge"
    DELAY = "delay"
    DROP = "drop"
    CORRUPT = "corrupt"
    GARBAGE = "garbage"
    POWER = "power"
    STALL = "stall"
    FRONT_BUMPER = "front-bumper"
    REAR_BUMPER = "rear-bumper"
    BUTTON = "button"
    BATTERY = "battery"


_VALUES: Final = {
    FaultKind.SPLIT: Value(3.0, is_count=True),
    FaultKind.MERGE: Value(2.0, is_count=True),
    FaultKind.DELAY: Value(0.1),
    FaultKind.DROP: Value(0.1, is_share=True),
    FaultKind.CORRUPT: Value(0.1, is_share=True),
    FaultKind.GARBAGE: Value(0.1, is_share=True),
    FaultKind.BATTERY: Value(11.0),
}
KINDS: Final[Kinds] = {kind: _VALUES.get(kind) for kind in FaultKind}
FAULTS: Final = (
    "On the wire: split=BYTES (pieces of so many), merge=PACKETS, delay=SECONDS, drop=SHARE, corrupt=SHARE (bad "
    "checksums), garbage=SHARE, power (switched off). In the base: stall, front-bumper, rear-bumper, button (emergency "
    "stop), battery=VOLTS."
)
FAULT_HELP: Final = f"{HOW} {FAULTS}"
