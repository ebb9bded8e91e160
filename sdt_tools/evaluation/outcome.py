"""When a follow run has succeeded, and what went wrong where it has not."""

import math
from dataclasses import dataclass
from enum import StrEnum

from sdt_tools.config import Config
from sdt_tools.frames import Pose2D


class Outcome(StrEnum):
    """How a run ended."""

    OK = "ok"
    CONTACT = "contact"
    LOST = "lost"
    STUCK = "stuck"
    TIMEOUT = "timeout"


class SuccessConfig(Config):
    """The limits that tell success from failure. Ranges and bearings are taken from the LiDAR."""

    lost_range_m: float = 3.0
    lost_after_s: float = 3.0
    arrive_within_s: float = 10.0
    arrive_bearing_deg: float = 25.0
    arrive_range_min_m: float = 0.6
    arrive_range_max_m: float = 1.5
    still_after_s: float = 15.0
    """A robot that neither drives 0.1 m nor turns 10° for so long, while the operator stands, is stuck."""


@dataclass(frozen=True)
class Situation:
    """What the judge sees at one moment. ``operator_ended``: his path is done; ``contact``: what the robot touches."""

    time_s: float
    robot: Pose2D
    operator_range_m: float
    operator_bearing_rad: float
    operator_visible: bool
    operator_standing: bool
    operator_ended: bool
    contact: str | None


@dataclass(frozen=True)
class Verdict:
    """An outcome and, in words, the reason."""

    outcome: Outcome
    reason: str


class Judge:
    """Watches one run; ``see`` returns a verdict as soon as there is one."""

    _STILL_M = 0.1
    _STILL_RAD = math.radians(10.0)

    def __init__(self, timeout_s: float, config: SuccessConfig) -> None:
        self._timeout_s = timeout_s
        self._config = config
        self._out_of_reach_since_s: float | None = None
        self._ended_at_s: float | None = None
        self._still_since: tuple[float, Pose2D] | None = None

    def see(self, now: Situation) -> Verdict | None:
        """Judge one moment; moments come in the order of time."""
        return self._contact(now) or self._lost(now) or self._arrival(now) or self._stillness(now) or self._timeout(now)

    def _contact(self, now: Situation) -> Verdict | None:
        return None if now.contact is None else Verdict(Outcome.CONTACT, f"touched {now.contact}")

    def _lost(self, now: Situation) -> Verdict | None:
        limits = self._config
        if now.operator_visible and now.operator_range_m <= limits.lost_range_m:
            self._out_of_reach_since_s = None
            return None
        if self._out_of_reach_since_s is None:
            self._out_of_reach_since_s = now.time_s
        if now.time_s - self._out_of_reach_since_s <= limits.lost_after_s:
            return None
        why = f"{now.operator_range_m:.1f} m away" if now.operator_visible else "out of sight"
        return Verdict(Outcome.LOST, f"operator {why} for more than {limits.lost_after_s:g} s")

    def _arrival(self, now: Situation) -> Verdict | None:
        if not now.operator_ended:
            return None
        limits = self._config
        if self._ended_at_s is None:
            self._ended_at_s = now.time_s
        facing = abs(now.operator_bearing_rad) <= math.radians(limits.arrive_bearing_deg)
        near = limits.arrive_range_min_m <= now.operator_range_m <= limits.arrive_range_max_m
        if facing and near and now.operator_visible:
            return Verdict(Outcome.OK, "arrived")
        if now.time_s - self._ended_at_s > limits.arrive_within_s:
            bearing_deg = math.degrees(now.operator_bearing_rad)
            where = f"operator at {now.operator_range_m:.2f} m, {bearing_deg:+.0f}°"
            return Verdict(Outcome.STUCK, f"did not arrive within {limits.arrive_within_s:g} s: {where}")
        return None

    def _stillness(self, now: Situation) -> Verdict | None:
        if self._still_since is None or not now.operator_standing or self._has_moved(self._still_since[1], now.robot):
            self._still_since = (now.time_s, now.robot)
            return None
        if now.time_s - self._still_since[0] <= self._config.still_after_s:
            return None
        return Verdict(
            Outcome.STUCK,
            f"stood still for {self._config.still_after_s:g} s, operator waiting at {now.operator_range_m:.2f} m",
        )

    def _has_moved(self, before: Pose2D, now: Pose2D) -> bool:
        turned_rad = math.remainder(now.yaw_rad - before.yaw_rad, math.tau)
        return (
            math.hypot(now.x_m - before.x_m, now.y_m - before.y_m) > self._STILL_M or abs(turned_rad) > self._STILL_RAD
        )

    def _timeout(self, now: Situation) -> Verdict | None:
        if now.time_s < self._timeout_s:
            return None
        return Verdict(Outcome.TIMEOUT, f"not finished after {self._timeout_s:g} s")
