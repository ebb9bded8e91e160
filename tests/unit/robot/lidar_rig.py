"""A driver at an emulated LiDAR, over a real loopback socket, with the truth beside it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

import numpy as np

from sdt_tools.clock import HostClock
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.emulation.lms1xx.faults import Faults
from sdt_tools.frames import RAYS, LidarScan, LogEntry, Received
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.driver import Lms1xx

SLOPE_M = 1.0 + np.arange(RAYS) / 1000


class Slope:
    """Ray k measures 1 m and k millimetres; the last three are codes."""

    def ranges_at(self, host_ns: int) -> np.ndarray:
        ranges_m = SLOPE_M.copy()
        ranges_m[-3:] = (0.0, 0.002, 0.003)
        return ranges_m


class Rig:
    def __init__(self, emulator: EmulatedLms1xx, lidar: Lms1xx, clock: HostClock, truth_ns: list[int]) -> None:
        self.emulator, self.lidar, self.clock, self.truth_ns = emulator, lidar, clock, truth_ns
        self.received: list[Received] = []

    @property
    def scans(self) -> list[LidarScan]:
        return [one.message for one in self.received if isinstance(one.message, LidarScan)]

    @property
    def log(self) -> list[str]:
        return [one.message.text for one in self.received if isinstance(one.message, LogEntry)]

    def errors_ms(self) -> np.ndarray:
        """How far each stamp is from the beginning of the nearest scan."""
        truth_ns = np.array(self.truth_ns)
        return np.array([np.abs(truth_ns - scan.stamp_ns).min() / 1e6 for scan in self.scans])

    def until(self, happened: Callable[[], bool], patience_s: float = 8.0) -> float:
        """Read until it ``happened``; how long that took."""
        began_s = monotonic()
        while monotonic() - began_s < patience_s:
            self.received += self.lidar.read(self.clock.now_ns())
            if happened():
                return monotonic() - began_s
            self.lidar.wait(0.05)
        raise AssertionError(f"did not happen; log: {self.log}, status: {self.lidar.status}")

    def more_scans(self, count: int) -> float:
        wanted = len(self.scans) + count
        return self.until(lambda: len(self.scans) >= wanted)

    def logged(self, words: str) -> float:
        return self.until(lambda: any(words in line for line in self.log))


@contextmanager
def rig(emulated: EmulatedConfig | None = None, faults: Faults | None = None, **settings: object) -> Iterator[Rig]:
    clock, truth_ns = HostClock(), []
    device = emulated or EmulatedConfig(port=0)
    with EmulatedLms1xx(Slope(), device, faults, clock, lambda _, at_ns: truth_ns.append(at_ns)) as emulator:
        config = Lms1xxConfig(host="127.0.0.1", port=emulator.port, protocol=device.protocol, **settings)
        lidar = Lms1xx(config, clock)
        try:
            yield Rig(emulator, lidar, clock, truth_ns)
        finally:
            lidar.close()
