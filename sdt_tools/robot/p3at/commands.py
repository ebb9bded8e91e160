"""What a client tells the base: a number, and with most of them an argument.

Sources: Pioneer 3 Operations Manual, tables "ARCOS command set" and "Client command argument types".
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from sdt_tools.robot.p3at.packets import packet

_POSITIVE: Final = 0x3B
_NEGATIVE: Final = 0x1B
_STRING: Final = 0x2B
_MAX_ARGUMENT: Final = 0xFFFF


class Code(IntEnum):
    """The commands used here. Before a session is open, 0 to 2 are the synchronisation."""

    PULSE = 0
    OPEN = 1
    CLOSE = 2
    ENABLE = 4
    SETA = 5
    SETV = 6
    SETO = 7
    SETRV = 10
    VEL = 11
    CONFIG = 18
    RVEL = 21
    SETRA = 23
    SONAR = 28
    STOP = 29
    VEL2 = 32
    ESTOP = 55


@dataclass(frozen=True)
class Command:
    """One command as it was received. ``code`` may be none of ours."""

    code: int
    argument: int | None = None
    text: bytes | None = None


def encode(code: int, argument: int | None = None) -> bytes:
    """The packet of a command; the argument's magnitude goes as an unsigned number, its sign as the type."""
    if argument is None:
        return packet(bytes([code]))
    if abs(argument) > _MAX_ARGUMENT:
        raise ValueError(f"an argument has 16 bits, {argument} has more")
    kind = _POSITIVE if argument >= 0 else _NEGATIVE
    return packet(bytes([code, kind]) + abs(argument).to_bytes(2, "little"))


def decode(body: bytes) -> Command | None:
    """The command in a packet's body; None where its argument is cut off or of an unknown type."""
    if len(body) == 1:
        return Command(body[0])
    code, kind, value = body[0], body[1], body[2:]
    if kind == _STRING:
        return Command(code, text=value.split(b"\0", 1)[0])
    if kind not in (_POSITIVE, _NEGATIVE) or len(value) < 2:
        return None
    magnitude = int.from_bytes(value[:2], "little")
    return Command(code, magnitude if kind == _POSITIVE else -magnitude)


def wheels_argument(left_mps: float, right_mps: float) -> int:
    """The argument of VEL2: a signed byte a wheel, left in the high one, in steps of 20 mm/s."""
    left, right = (max(-128, min(127, round(speed * 50))) for speed in (left_mps, right_mps))
    return (left & 0xFF) << 8 | (right & 0xFF)


def wheels_of(argument: int) -> tuple[float, float]:
    """Left and right wheel speed in m/s of VEL2's argument."""
    left, right = (argument >> 8) & 0xFF, argument & 0xFF
    return tuple((byte - 256 if byte > 127 else byte) / 50 for byte in (left, right))  # type: ignore[return-value]
