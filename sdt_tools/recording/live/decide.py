"""Decisions on the newest data, at their own rate."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import MotionConfig, RateConfig
from sdt_tools.frames import (
    CameraImage,
    LidarScan,
    LogEntry,
    LogLevel,
    Message,
    Mode,
    MotionClass,
    MotionCommand,
    Twist,
)
from sdt_tools.protocols import Choice, Chooser, Driver, Expert, Observation
from sdt_tools.recording.live.perturb import PERTURBATION

STOP: Final = "stop"
"""The driver's name in commands that only stop the robot: nobody's idea of what is right there."""
MODE_LOG: Final = "mode"
"""The name of session log entries about changes of mode."""
BLIND_S: Final = 0.2
"""A robot that has seen nothing for so long stands, or for two and a half scans where they come more slowly."""

Perturb = Callable[[MotionClass], MotionClass]
"""What to drive instead of a driver's choice."""


@dataclass(frozen=True)
class Deciders:
    """Who chooses the motion, who knows the right one, and what disturbs the choice."""

    driver: Driver | Chooser
    expert: Expert | None = None
    perturb: Perturb | None = None


class DecisionLoop:
    """Asks the driver ``follow_hz`` times a second, if there is a scan that it has not seen.

    A decision that could not be made within its period is left out and counts as ``missed``, from the first one on.
    """

    def __init__(self, deciders: Deciders, motions: MotionConfig, rates: RateConfig, start_ns: int) -> None:
        self.decisions = 0
        self.forced = 0
        self.missed = 0
        self._deciders = deciders
        self._motions = motions
        self._period_ns = SECOND_NS / rates.follow_hz
        self._blind_ns = round(max(BLIND_S, 2.5 / rates.scan_hz) * SECOND_NS)
        self._start_ns = start_ns
        self._next: int | None = None
        self._scan: LidarScan | None = None
        self._image: CameraImage | None = None
        self._decided_on: LidarScan | None = None
        self._seen_ns = start_ns
        self._moving = False
        self._mode: Mode | None = None
        self._says = ""
        self._news: list[LogEntry] = []

    def see(self, message: Message, now_ns: int) -> None:
        """Keep the newest scan and image, received by ``now_ns``."""
        if isinstance(message, LidarScan):
            self._scan = message
            self._seen_ns = now_ns
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
        command = self._command(self._scan, Observation(now_ns, self._scan, self._image))
        self._moving = command.motion is not MotionClass.STAY
        return command

    def blind(self, now_ns: int) -> bool:
        """Whether the robot drives although no scan has come for ``BLIND_S``."""
        return self._moving and now_ns - self._seen_ns > self._blind_ns

    def stop(self, now_ns: int) -> MotionCommand | None:
        """The command that stops the robot, stamped ``now_ns``; None where it stands already."""
        if not self._moving:
            return None
        self._moving = False
        mode = Mode.ACTIVE if self._mode is None else self._mode
        return MotionCommand(now_ns, MotionClass.STAY, self._motions.twist(MotionClass.STAY), STOP, mode)

    def news(self) -> list[LogEntry]:
        """What the decisions since the last call have for the session log: a change of mode, what the driver says."""
        news, self._news = self._news, []
        return news

    def _command(self, scan: LidarScan, observation: Observation) -> MotionCommand:
        deciders = self._deciders
        expert = None if deciders.expert is None else deciders.expert.advise()
        driver = deciders.driver
        choice = (
            driver.choose(observation)
            if isinstance(driver, Chooser)
            else Choice(driver.decide(observation), driver.name)
        )
        motion = choice.motion if deciders.perturb is None else deciders.perturb(choice.motion)
        forced = motion is not choice.motion
        self.decisions += 1
        self.forced += forced
        self._note(choice, observation.now_ns)
        return MotionCommand(
            stamp_ns=scan.stamp_ns,
            motion=motion,
            twist=_at_speed(self._motions.twist(motion), choice.speed),
            driver=PERTURBATION if forced else choice.driver,
            mode=choice.mode,
            intervention=choice.intervention,
            expert=expert,
        )

    def _note(self, choice: Choice, now_ns: int) -> None:
        if self._mode is not None and choice.mode is not self._mode:
            self._news.append(LogEntry(now_ns, LogLevel.INFO, f"mode: {choice.mode.label}", MODE_LOG))
        if choice.says not in ("", self._says):
            self._news.append(LogEntry(now_ns, LogLevel.WARNING, choice.says, choice.driver))
        self._mode, self._says = choice.mode, choice.says


def _at_speed(twist: Twist, speed: float) -> Twist:
    return twist if speed == 1.0 else Twist(twist.linear_mps * speed, twist.angular_radps * speed)
