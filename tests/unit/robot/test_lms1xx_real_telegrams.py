"""Every telegram of real devices at hand, held against what was read from it by hand."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from sdt_tools.robot.lms1xx.framing import Dialect, splitter_for
from sdt_tools.robot.lms1xx.reading import BinaryReader, TelegramError
from sdt_tools.robot.lms1xx.scan_telegram import Channel, DeviceTime, ScanTelegram, read_scan
from sdt_tools.robot.lms1xx.scans import ranges_m
from sdt_tools.robot.lms1xx.telegram import parse_telegram

WHOLE = ("lms111_sibtra_541_name_time", "lms1xx_telegram_listing_example_21")
CUT = "sick_scan_tcp_pypi_541"
BINARY = "tim7xx_colab_test_pcapng"


@pytest.fixture
def folder() -> Path:
    found = Path(os.environ.get("SDT_DATA", "/nowhere")) / "lms1xx"
    if not found.is_dir():
        pytest.skip("SDT_DATA names no folder with lms1xx, the traffic of real devices")
    return found


@pytest.mark.parametrize("name", WHOLE)
def test_a_text_telegram_says_what_was_read_by_hand(folder: Path, name: str) -> None:
    expected = json.loads((folder / f"{name}.json").read_text())["expected"]
    (body,) = splitter_for(Dialect.A).feed((folder / f"{name}.cola_a.bin").read_bytes())
    telegram = parse_telegram(Dialect.A, body)
    scan = read_scan(telegram.fields)
    assert (telegram.kind, telegram.name) == (expected["command_type"], expected["command"])
    assert telegram.fields.at_end
    check_head(scan, expected)
    (channel,) = scan.channels_16bit
    check_channel(channel, expected["channels_16bit"][0])
    assert scan.channels_8bit == ()
    assert (scan.position, scan.comment, scan.event) == (None, None, None)
    assert scan.device_name == expected.get("device_name")
    assert scan.time == (DeviceTime(**expected["timestamp"]) if expected["time_present"] else None)


def check_head(scan: ScanTelegram, expected: dict) -> None:
    assert scan.version == expected["version"]
    assert scan.device_number == expected["device_number"]
    assert scan.serial_number == expected["serial_number"]
    assert scan.device_status == tuple(expected["device_status"])
    assert scan.telegram_counter == expected["telegram_counter"]
    assert scan.scan_counter == expected["scan_counter"]
    assert scan.start_us == expected["time_since_startup_us"]
    assert scan.transmission_us == expected["time_of_transmission_us"]
    assert scan.inputs == tuple(expected["digital_inputs"])
    assert scan.outputs == tuple(expected["digital_outputs"])
    assert scan.reserved == expected["reserved"]
    assert scan.scan_frequency / 100 == expected["scan_frequency_hz"]
    assert scan.measurement_frequency * 100 == expected["measurement_frequency_hz"]
    assert list(scan.encoders) == expected["encoders"]


def check_channel(channel: Channel, expected: dict) -> None:
    assert channel.content == expected["content"]
    assert (channel.scale, channel.offset) == (expected["scale"], expected["offset"])
    assert channel.start_angle / 1e4 == expected["start_angle_deg"]
    assert channel.step / 1e4 == expected["step_deg"]
    assert len(channel.values) == expected["count"]
    assert ranges_m(channel)[:5].tolist() == expected["first5_m"]
    assert ranges_m(channel)[-5:].tolist() == expected["last5_m"]
    raw = channel.values
    assert (raw.min(), raw.max(), raw.sum()) == (expected["min_raw"], expected["max_raw"], expected["sum_raw"])
    assert int((raw == 0).sum()) == expected["n_raw_0"]


def test_the_telegram_that_was_cut_off_is_none_and_reading_it_says_so(folder: Path) -> None:
    data = (folder / f"{CUT}.cola_a.bin").read_bytes()
    splitter = splitter_for(Dialect.A)
    assert splitter.feed(data) == []
    assert splitter.pending == data
    with pytest.raises(TelegramError, match=r"DIST1: cut off after \d+ of 541 values"):
        read_scan(parse_telegram(Dialect.A, data[1:]).fields)


def test_real_binary_traffic_in_its_tcp_segments_gives_every_scan(folder: Path) -> None:
    document = json.loads((folder / f"{BINARY}.json").read_text())
    data = (folder / f"{BINARY}.cola_b.bin").read_bytes()
    splitter = splitter_for(Dialect.B)
    bodies = []
    for _, offset, length in document["tcp_segments_ts_offset_len"]:
        bodies += splitter.feed(data[offset : offset + length])
    assert (splitter.pending, splitter.damaged, splitter.skipped) == (b"", 0, 0)
    assert len(bodies) == len(document["telegrams"])
    for body, expected in zip(bodies, document["telegrams"], strict=True):
        check_binary(body, expected)


def check_binary(body: bytes, expected: dict) -> None:
    telegram = parse_telegram(Dialect.B, body)
    scan = read_scan(telegram.fields)
    assert telegram.fields.at_end
    assert len(body) == expected["length"]
    assert (scan.telegram_counter, scan.scan_counter) == (expected["telegram_counter"], expected["scan_counter"])
    assert (scan.start_us, scan.transmission_us) == (
        expected["time_since_startup_us"],
        expected["time_of_transmission_us"],
    )
    assert (scan.serial_number, scan.measurement_frequency) == (expected["serial"], expected["meas_freq_raw"])
    for channel, wanted in zip(scan.channels_16bit, expected["channels"], strict=True):
        assert channel.content == wanted["content"]
        assert (len(channel.values), int(channel.values.sum())) == (wanted["count"], wanted["sum"])
        assert channel.values[:5].tolist() == wanted["first5"]
        assert channel.values[-5:].tolist() == wanted["last5"]
    assert scan.time == time_of(bytes.fromhex(expected["tail_hex"]))


def time_of(tail: bytes) -> DeviceTime:
    """The calendar behind three absent parts, read here in another way than by the product."""
    year, month, day, hour, minute, second = np.frombuffer(tail[8:15], ">u2,u1,u1,u1,u1,u1")[0].tolist()
    return DeviceTime(year, month, day, hour, minute, second, int.from_bytes(tail[15:19], "big"))


def test_codes_of_real_scans_are_no_millimetres_times_scale() -> None:
    channel = Channel("DIST1", 2.0, 0.0, -450_000, 5_000, np.array([0, 2, 3, 15, 16, 5000]))
    assert ranges_m(channel).tolist() == [0.0, 0.002, 0.003, 0.015, 0.032, 10.0]


def test_binary_strings_are_read_with_short_and_with_long_lengths() -> None:
    assert BinaryReader(b"\x03abc").short_string() == "abc"
    assert BinaryReader(b"\x00\x03abc").short_string() == "abc"
    reader = BinaryReader(b"\x00\x00\x01")
    assert reader.short_string() == ""
    assert reader.unsigned(16) == 1
