"""Rules for a base: its poses, and, where it may move, that it drives as it is told and stands when it must."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from statistics import median
from time import monotonic
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.emergency import EmergencyStop
from sdt_tools.frames import FRAME_ODOM, Odometry, Pose2D, Twist
from sdt_tools.robot.contract.trial import Trial, watch
from sdt_tools.robot.contract.verdict import Verdict, broken, judged, kept, not_judged
from sdt_tools.robot.devices import Base

REST: Final = Twist(0.0, 0.0)
AHEAD: Final = Twist(0.15, 0.0)
LEFT: Final = Twist(0.0, 0.4)
NO_NUMBERS: Final = Twist(math.nan, math.nan)
_DRIVES_S: Final = 1.5
_STOPS_S: Final = 1.5
_EXPIRES_S: Final = 2.0
"""A second until it is too old, and then it brakes."""
_LOOKED_AT_S: Final = 0.5
"""At the end of a phase, the poses of so long tell whether it moves."""
_STANDS_M: Final = 0.01
_STANDS_RAD: Final = 0.03
_MOVED_M: Final = 0.05
_MOVED_RAD: Final = 0.1
_AT_ONCE_S: Final = 0.004


def pose_rules(trial: Trial) -> list[Verdict]:
    """The verdicts on its poses."""
    poses = trial.poses
    if not poses:
        return []
    faults = []
    if not all(math.isfinite(value) for one in poses for value in _values(one.pose)):
        faults.append("one is not finite")
    frames = {one.frame_id for one in poses} - {FRAME_ODOM}
    faults += [f"the frame is {', '.join(sorted(frames))}, not {FRAME_ODOM}"] if frames else []
    last = poses[-1].pose
    return [judged("poses are finite", faults, f"{last.x_m:.2f} m, {last.y_m:.2f} m, {last.yaw_rad:.2f} rad")]


def unmoved_rules() -> list[Verdict]:
    """What is not judged of a base that may not move."""
    return [not_judged("it drives and stands as it is told", "lift its wheels off the ground, and give --move")]


@dataclass
class DrivingTest:
    """A base that is moved, phase by phase. ``emergency`` is the one that it was made with."""

    base: Base
    emergency: EmergencyStop
    trial: Trial
    took_s: list[float] = field(default_factory=list)
    raised: str = ""

    def verdicts(self) -> Iterator[Verdict]:
        """Move it, and judge; it stands at the end, where it keeps the rules."""
        self._phase(_DRIVES_S, lambda: self._command(REST))
        yield self._moves("forward is ahead", AHEAD)
        yield self._stands("told to stand, it stands", _STOPS_S, lambda: self._command(REST))
        yield self._moves("left is counter-clockwise", LEFT)
        yield self._stands("what nobody commands again ends within a second", _EXPIRES_S, None)
        self._phase(_DRIVES_S, lambda: self._command(AHEAD))
        self.emergency.pull("sdt robot check")
        yield self._stands("pulled, the emergency stop holds it, whatever is commanded", _STOPS_S, self._ahead)
        self.emergency.release()
        yield self._stands("released, it stands until it is commanded anew", _STOPS_S, None)
        yield self._stands("a twist of no numbers is standstill", _STOPS_S, lambda: self._command(NO_NUMBERS))
        yield self._commanding()
        self._phase(_DRIVES_S, self._ahead)

    def _ahead(self) -> None:
        self._command(AHEAD)

    def _phase(self, seconds: float, each: Callable[[], None] | None) -> None:
        def goes_on() -> bool:
            if each is not None:
                each()
            return True

        watch(self.base, self.trial, seconds, goes_on)

    def _command(self, twist: Twist) -> None:
        began_s = monotonic()
        try:
            self.base.command(twist)
        except Exception as error:  # whatever a driver raises is what is to be told
            self.raised = self.raised or f"command({twist}) raised {type(error).__name__}: {error}"
        self.took_s.append(monotonic() - began_s)

    def _moves(self, rule: str, twist: Twist) -> Verdict:
        before = len(self.trial.poses)
        self._phase(_DRIVES_S, lambda: self._command(twist))
        ahead_m, turned_rad = _driven(self.trial.poses[max(before - 1, 0) :])
        seen = f"{ahead_m:+.2f} m and {turned_rad:+.2f} rad in {_DRIVES_S:g} s"
        enough = ahead_m > _MOVED_M if twist.linear_mps else turned_rad > _MOVED_RAD
        return kept(rule, seen) if enough else broken(rule, f"{seen}, commanded {twist}")

    def _stands(self, rule: str, seconds: float, each: Callable[[], None] | None) -> Verdict:
        self._phase(seconds, each)
        return stands(rule, self.trial)

    def _commanding(self) -> Verdict:
        rule = "command returns at once, and does not raise"
        typical_s = median(self.took_s)
        faults = [self.raised] if self.raised else []
        if typical_s > _AT_ONCE_S:
            faults.append(f"{typical_s * 1e3:.1f} ms in the middle; leave it to a thread of the driver's own")
        return judged(rule, faults, f"{typical_s * 1e3:.2f} ms in the middle of {len(self.took_s)}")


def stands(rule: str, trial: Trial) -> Verdict:
    """Whether the newest poses are of a base that stands."""
    newest = [one for one in trial.poses if one.stamp_ns > trial.asked_ns - _LOOKED_AT_S * SECOND_NS]
    if len(newest) < 2:
        return not_judged(rule, "no poses came")
    ahead_m, turned_rad = _driven(newest)
    seen = f"{ahead_m * 1e3:+.0f} mm and {turned_rad:+.3f} rad in the last {_LOOKED_AT_S:g} s"
    is_still = abs(ahead_m) < _STANDS_M and abs(turned_rad) < _STANDS_RAD
    return kept(rule, seen) if is_still else broken(rule, f"it moves: {seen}")


def _driven(poses: list[Odometry]) -> tuple[float, float]:
    """From the first pose to the last: metres ahead as it stood at first, and radians to the left."""
    if not poses:
        return 0.0, 0.0
    first, last = poses[0].pose, poses[-1].pose
    ahead_m = (last.x_m - first.x_m) * math.cos(first.yaw_rad) + (last.y_m - first.y_m) * math.sin(first.yaw_rad)
    return ahead_m, math.remainder(last.yaw_rad - first.yaw_rad, 2 * math.pi)


def _values(pose: Pose2D) -> tuple[float, float, float]:
    return pose.x_m, pose.y_m, pose.yaw_rad
