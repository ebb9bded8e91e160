"""What the base says of itself ten times a second: the standard server information packet (types 0x32 and 0x33).

Sources: Pioneer 3 Operations Manual, tables "ARCOS standard SIP contents" and "The FLAGS bits".
"""

import struct
from dataclasses import dataclass
from typing import Final

STANDING: Final = 0x32
MOVING: Final = 0x33
_FIXED: Final = struct.Struct("<BHHhhhBHhHBB")
_POSITION_BITS: Final = 0x7FFF
_MOTORS_ON: Final = 1 << 0
_SONAR_ON: Final = 1 << 1
_BUTTON: Final = 1 << 5
_ESTALL: Final = 1 << 6
_STALLED: Final = 0x01
_BUMPERS: Final = 0xFE
_SONAR_BYTES: Final = 3
_AFTER_SONAR: Final = struct.Struct("<BBBBBHBhH")


@dataclass(frozen=True)
class Status:
    """One status packet, in the base's own units.

    ``x`` and ``y`` have 15 bits and wrap; ``heading`` has 4096 steps a turn, counter-clockwise. Wheel speeds are in
    mm/s. ``front_bumpers`` and ``rear_bumpers`` have a bit a segment.
    """

    x: int
    y: int
    heading: int
    left_mmps: int
    right_mmps: int
    battery_v: float
    left_stalled: bool = False
    right_stalled: bool = False
    front_bumpers: int = 0
    rear_bumpers: int = 0
    motors_on: bool = True
    button_pressed: bool = False
    moving: bool = False
    sonar_on: bool = False

    @property
    def rolls(self) -> bool:
        """Whether a wheel turns; not every controller says so by the packet's type, ``moving``."""
        return self.moving or bool(self.left_mmps or self.right_mmps)

    @property
    def stalled(self) -> bool:
        """Whether a wheel does not turn although its motor pulls."""
        return self.left_stalled or self.right_stalled


def decode_status(body: bytes) -> Status | None:
    """The status in a packet's body; None where it is none, or too short for one."""
    if len(body) < _FIXED.size or body[0] not in (STANDING, MOVING):
        return None
    kind, x, y, heading, left, right, battery, stall, _, flags, _, sonars = _FIXED.unpack_from(body)
    if len(body) < _FIXED.size + sonars * _SONAR_BYTES:
        return None
    rear, front = stall & 0xFF, stall >> 8
    return Status(
        x=x & _POSITION_BITS,
        y=y & _POSITION_BITS,
        heading=heading,
        left_mmps=left,
        right_mmps=right,
        battery_v=battery / 10,
        left_stalled=bool(rear & _STALLED),
        right_stalled=bool(front & _STALLED),
        front_bumpers=(front & _BUMPERS) >> 1,
        rear_bumpers=(rear & _BUMPERS) >> 1,
        motors_on=bool(flags & _MOTORS_ON),
        button_pressed=bool(flags & (_BUTTON | _ESTALL)),
        moving=kind == MOVING,
        sonar_on=bool(flags & _SONAR_ON),
    )


def encode_status(status: Status) -> bytes:
    """The body of a packet that says ``status``, without sonar readings, as firmware from ARCOS 1.5 on sends it."""
    front = status.right_stalled | status.front_bumpers << 1
    rear = status.left_stalled | status.rear_bumpers << 1
    flags = _MOTORS_ON * status.motors_on | _SONAR_ON * status.sonar_on | (_BUTTON | _ESTALL) * status.button_pressed
    tenths_v = round(status.battery_v * 10)
    fixed = _FIXED.pack(
        MOVING if status.moving else STANDING,
        status.x & _POSITION_BITS,
        status.y & _POSITION_BITS,
        status.heading,
        status.left_mmps,
        status.right_mmps,
        tenths_v,
        front << 8 | rear,
        status.heading,
        flags,
        0,
        0,
    )
    turn = round((status.right_mmps - status.left_mmps) / 2 * _DEGREES_A_MM * 10)
    return fixed + _AFTER_SONAR.pack(0, 0, 0, 0, 0, tenths_v, 0, turn, 0)


_DEGREES_A_MM: Final = 0.1948
"""Turn of the base in degrees for a millimetre of one wheel against the other (0.0034 rad, ARIA's parameters)."""
