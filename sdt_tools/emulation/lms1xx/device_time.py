"""The clock of an emulated device: microseconds since it was switched on, too fast or too slow."""

from typing import Final

US_NS: Final = 1000
TURN_US: Final = 1 << 32


class DeviceTime:
    """Starts at ``start_us`` at the host's ``host_ns``; ``drift_ppm`` says by how much it is too fast."""

    def __init__(self, host_ns: int, start_us: int = 0, drift_ppm: float = 0.0) -> None:
        self._host_ns = host_ns
        self._us = float(start_us)
        self.drift_ppm = drift_ppm

    def us_at(self, host_ns: int) -> float:
        """Its time, which does not wrap, at ``host_ns``."""
        return self._us + (host_ns - self._host_ns) / US_NS * self._pace

    def host_at(self, us: float) -> int:
        """The host's time when it shows ``us``."""
        return self._host_ns + round((us - self._us) * US_NS / self._pace)

    def drift(self, host_ns: int, drift_ppm: float) -> None:
        """Go on from ``host_ns`` at another pace."""
        self._us, self._host_ns = self.us_at(host_ns), host_ns
        self.drift_ppm = drift_ppm

    @property
    def _pace(self) -> float:
        return 1.0 + self.drift_ppm * 1e-6
