"""The emulated device itself, without its network: settings, state, clock, log-ins and answers."""

from dataclasses import dataclass
from enum import Enum
from threading import Lock
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.device_time import DeviceTime
from sdt_tools.robot.lms1xx.framing import Dialect
from sdt_tools.robot.lms1xx.settings import (
    FIRST_ANGLE,
    LAST_ANGLE,
    MEASURING,
    DataSettings,
    OutputRange,
    ScanSettings,
)

POSSIBLE: Final = ((5000, 5000), (2500, 5000), (2500, 2500))
"""Frequency and resolution that go together."""


class Refusal(Enum):
    """Numbers of ``sFA``."""

    NOT_ALLOWED = 0x1
    NO_SUCH_METHOD = 0x2
    NO_SUCH_VARIABLE = 0x3
    BAD_VALUES = 0x5
    TOO_SHORT = 0x8
    MAY_NOT_WRITE = 0xA
    NO_SUCH_KIND = 0xC
    NO_SUCH_EVENT = 0xF


class RefusedError(Exception):
    """The device refuses a command."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.name)
        self.refusal = refusal


@dataclass
class Session:
    """One client: as what it is logged in, and whether it wants scans."""

    level: int = 0
    streams: bool = False


@dataclass(frozen=True)
class Settings:
    """All that can be set."""

    scan: ScanSettings
    data: DataSettings
    output: OutputRange


class EmulatedDevice:
    """State that clients share. Every method may be called from any thread."""

    def __init__(self, config: EmulatedConfig, host_ns: int) -> None:
        self.config = config
        self.dialect = Dialect(config.protocol)
        resolution = 5000 if config.resolution_deg == "0.5" else 2500
        self._stored = Settings(ScanSettings(config.scan_hz * 100, resolution), DataSettings(), OutputRange(resolution))
        self.settings = self._stored
        self.time = DeviceTime(host_ns, config.start_us)
        self.telegrams = 0
        self.scans = 0
        self.power_ons = 0
        self.writes = 0
        """How often a client has changed a setting."""
        self.stored_writes = 0
        """How often one had them kept for good."""
        self._lock = Lock()
        self._measures_from_ns = 0
        self._state_before = 1
        self.switch_on(host_ns)

    def switch_on(self, host_ns: int) -> None:
        """Start: what was not stored is forgotten, clock and counters begin anew."""
        with self._lock:
            self.settings = self._stored
            self.time = DeviceTime(host_ns, self.config.start_us if not self.power_ons else 0, self.time.drift_ppm)
            self.telegrams = self.scans = 0
            self.power_ons += 1
            self._state_before = 1
            self._measures_from_ns = host_ns + round(self.config.boot_s * SECOND_NS)

    def state(self, host_ns: int) -> int:
        """The number that STlms tells."""
        with self._lock:
            if self._state_before in (2, 3):
                return self._state_before
            return MEASURING if host_ns >= self._measures_from_ns else self._state_before

    def set_scan(self, scan: ScanSettings) -> int:
        """Set frequency and resolution; the number that mLMPsetscancfg is answered with, 0 for done."""
        if (scan.frequency, scan.resolution) not in POSSIBLE:
            frequencies = {frequency for frequency, _ in POSSIBLE}
            return 1 if scan.frequency not in frequencies else 2
        with self._lock:
            output = OutputRange(scan.resolution, self.settings.output.first_angle, self.settings.output.last_angle)
            self.settings = Settings(scan, self.settings.data, output)
            self._state_before = 2
            self.writes += 1
        return 0

    def set_data(self, data: DataSettings) -> None:
        """Set what a scan's telegram holds."""
        if not data.echoes & 1 or data.interval < 1:
            raise RefusedError(Refusal.BAD_VALUES)
        with self._lock:
            self.settings = Settings(self.settings.scan, data, self.settings.output)
            self.writes += 1

    def set_output(self, output: OutputRange) -> None:
        """Set which rays are sent: angles are those of the rays nearest to what is asked for."""
        resolution = self.settings.scan.resolution
        if output.resolution <= 0 or output.resolution % resolution or output.first_angle > output.last_angle:
            raise RefusedError(Refusal.BAD_VALUES)
        first, last = (
            min(max(round((angle - FIRST_ANGLE) / resolution) * resolution + FIRST_ANGLE, FIRST_ANGLE), LAST_ANGLE)
            for angle in (output.first_angle, output.last_angle)
        )
        with self._lock:
            self.settings = Settings(
                self.settings.scan, self.settings.data, OutputRange(output.resolution, first, last)
            )
            self.writes += 1

    def start(self, host_ns: int) -> None:
        """Have the mirror turn and the laser shine; it measures after ``start_s``, unless it does already."""
        with self._lock:
            if self._state_before in (2, 3):
                self._state_before = 5
                self._measures_from_ns = host_ns + round(self.config.start_s * SECOND_NS)

    def stop(self) -> None:
        """Measure no more."""
        with self._lock:
            self._state_before = 3

    def store(self) -> None:
        """Keep the settings for good."""
        with self._lock:
            self._stored = self.settings
            self.stored_writes += 1

    def drift(self, host_ns: int, drift_ppm: float) -> None:
        """Let the clock go on at another pace."""
        with self._lock:
            self.time.drift(host_ns, drift_ppm)
