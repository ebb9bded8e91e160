"""Some seconds with a device: everything it gave, and how it behaved while it was asked."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import monotonic, sleep
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.frames import LidarScan, LogEntry, LogLevel, Odometry, RawPicture, Received
from sdt_tools.robot.devices import Device

_POLL_S: Final = 0.005
_LAG_NS: Final = 60_000_000
"""Every other half second, ``read`` is asked for what came up to so long ago: what is newer must wait."""
_LAG_TURN_NS: Final = SECOND_NS // 2

_HANDED_OVER_NS: Final = 100_000_000
"""From receipt until ``read`` can give it: a scan is read out of its telegram meanwhile."""

Arrival = Received | RawPicture


@dataclass
class Trial:
    """What was seen of a device so far. Given in the order in which ``read`` gave it."""

    clock: HostClock
    given: list[Arrival] = field(default_factory=list)
    late: int = 0
    """Things received before, or at, what an earlier ``read`` had been asked for."""
    early: int = 0
    """Things received after what ``read`` was asked for."""
    strange: list[str] = field(default_factory=list)
    """Types of things that are no arrivals."""
    read_s: list[float] = field(default_factory=list)
    failure: str = ""
    """What ``read`` has raised."""
    first_ranges_m: list[Float64[np.ndarray, "rays"]] = field(default_factory=list)
    """Copies of the ranges of the first scans, as they were when they were read."""
    asked_ns: int = 0

    def of(self, kind: type) -> list[Arrival]:
        """What came of one kind."""
        return [one for one in self.given if isinstance(content(one), kind)]

    @property
    def scans(self) -> list[LidarScan]:
        """All scans."""
        return [found for one in self.given if isinstance(found := content(one), LidarScan)]

    @property
    def poses(self) -> list[Odometry]:
        """All poses."""
        return [found for one in self.given if isinstance(found := content(one), Odometry)]

    @property
    def warnings(self) -> list[tuple[int, str]]:
        """When and what was told that is not well."""
        return [
            (one.received_ns, found.text)
            for one in self.given
            if isinstance(found := content(one), LogEntry) and found.level >= LogLevel.WARNING
        ]


def content(arrival: Arrival) -> object:
    """The message; a picture is its own."""
    return arrival.message if isinstance(arrival, Received) else arrival


def watch(device: Device, trial: Trial, seconds: float, goes_on: Callable[[], bool] = lambda: True) -> None:
    """Read ``device`` as a session does, for ``seconds`` or as long as it ``goes_on``; once more at the end."""
    end_s = monotonic() + seconds
    while monotonic() < end_s and not trial.failure and goes_on():
        now_ns = trial.clock.now_ns()
        lags = now_ns // _LAG_TURN_NS % 2 == 1
        _read(device, trial, max(now_ns - _LAG_NS if lags else now_ns, trial.asked_ns))
        sleep(_POLL_S)
    _read(device, trial, trial.clock.now_ns())


def _read(device: Device, trial: Trial, until_ns: int) -> None:
    if trial.failure:
        return
    began_s = monotonic()
    try:
        given = list(device.read(until_ns))
    except Exception as error:  # whatever a driver raises is what is to be told
        trial.failure = f"{type(error).__name__}: {error}"
        return
    trial.read_s.append(monotonic() - began_s)
    for one in _arrivals(given, trial):
        trial.early += one.received_ns > until_ns
        trial.late += one.received_ns + _HANDED_OVER_NS <= trial.asked_ns
        trial.given.append(one)
        found = content(one)
        if isinstance(found, LidarScan) and len(trial.first_ranges_m) < len(trial.scans) <= 5:
            trial.first_ranges_m.append(np.array(found.ranges_m, copy=True))
    trial.asked_ns = until_ns


def _arrivals(given: list[Arrival], trial: Trial) -> Iterator[Arrival]:
    for one in given:
        if isinstance(one, Received | RawPicture):
            yield one
        else:
            trial.strange.append(type(one).__name__)
