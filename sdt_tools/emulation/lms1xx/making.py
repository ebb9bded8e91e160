"""From ranges to the scan telegram that a device makes of them, as it is set."""

from typing import Final

import numpy as np
from jaxtyping import Float64, Int64

from sdt_tools.robot.lms1xx.scan_telegram import Channel, DeviceTime, ScanTelegram
from sdt_tools.robot.lms1xx.scans import FIRST_DISTANCE
from sdt_tools.robot.lms1xx.settings import FIRST_ANGLE, HALF_DEGREE, DataSettings, OutputRange, ScanSettings

SERIAL: Final = 9_260_036
_JUMP_M: Final = 0.1
_FARTHEST: Final = 0xFFFF
_COUNT: Final = 0x10000
_TURN_US: Final = 1 << 32
_US: Final = 1_000_000


def make_scan(
    ranges_m: Float64[np.ndarray, "rays"],
    scan: ScanSettings,
    data: DataSettings,
    output: OutputRange,
    times_us: tuple[int, int],
    counters: tuple[int, int],
    scale: int = 1,
    device_name: str = "",
) -> ScanTelegram:
    """The telegram of a scan of 541 ``ranges_m`` at half a degree.

    ``times_us``: when it began and when it is sent, wrapped here; ``counters``: of telegrams and scans, likewise.
    """
    rays_m = ranges_m if scan.resolution == HALF_DEGREE else _between(ranges_m)
    first = (output.first_angle - FIRST_ANGLE) // scan.resolution
    last = (output.last_angle - FIRST_ANGLE) // scan.resolution
    sent_m = rays_m[first : last + 1 : max(output.resolution // scan.resolution, 1)]
    raw = raw_values(sent_m, scale)
    channels = [Channel("DIST1", float(scale), 0.0, output.first_angle, output.resolution, raw)]
    channels_8bit: list[Channel] = []
    if data.remission:
        strengths = _strengths(sent_m, 16 if data.remission_16bit else 8)
        channel = Channel("RSSI1", 1.0, 0.0, output.first_angle, output.resolution, strengths)
        (channels if data.remission_16bit else channels_8bit).append(channel)
    began_us, sent_us = times_us
    telegrams, scans = counters
    return ScanTelegram(
        telegrams % _COUNT,
        scans % _COUNT,
        began_us % _TURN_US,
        sent_us % _TURN_US,
        tuple(channels),
        tuple(channels_8bit),
        scan.frequency,
        round(360 * scan.frequency / scan.resolution),
        serial_number=SERIAL,
        device_name=(device_name or "not defined") if data.device_name else None,
        time=_calendar(began_us) if data.time else None,
    )


def raw_values(ranges_m: Float64[np.ndarray, "rays"], scale: int) -> Int64[np.ndarray, "rays"]:
    """Millimetres divided by ``scale``; what is below 16 mm is a code, and stays."""
    mm = np.rint(np.nan_to_num(ranges_m, posinf=0.0, neginf=0.0) * 1000).astype(np.int64)
    scaled = np.maximum(np.rint(mm / scale).astype(np.int64), FIRST_DISTANCE)
    raw: Int64[np.ndarray, "rays"] = np.clip(np.where(mm < FIRST_DISTANCE, mm, scaled), 0, _FARTHEST)
    return raw


def _between(ranges_m: Float64[np.ndarray, "rays"]) -> Float64[np.ndarray, "twice_less_1"]:
    """A ray between any two: their mean on one surface, else the nearer one's range."""
    one, other = ranges_m[:-1], ranges_m[1:]
    dense = np.empty(2 * len(ranges_m) - 1)
    dense[::2] = ranges_m
    dense[1::2] = np.where(np.abs(one - other) < _JUMP_M, (one + other) / 2, np.minimum(one, other))
    return dense


def _strengths(ranges_m: Float64[np.ndarray, "rays"], bits: int) -> Int64[np.ndarray, "rays"]:
    """Weaker with distance, 0 where nothing came back."""
    valid = ranges_m * 1000 >= FIRST_DISTANCE
    share = np.where(valid, 1.0 / (1.0 + np.nan_to_num(ranges_m) / 5.0), 0.0)
    strengths: Int64[np.ndarray, "rays"] = np.rint(share * ((1 << bits) - 2)).astype(np.int64)
    return strengths


def _calendar(device_us: int) -> DeviceTime:
    """A calendar that nobody has set: it began with 1970 when the device was switched on."""
    seconds, microsecond = divmod(device_us, _US)
    minutes, second = divmod(seconds, 60)
    hours, minute = divmod(minutes, 60)
    return DeviceTime(1970, 1, 1 + hours // 24 % 31, hours % 24, minute, second, microsecond)
