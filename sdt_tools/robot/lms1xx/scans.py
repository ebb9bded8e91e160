"""From a telegram's channels to a scan of the robot's LiDAR."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.frames import FIRST_RAY_RAD, LidarScan
from sdt_tools.robot.lms1xx.reading import TelegramError
from sdt_tools.robot.lms1xx.scan_telegram import Channel, ScanTelegram
from sdt_tools.robot.lms1xx.settings import FIRST_ANGLE, HALF_DEGREE, LAST_ANGLE, ScanSettings

DISTANCES: Final = "DIST1"
FIRST_DISTANCE: Final = 16
"""Smaller raw values are codes, such as 0, 2 and 3: no scale applies to them (SICK, *Operating instructions LMS4000*,
8023198, "LMDscandata - reserved values")."""


class RaysError(TelegramError):
    """A scan with other rays than the device was set to."""


@dataclass(frozen=True)
class Rays:
    """Which rays a scan must have, and which of them are taken."""

    settings: ScanSettings
    every: int

    @property
    def count(self) -> int:
        """How many rays the device sends."""
        return (LAST_ANGLE - FIRST_ANGLE) // self.settings.resolution + 1


def wanted_rays(settings: ScanSettings, all_rays: bool) -> Rays:
    """Those of ``settings``; unless ``all_rays``, half a degree apart."""
    return Rays(settings, 1 if all_rays else max(HALF_DEGREE // settings.resolution, 1))


def ranges_m(channel: Channel) -> Float64[np.ndarray, "rays"]:
    """Distances in metres; codes as if they were millimetres, whatever the scale."""
    raw = channel.values
    distances_mm = channel.offset + channel.scale * raw
    return np.where(raw < FIRST_DISTANCE, raw, distances_mm) / 1000.0


def lidar_scan(scan: ScanTelegram, rays: Rays, stamp_ns: int) -> LidarScan:
    """The scan that ``scan`` holds, taken at ``stamp_ns``. Straight ahead is 90 degrees in the device's frame.

    Raises RaysError for other rays than ``rays``, TelegramError where there are no distances.
    """
    channel = scan.channel(DISTANCES)
    if channel is None:
        raise TelegramError(f"a scan without {DISTANCES}")
    found = (len(channel.values), channel.start_angle, channel.step)
    if found != (rays.count, FIRST_ANGLE, rays.settings.resolution):
        raise RaysError(
            f"it sends {found[0]} rays from {found[1] / 1e4:g}° in steps of {found[2] / 1e4:g}°, not {rays.count} from "
            f"{FIRST_ANGLE / 1e4:g}° in steps of {rays.settings.resolution / 1e4:g}°; does another program set it?"
        )
    return LidarScan(stamp_ns, ranges_m(channel)[:: rays.every], FIRST_RAY_RAD, -FIRST_RAY_RAD)


class ScanCount:
    """Counts scans that were made and did not come, by the device's scan counter of 16 bits.

    After a pause that is longer than the counter takes for a turn, the device's time says how often it turned.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us = period_us
        self._last: tuple[int, int] | None = None

    def see(self, counter: int, start_us: int) -> int:
        """Take note of a scan that began at ``start_us`` (without wraps); how many are missing just before it."""
        last, self._last = self._last, (counter, start_us)
        if last is None:
            return 0
        step = (counter - last[0]) % 0x10000
        turns = round(((start_us - last[1]) / self._period_us - step) / 0x10000)
        return max(step + turns * 0x10000 - 1, 0)

    def restart(self) -> None:
        """The device counts from the start again."""
        self._last = None
