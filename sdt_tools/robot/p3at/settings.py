"""The settings that the base keeps: its CONFIG packet (type 0x20).

Sources: Pioneer 3 Operations Manual, table "CONFIGpac contents"; the fields that stand there after these are left out.
"""

import struct
from dataclasses import dataclass
from typing import Final

SETTINGS: Final = 0x20
_TOPS: Final = struct.Struct("<BHHHHH")
_UP_TO_WATCHDOG: Final = struct.Struct("<BBBHHBHHH")
_AFTER_WATCHDOG: Final = struct.Struct("<BHHHHHHHHHHHHHHHHBBBBBB")


@dataclass(frozen=True)
class BaseSettings:
    """Who the base is, and what it does by itself. Speeds in mm/s and °/s, accelerations in mm/s² and °/s²."""

    kind: str
    model: str
    serial: str
    name: str
    turn_top_dps: int
    speed_top_mmps: int
    cycle_ms: int
    low_battery_v: float
    watchdog_ms: int


def decode_settings(body: bytes) -> BaseSettings | None:
    """The settings in a packet's body; None where it is none, or cut off."""
    if not body or body[0] != SETTINGS:
        return None
    try:
        (kind, model, serial), place = _texts(body, 1, 3)
        _, turn_top, speed_top, *_ = _TOPS.unpack_from(body, place)
        (name,), place = _texts(body, place + _TOPS.size, 1)
        cycle, _, _, _, _, _, low_battery, _, watchdog = _UP_TO_WATCHDOG.unpack_from(body, place)
    except (struct.error, ValueError):
        return None
    return BaseSettings(kind, model, serial, name, turn_top, speed_top, cycle, low_battery / 10, watchdog)


def encode_settings(settings: BaseSettings) -> bytes:
    """The body of a CONFIG packet; what ``settings`` does not hold are the P3-AT's factory values."""
    tops = _TOPS.pack(1, settings.turn_top_dps, settings.speed_top_mmps, 300, 2000, 500)
    low_battery = round(settings.low_battery_v * 10)
    first = _UP_TO_WATCHDOG.pack(settings.cycle_ms, 4, 0, 0, 0, 0, low_battery, 32550, settings.watchdog_ms)
    stalls_and_joystick = (0, 200, 150, 750, 50)
    turning, driving = (100, 100, 40, 20, 0), (300, 300, 40, 30, 0)
    maxima = (settings.turn_top_dps, settings.speed_top_mmps)
    bumpers_and_rest = (5, 5, 0, 0, 0, 0)
    last = _AFTER_WATCHDOG.pack(*stalls_and_joystick, *maxima, *turning, *driving, *bumpers_and_rest)
    texts = (settings.kind, settings.model, settings.serial)
    return bytes([SETTINGS]) + b"".join(map(_text, texts)) + tops + _text(settings.name) + first + last


def _text(text: str) -> bytes:
    return text.encode("latin-1", "replace") + b"\0"


def _texts(body: bytes, place: int, count: int) -> tuple[list[str], int]:
    """``count`` texts from ``place`` on, and where the next field begins. Raises ValueError where one has no end."""
    found = []
    for _ in range(count):
        end = body.index(b"\0", place)
        found.append(body[place:end].decode("latin-1"))
        place = end + 1
    return found, place
