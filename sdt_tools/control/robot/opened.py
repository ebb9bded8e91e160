"""The robot with its devices open, and between them and whoever drives: watchdog, guard, limits."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from sdt_tools.clock import HostClock
from sdt_tools.control.guard import ObstacleGuard
from sdt_tools.control.latency import WireTimes
from sdt_tools.control.robot.config import RobotFile
from sdt_tools.control.watchdog import Watchdog
from sdt_tools.emergency import EmergencyStop
from sdt_tools.frames import Twist
from sdt_tools.protocols import Actuator, Observer
from sdt_tools.robot.source import RobotSource


class NoBase:
    """Nothing that moves. Implements Actuator."""

    def command(self, twist: Twist) -> None:
        """Nobody hears it."""


@dataclass(frozen=True)
class OpenRobot:
    """A robot to drive by ``actuator``, and what has to see what passes; ``wire`` knows when commands were sent."""

    config: RobotFile
    source: RobotSource
    clock: HostClock
    actuator: Actuator
    emergency: EmergencyStop
    observers: tuple[Observer, ...] = ()
    wire: WireTimes | None = None

    @property
    def has_base(self) -> bool:
        """Whether anything moves."""
        return self.source.base is not None


@contextmanager
def open_robot(config: RobotFile, guarded: bool = False) -> Iterator[OpenRobot]:
    """The robot for as long as the block lasts; on every way out of it the robot stands.

    Commands pass the watchdog, then the guard, which is on if ``guarded``, then the base, which keeps to its limits.
    What the first two have to say is among the source's messages. Raises DeviceError where a device cannot be had.
    """
    clock, emergency, wire = HostClock(), EmergencyStop(), WireTimes()
    source = RobotSource(config, clock, emergency, wire.note)
    try:
        if source.base is None:
            yield OpenRobot(config, source, clock, NoBase(), emergency)
            return
        guard = ObstacleGuard(source.base, config.guard, is_on=guarded)
        source.hear(guard.entries)
        with Watchdog(guard, config.watchdog, emergency, clock) as watchdog:
            source.hear(watchdog.entries)
            yield OpenRobot(config, source, clock, watchdog, emergency, (guard, watchdog), wire)
    finally:
        source.close()
