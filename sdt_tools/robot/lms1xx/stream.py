"""From scan telegrams to stamped scans: what the device's clock and its counters say of each."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from sdt_tools.frames import LidarScan, LogEntry, LogLevel
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.device_clock import DeviceClock
from sdt_tools.robot.lms1xx.scan_telegram import ScanTelegram
from sdt_tools.robot.lms1xx.scans import ScanCount, lidar_scan, wanted_rays

LOG_NAME: Final = "lidar"
_MICROSECONDS: Final = 1_000_000
_TURN_US: Final = 1 << 32


@dataclass
class Counts:
    """What came of a LiDAR's scans so far."""

    scans: int = 0
    """Handed out."""
    missing: int = 0
    """Made by the device, by its counter, and never received; none of these is from before a power cycle."""
    learning: int = 0
    """Received while the device's clock was being learnt, and not handed out."""


class ScanStream:
    """Takes the scan telegrams of one device in their order, over as many connections as it takes."""

    def __init__(self, config: Lms1xxConfig) -> None:
        self.clock = DeviceClock()
        self.counts = Counts()
        self._rays = wanted_rays(config.scan_settings, config.all_rays)
        self._counter = ScanCount(_MICROSECONDS // config.scan_hz)
        self._last_stamp_ns: int | None = None

    def reconnected(self) -> None:
        """What comes next comes over a new connection."""
        self.clock.reconnected()

    def take(self, scan: ScanTelegram, received_ns: int) -> Iterator[LidarScan | LogEntry]:
        """What ``scan`` gives, received at ``received_ns``: a note on what is missing before it, and the scan.

        None while the clock is being learnt. Raises TelegramError for a scan of other rays, or without distances.
        """
        restarts = self.clock.restarts
        sent_us = self.clock.see(scan.transmission_us, received_ns)
        if self.clock.restarts != restarts:
            self._counter.restart()
            yield _note(received_ns, "its clock started anew, as after a power cycle, and is being learnt")
        missing = self._counter.see(scan.scan_counter, sent_us - (scan.transmission_us - scan.start_us) % _TURN_US)
        if missing:
            self.counts.missing += missing
            scans = "scan" if missing == 1 else "scans"
            yield _note(received_ns, f"{missing} {scans} missing before number {scan.scan_counter}")
        stamp_ns = min(self.clock.host_ns(scan.start_us), received_ns)
        taken = lidar_scan(scan, self._rays, self._after_last(stamp_ns))
        if not self.clock.settled:
            self.counts.learning += 1
            return
        self._last_stamp_ns = taken.stamp_ns
        self.counts.scans += 1
        yield taken

    def _after_last(self, stamp_ns: int) -> int:
        """Stamps ascend, also where the clock is understood better in between."""
        return stamp_ns if self._last_stamp_ns is None else max(stamp_ns, self._last_stamp_ns + 1)


def _note(received_ns: int, text: str) -> LogEntry:
    return LogEntry(received_ns, LogLevel.WARNING, f"LiDAR: {text}", LOG_NAME)
