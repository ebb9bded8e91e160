"""The faults of an emulated LiDAR, as they are written."""

from enum import StrEnum
from typing import Final

from sdt_tools.emulation.faults import HOW, Kinds, Value


class LidarFault(StrEnum):
    """What can go wrong: first with what is sent, then with the device."""

    SPLIT = "split"
    MERGE = "merge"
    DELAY = "delay"
    JITTER = "jitter"
    DROP = "drop"
    CORRUPT = "corrupt"
    GARBAGE = "garbage"
    DRIFT = "drift"
    POWER = "power"
    CABLE = "cable"
    HANG_UP = "hang-up"
    SILENCE = "silence"


_VALUES: Final = {
    LidarFault.SPLIT: Value(100.0, is_count=True),
    LidarFault.MERGE: Value(3.0, is_count=True),
    LidarFault.DELAY: Value(0.02),
    LidarFault.JITTER: Value(0.005),
    LidarFault.DROP: Value(0.1, is_share=True),
    LidarFault.CORRUPT: Value(0.1, is_share=True),
    LidarFault.GARBAGE: Value(0.1, is_share=True),
    LidarFault.DRIFT: Value(50.0, is_signed=True),
}
KINDS: Final[Kinds] = {kind: _VALUES.get(kind) for kind in LidarFault}
FAULTS: Final = (
    "Of what is sent: split=BYTES (pieces of so many), merge=SCANS, delay=SECONDS, jitter=SECONDS (late by a random "
    "part), drop=SHARE, corrupt=SHARE (wrong checksums; in CoLa-A, cut off), garbage=SHARE, drift=PPM (its clock is "
    "too fast). Of the device: power (switched off), cable (pulled), hang-up, silence (no scans)."
)
FAULT_HELP: Final = f"{HOW} {FAULTS}"
