"""A guard against what stands ahead, beneath whatever drives."""

import math
import threading
from enum import IntEnum
from typing import Final

import numpy as np
from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.frames import (
    LIDAR_AHEAD_M,
    ROBOT_LENGTH_M,
    ROBOT_WIDTH_M,
    LidarScan,
    LogEntry,
    LogLevel,
    Received,
    Twist,
)
from sdt_tools.models.preprocess import PreprocessConfig, invalid_front_share, invalid_rays
from sdt_tools.protocols import Actuator

NAME: Final = "guard"
_NOSE_M: Final = ROBOT_LENGTH_M / 2 - LIDAR_AHEAD_M
"""The robot reaches so far ahead of its LiDAR."""
_RAYS_NEEDED: Final = 2
"""One ray alone may err; the thinnest pole meets two at 2 m."""


class GuardConfig(Config):
    """When the guard acts.

    ``stop_m``: what is left between the robot's front and an obstacle when it has stopped. ``side_m``: how far beyond
    its sides it looks. ``reaction_s``: what passes from a scan to the brakes, at most. ``brake_mps2``: what the base
    brakes with. ``invalid_share``: with more codes among the front rays than that, it does not see.
    """

    stop_m: float = Field(default=0.3, ge=0)
    side_m: float = Field(default=0.05, ge=0)
    reaction_s: float = Field(default=0.25, ge=0)
    brake_mps2: float = Field(default=0.8, gt=0)
    invalid_share: float = Field(default=0.5, ge=0, le=1)

    def speed_mps(self, clearance_m: float) -> float:
        """The most at which the robot still stops ``stop_m`` before what is ``clearance_m`` ahead of its front.

        From v t + v² / 2a = d: reaction and braking take the room that there is.
        """
        room_m = clearance_m - self.stop_m
        if room_m <= 0.0:
            return 0.0
        lost_mps = self.brake_mps2 * self.reaction_s
        return math.sqrt(lost_mps * lost_mps + 2.0 * self.brake_mps2 * room_m) - lost_mps


def clearance_m(scan: LidarScan, side_m: float, preprocess: PreprocessConfig) -> float:
    """Free way ahead of the robot's front, as wide as the robot and ``side_m`` more on each side.

    It is inf where nothing is met, and negative nearer than the front. Codes are no distances, and are passed over.
    """
    valid = ~invalid_rays(scan.ranges_m[np.newaxis], preprocess)[0]
    angles_rad = np.linspace(scan.start_angle_rad, scan.end_angle_rad, len(scan.ranges_m))[valid]
    ahead_m = scan.ranges_m[valid] * np.cos(angles_rad)
    aside_m = scan.ranges_m[valid] * np.sin(angles_rad)
    met_m = ahead_m[(ahead_m > 0.0) & (np.abs(aside_m) <= ROBOT_WIDTH_M / 2 + side_m)]
    if len(met_m) < _RAYS_NEEDED:
        return math.inf
    return float(np.partition(met_m, _RAYS_NEEDED - 1)[_RAYS_NEEDED - 1]) - _NOSE_M


class _Acts(IntEnum):
    FREE = 0
    SLOWS = 1
    STOPS = 2


class ObstacleGuard:
    """Passes twists on to ``below``, and forward no faster than the way ahead allows. Implements Actuator and Observer.

    It has to see the scans. It acts on each of them, also between two commands; without a scan, or without enough valid
    front rays, nothing drives forward. It knows nothing of what is beside and behind. ``entries`` says when it acts.
    Commands and scans may come from different threads. A watchdog belongs above it, not below: what the guard sends by
    itself is nobody's decision.
    """

    def __init__(
        self,
        below: Actuator,
        config: GuardConfig | None = None,
        preprocess: PreprocessConfig | None = None,
        is_on: bool = True,
    ) -> None:
        self._below = below
        self._config = GuardConfig() if config is None else config
        self._preprocess = PreprocessConfig() if preprocess is None else preprocess
        self._is_on = is_on
        self._limit_mps = 0.0
        self._reason = "no scan yet"
        self._wanted = Twist(0.0, 0.0)
        self._sent: Twist | None = None
        self._acts = _Acts.FREE
        self._now_ns = 0
        self._entries: list[LogEntry] = []
        self._lock = threading.RLock()

    @property
    def is_on(self) -> bool:
        """Whether it guards."""
        return self._is_on

    def switch(self, is_on: bool) -> None:
        """Guard, or let everything pass."""
        if is_on is not self._is_on:
            self._is_on = is_on
            self._tell(LogLevel.INFO if is_on else LogLevel.WARNING, f"the guard is {'on' if is_on else 'off'}")

    def command(self, twist: Twist) -> None:
        """Drive with ``twist``, as far as that is safe."""
        with self._lock:
            self._wanted = twist
            self._pass_on(again=True)

    def observe(self, received: Received) -> None:
        """Look at a scan."""
        self._now_ns = max(self._now_ns, received.received_ns)
        if not isinstance(received.message, LidarScan):
            return
        limit_mps, reason = self._limit(received.message)
        with self._lock:
            self._limit_mps, self._reason = limit_mps, reason
            self._pass_on(again=False)

    def entries(self) -> list[LogEntry]:
        """What it has to say since the last call."""
        with self._lock:
            said, self._entries = self._entries, []
        return said

    def close(self) -> None:
        """The session has ended."""

    def _limit(self, scan: LidarScan) -> tuple[float, str]:
        """The most that ``scan`` allows forward, and what it is that limits."""
        config = self._config
        share = float(invalid_front_share(scan.ranges_m[np.newaxis], self._preprocess)[0])
        if share > config.invalid_share:
            return 0.0, f"{share:.0%} of the front rays see nothing"
        ahead_m = clearance_m(scan, config.side_m, self._preprocess)
        return config.speed_mps(ahead_m), f"something {ahead_m:.2f} m ahead"

    def _pass_on(self, again: bool) -> None:
        wanted = self._wanted
        speed_mps = min(wanted.linear_mps, self._limit_mps) if self._is_on else wanted.linear_mps
        self._note(speed_mps)
        twist = Twist(speed_mps, wanted.angular_radps)
        if again or twist != self._sent:
            self._sent = twist
            self._below.command(twist)

    def _note(self, speed_mps: float) -> None:
        wanted_mps, before = self._wanted.linear_mps, self._acts
        self._acts = _Acts.FREE if speed_mps == wanted_mps else _Acts.SLOWS if speed_mps > 0.0 else _Acts.STOPS
        if self._acts > before:
            does = "stops" if self._acts is _Acts.STOPS else f"slows from {wanted_mps:.2f} to {speed_mps:.2f} m/s"
            self._tell(LogLevel.WARNING, f"{self._reason}: the robot {does}")
        elif self._acts is _Acts.FREE and before is not _Acts.FREE and wanted_mps > 0.0:
            self._tell(LogLevel.INFO, "the way ahead is free again")

    def _tell(self, level: LogLevel, text: str) -> None:
        self._entries.append(LogEntry(self._now_ns, level, text, NAME))
