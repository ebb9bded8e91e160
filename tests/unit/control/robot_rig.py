"""A whole emulated robot without a camera, in an empty-ish scenario, and what a test wants to know of it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sdt_tools.config import parse_config
from sdt_tools.control.robot.config import RobotFile
from sdt_tools.control.robot.drive import RobotRunConfig
from sdt_tools.emulation.robot.robot import EmulatedRobot, Places
from sdt_tools.emulation.robot.world import EmulatedWorld
from sdt_tools.frames import LidarScan, LogEntry, MotionClass, Received, Twist
from sdt_tools.protocols import Observation
from sdt_tools.scene.scenario import layout_for

REST = Twist(0.0, 0.0)


@contextmanager
def emulated(scenario: str = "plain", seed: int = 1000) -> Iterator[EmulatedRobot]:
    world = EmulatedWorld(layout_for(scenario, seed), camera=False)
    with EmulatedRobot(world, Places(lidar_port=0, base_port=0, camera_port=None)) as robot:
        yield robot


def robot_file(robot: EmulatedRobot, **tables: object) -> RobotFile:
    """How ``robot`` is driven; it brakes hard, so that tests see soon that it does."""
    values = robot.config.model_dump(exclude_none=True)
    values["base"] |= {"accelerate_mps2": 5.0, "brake_mps2": 5.0}
    return parse_config(RobotFile, values | tables, "test")


def run(file: RobotFile, seconds: float | None, guarded: bool = False) -> RobotRunConfig:
    return RobotRunConfig(seconds=seconds, driver="test", guarded=guarded, robot=file)


def stands_within_s(robot: EmulatedRobot, patience_s: float = 5.0) -> float:
    """How long until the base stands."""
    began_s = time.monotonic()
    while robot.base.report.velocity != REST and time.monotonic() - began_s < patience_s:
        time.sleep(0.002)
    return time.monotonic() - began_s


class Does:
    """A driver who goes ahead, and does ``then`` once it has driven for a while."""

    name = "test"

    def __init__(self, then: Callable[[], None] = lambda: None, after: int = 5) -> None:
        self._then = then
        self._left = after
        self.decided = 0

    def decide(self, observation: Observation) -> MotionClass:
        self.decided += 1
        if self.decided == self._left:
            self._then()
        return MotionClass.FORWARD


class Notes:
    """Keeps what passes."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.scans = 0

    def observe(self, received: Received) -> None:
        self.scans += isinstance(received.message, LidarScan)
        if isinstance(received.message, LogEntry):
            self.texts.append(received.message.text)

    def close(self) -> None:
        pass


def write_file(file: RobotFile, path: Path) -> Path:
    from sdt_tools.config import dump_config

    path.write_text(dump_config(file))
    return path
