"""Whether the whole controller did its work in a run: summoned, followed, sent to rest, and nothing by itself."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum

from sdt_tools.config import Config
from sdt_tools.control.mode_machine import SWITCHES
from sdt_tools.evaluation.outcome import Judge, Outcome, Situation, SuccessConfig, Verdict
from sdt_tools.evaluation.situation import situation_in
from sdt_tools.evaluation.vision.commands import ModeTally, commands_of
from sdt_tools.frames import Mode, MotionCommand, Pose2D, Received
from sdt_tools.scene.world import World


class WholeOutcome(StrEnum):
    """How a run of the whole controller ended; where several are true, the first of these in this order."""

    OK = "ok"
    CONTACT = "contact"
    SWITCHED = "switched"
    """The mode changed by a misread gesture."""
    MISSED = "missed"
    """A command was not heard, or heard too late."""
    FOLLOW = "follow"
    """Active, it lost the operator, got stuck, or did not arrive at him."""
    MOVED = "moved"
    """Idle, it did not stand."""


class WholeConfig(Config):
    """The limits of a whole run, beside those of following."""

    react_within_s: float = 2.0
    """A command is to be heard so soon after its gesture counts as shown."""
    stands_after_s: float = 1.0
    """So long after it has become idle the robot is to stand."""
    stands_m: float = 0.05
    """What counts as standing: it stays within this distance of where it was then."""


@dataclass(frozen=True)
class WholeVerdict:
    """An outcome and, in words, the reason."""

    outcome: WholeOutcome
    reason: str


class WholeRunJudge:
    """Watches a scene while the controller drives. Implements Observer; ``verdict`` when the run has ended.

    It judges at every motion decision. *Following* is judged as for a follow network, from when the robot is active as
    commanded until the operator's arms begin to disable it: no contact, not lost, not stuck; where the operator has
    stood at the end of his path for as long as an arrival may take, the robot has arrived.
    """

    def __init__(self, world: World, follow: SuccessConfig, config: WholeConfig) -> None:
        self._world = world
        self._config = config
        self._judge = Judge(math.inf, follow)
        self._followed: Verdict | None = None
        self._idle_since_s: float | None = None
        self._stood_at: Pose2D | None = None
        self._moved: str = ""

    def observe(self, received: Received) -> None:
        """Judge the moment of a command."""
        message = received.message
        if isinstance(message, MotionCommand):
            now = situation_in(self._world)
            if message.mode is Mode.IDLE:
                self._see_idle(now)
            else:
                self._idle_since_s = self._stood_at = None
                self._see_active(now)

    def close(self) -> None:
        """Nothing is open."""

    def verdict(self, tally: ModeTally) -> WholeVerdict:
        """What came of the run whose modes are in ``tally``."""
        if self._world.contact is not None:
            return WholeVerdict(WholeOutcome.CONTACT, f"touched {self._world.contact}")
        if tally.errors:
            first = tally.errors[0]
            gesture = SWITCHES[Mode.IDLE if first.mode is Mode.ACTIVE else Mode.ACTIVE].label
            more = f" and {len(tally.errors) - 1} more" if len(tally.errors) > 1 else ""
            what = f"{first.mode.label} at {first.time_s:.1f} s: {gesture} was read where it was not shown{more}"
            return WholeVerdict(WholeOutcome.SWITCHED, what)
        if tally.missed:
            command = tally.missed[0]
            return WholeVerdict(WholeOutcome.MISSED, f"{command.gesture.label} at {command.at_s:.1f} s was not heard")
        late_s = max(tally.reactions_s, default=0.0)
        if late_s > self._config.react_within_s:
            return WholeVerdict(WholeOutcome.MISSED, f"a command was heard after {late_s:.1f} s")
        if self._followed is not None and self._followed.outcome is not Outcome.OK:
            return WholeVerdict(WholeOutcome.FOLLOW, self._followed.reason)
        if self._moved:
            return WholeVerdict(WholeOutcome.MOVED, self._moved)
        return WholeVerdict(WholeOutcome.OK, "as commanded")

    def _see_active(self, now: Situation) -> None:
        world = self._world
        if self._followed is not None or world.commanded_mode is not Mode.ACTIVE or self._disables(now.time_s):
            return
        self._followed = self._judge.see(replace(now, operator_ended=world.operator_at_end))

    def _disables(self, time_s: float) -> bool:
        return any(one.mode is Mode.IDLE and one.shown(time_s, time_s) for one in commands_of(self._world.gestures))

    def _see_idle(self, now: Situation) -> None:
        if self._idle_since_s is None:
            self._idle_since_s = now.time_s
        if now.time_s - self._idle_since_s < self._config.stands_after_s:
            return
        if self._stood_at is None:
            self._stood_at = now.robot
        moved_m = math.hypot(now.robot.x_m - self._stood_at.x_m, now.robot.y_m - self._stood_at.y_m)
        if moved_m > self._config.stands_m and not self._moved:
            self._moved = f"idle, it moved {moved_m:.2f} m by {now.time_s:.1f} s"
