"""What a robot's file says: its devices, and what keeps it safe."""

from typing import Final

from pydantic import model_validator

from sdt_tools.control.controller import ControllerConfig
from sdt_tools.control.guard import GuardConfig
from sdt_tools.control.watchdog import WatchdogConfig
from sdt_tools.robot.config import RobotConfig
from sdt_tools.robot.lms1xx.config import PASSWORDS

_PERIODS: Final = 1.5
"""The watchdog waits for a decision at least so many times as long as one takes to come."""


class RobotFile(RobotConfig):
    """``robot.toml``: the robot, its watchdog, its guard, and its controller."""

    watchdog: WatchdogConfig = WatchdogConfig()
    guard: GuardConfig = GuardConfig()
    controller: ControllerConfig = ControllerConfig()

    @model_validator(mode="after")
    def _watchdog_lets_it_drive(self) -> "RobotFile":
        for name, hz, limit_s in (
            ("lidar.scan_hz", self.lidar.scan_hz, self.watchdog.scan_s),
            ("decisions.follow_hz", self.decisions.follow_hz, self.watchdog.decision_s),
        ):
            if limit_s < _PERIODS / hz:
                raise ValueError(
                    f"{name} = {hz:g} is too slow for a watchdog of {limit_s:g} s: it would stop the robot again and "
                    f"again; a period must be at most {limit_s / _PERIODS:.3g} s"
                )
        return self


def shown(config: RobotFile) -> RobotFile:
    """``config`` as it may be kept beside a recording: without a password of one's own."""
    if config.lidar.password in PASSWORDS:
        return config
    lidar = config.lidar.model_copy(update={"password": "another one"})
    return config.model_copy(update={"lidar": lidar})
