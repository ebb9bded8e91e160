"""Decisions on the newest data, at their own rate."""

from collections.abc import Callable
from dataclasses import dataclass

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import MotionConfig
from sdt_tools.frames import CameraImage, LidarScan, Message, MotionClass, MotionCommand
from sdt_tools.protocols import Driver, Expert, Observation
from sdt_tools.recording.live.perturb import PERTURBATION

Perturb = Callable[[MotionClass], MotionClass]
"""What to drive instead of a driver's choice."""


@dataclass(frozen=True)
class Deciders:
    """Who chooses the motion, who knows the right one, and what disturbs the choice."""

    driver: Driver
    expert: Expert | None = None
    perturb: Perturb | None = None


class DecisionLoop:
    """Asks the driver ``follow_hz`` times a second, if there is a scan that it has not seen.

    A decision that could not be made within its period is left out and counts as ``missed``, from the first one on.
    """

    def __init__(self, deciders: Deciders, motions: MotionConfig, follow_hz: float, start_ns: int) -> None:
        self.decisions = 0
        self.forced = 0
        self.missed = 0
        self._deciders = deciders
        self._motions = motions
        self._period_ns = SECOND_NS / follow_hz
        self._start_ns = start_ns
        self._next: int | None = None
        self._scan: LidarScan | None = None
        self._image: CameraImage | None = None
        self._decided_on: LidarScan | None = None

    def see(self, message: Message) -> None:
        """Keep the newest scan and image."""
        if isinstance(message, LidarScan):
            self._scan = message
        elif isinstance(message, CameraImage):
            self._image = message

    def decide(self, now_ns: int) -> MotionCommand | None:
        """The command for this moment, or None where no decision is due or nothing new is there to decide on."""
        due = int((now_ns - self._start_ns) // self._period_ns)
        expected = due if self._next is None else self._next
        if due < expected or self._scan is None or self._scan is self._decided_on:
            return None
        self.missed += due - expected
        self._next = due + 1
        self._decided_on = self._scan
        return self._command(self._scan, Observation(now_ns, self._scan, self._image))

    def _command(self, scan: LidarScan, observation: Observation) -> MotionCommand:
        deciders = self._deciders
        expert = None if deciders.expert is None else deciders.expert.advise()
        chosen = deciders.driver.decide(observation)
        motion = chosen if deciders.perturb is None else deciders.perturb(chosen)
        forced = motion is not chosen
        self.decisions += 1
        self.forced += forced
        return MotionCommand(
            stamp_ns=scan.stamp_ns,
            motion=motion,
            twist=self._motions.twist(motion),
            driver=PERTURBATION if forced else deciders.driver.name,
            expert=expert,
        )
