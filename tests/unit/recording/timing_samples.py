"""Drives whose timing is known, for tests: periods, lateness, drift and what is missing are planted."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from recording_samples import T0

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import CameraImage, LidarScan, Received

MS_NS = 1_000_000
RANGES_M = np.full(541, 2.0)


@dataclass(frozen=True)
class Stream:
    """Messages of one sensor: stamps every ``period_ns`` with normal jitter, received after a delay that drifts."""

    period_ns: float
    delay_ns: int = 0
    jitter_ns: int = 0
    late_ns: int = 0
    """Mean of an exponential lateness on top of the delay."""
    drift_ppm: float = 0.0
    missing: Collection[int] = ()
    seed: int = 0

    def times(self, seconds: float) -> list[tuple[int, int]]:
        """Received and stamp of each message; none overtakes another."""
        rng = np.random.default_rng(self.seed)
        times: list[tuple[int, int]] = []
        for number in range(round(seconds * SECOND_NS / self.period_ns)):
            stamp_ns = round(number * self.period_ns + rng.normal(0, self.jitter_ns))
            late_ns = rng.exponential(self.late_ns) if self.late_ns else 0.0
            received_ns = round(stamp_ns + self.delay_ns + late_ns + self.drift_ppm * 1e-6 * stamp_ns)
            if number not in self.missing:
                before_ns = times[-1][0] if times else 0
                times.append((max(T0 + received_ns, before_ns), T0 + stamp_ns))
        return times

    def scans(self, seconds: float) -> list[Received]:
        return [Received(received_ns, LidarScan(stamp_ns, RANGES_M)) for received_ns, stamp_ns in self.times(seconds)]

    def images(self, seconds: float) -> list[Received]:
        return [Received(received_ns, CameraImage(stamp_ns, b"jpeg")) for received_ns, stamp_ns in self.times(seconds)]


def together(*streams: list[Received]) -> list[Received]:
    """All messages in the order of receipt."""
    return sorted((received for stream in streams for received in stream), key=lambda received: received.received_ns)
