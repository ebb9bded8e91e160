"""Status and settings packets, against bytes laid out by hand after the manual."""

import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.emulation.p3at.firmware import FACTORY
from sdt_tools.robot.p3at.settings import decode_settings, encode_settings
from sdt_tools.robot.p3at.status import Status, decode_status, encode_status

signed = st.integers(-0x8000, 0x7FFF)
statuses = st.builds(
    Status,
    *(st.integers(0, 0x7FFF), st.integers(0, 0x7FFF), signed, st.integers(-3000, 3000), st.integers(-3000, 3000)),
    battery_v=st.integers(0, 255).map(lambda tenths: tenths / 10),
    front_bumpers=st.integers(0, 127),
    rear_bumpers=st.integers(0, 127),
)


def by_hand(stall: int = 0, flags: int = 1, sonars: bytes = b"\x00", kind: int = 0x33) -> bytes:
    """Type, x, y, heading, left, right, battery, stall and bumpers, control, flags, compass, sonars."""
    return bytes([kind]) + struct.pack("<HHhhhBHhHB", 0x8005, 32760, -1024, 500, -250, 124, stall, 0, flags, 7) + sonars


def test_a_status_packet_laid_out_by_hand() -> None:
    status = decode_status(by_hand())
    assert status == Status(5, 32760, -1024, 500, -250, 12.4, motors_on=True, moving=True)


@pytest.mark.parametrize(
    ("word", "field"),
    [(0x0001, "left_stalled"), (0x0100, "right_stalled")],
)
def test_stalls_are_the_lowest_bit_of_each_byte(word: int, field: str) -> None:
    status = decode_status(by_hand(stall=word))
    assert status is not None
    assert status.stalled
    assert getattr(status, field)
    assert (status.front_bumpers, status.rear_bumpers) == (0, 0)


def test_the_front_bumper_is_the_high_byte() -> None:
    status = decode_status(by_hand(stall=0x8002))
    assert status is not None
    assert (status.front_bumpers, status.rear_bumpers, status.stalled) == (0b1000000, 0b1, False)


@pytest.mark.parametrize("flags", [1 << 5, 1 << 6])
def test_both_bits_of_the_emergency_button_count(flags: int) -> None:
    status = decode_status(by_hand(flags=flags))
    assert status is not None
    assert status.button_pressed
    assert not status.motors_on


@pytest.mark.parametrize(
    "body", [b"", b"\x32", by_hand()[:-1], by_hand(kind=0x20), by_hand(sonars=b"\x02\x00\x01\x02")]
)
def test_what_is_cut_off_or_of_another_type_is_no_status(body: bytes) -> None:
    assert decode_status(body) is None


@given(statuses)
def test_statuses_come_back(status: Status) -> None:
    assert decode_status(encode_status(status)) == status


def test_the_settings_come_back() -> None:
    settings = replace(FACTORY, name="Rösi", watchdog_ms=1500)
    assert decode_settings(encode_settings(settings)) == settings


@given(st.integers(0, 90))
def test_settings_that_are_cut_off_are_none(size: int) -> None:
    body = encode_settings(FACTORY)
    upto_watchdog = body.index(b"emulated\0") + len("emulated\0") + 14
    assert (decode_settings(body[: min(size, len(body))]) is not None) == (size >= upto_watchdog)


def test_a_base_rolls_whose_wheels_turn_whatever_the_type_of_the_packet_says() -> None:
    status = decode_status(by_hand(kind=0x32))
    assert status is not None
    assert status.rolls
    assert not status.moving
