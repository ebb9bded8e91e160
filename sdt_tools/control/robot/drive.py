"""The robot driven, and recorded if that is wanted: by the whole controller, by a driver, by hand, or by nobody."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import Field

from sdt_tools.config import Config, dump_config
from sdt_tools.control.controller import Controller, VisionDecision
from sdt_tools.control.driving import DriveSummary, Wheel, drive
from sdt_tools.control.eyes import BackgroundEyes, GestureNetwork
from sdt_tools.control.robot.config import RobotFile, shown
from sdt_tools.control.robot.opened import OpenRobot
from sdt_tools.errors import ConfigError
from sdt_tools.frames import RAYS, LidarScan
from sdt_tools.protocols import Chooser, Driver, Observation, Observer
from sdt_tools.recording.live.control import Control
from sdt_tools.recording.live.encoder import encode_jpeg
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.recording.live.outcome import RecordingProgress
from sdt_tools.recording.session import random_id
from sdt_tools.recording.writer import RecordingWriter


class RobotRunConfig(Config):
    """All that decides how a robot is driven; attached to a recording of it.

    ``driver`` names who drives, ``vision`` the network that switches the robot, if one does; ``guarded`` says whether
    the guard is on.
    """

    seconds: float | None = Field(default=None, gt=0)
    driver: str
    vision: str | None = None
    guarded: bool = False
    robot: RobotFile


@dataclass(frozen=True)
class RobotRun:
    """How it went; ``unreadable`` pictures could not be decoded."""

    summary: DriveSummary
    unreadable: int = 0


def warm_up(driver: Driver | Chooser | None, network: GestureNetwork | None = None) -> None:
    """Have networks decide once, so that the first decision that counts is as quick as any."""
    if network is not None:
        network.decide(encode_jpeg(np.zeros((480, 640, 3), np.uint8)))
    observation = Observation(0, LidarScan(0, np.full(RAYS, 5.0)), None)
    if isinstance(driver, Chooser):
        driver.choose(observation)
    elif driver is not None:
        driver.decide(observation)


def drive_robot(
    config: RobotRunConfig,
    robot: OpenRobot,
    driver: Driver | Chooser | None,
    out: Path | None = None,
    observers: Sequence[Observer] = (),
    progress: Callable[[RecordingProgress], None] | None = None,
    control: Control | None = None,
    interrupt: Interrupt | None = None,
) -> DriveSummary:
    """Drive ``robot``, recorded to ``out`` where that is given; without a driver it stands.

    Signals end it in order unless ``interrupt`` hears them already. On every way out the robot stands and its devices
    are closed. Raises OutputExistsError, RecordingError where the disk refuses, RunError where the robot fails.
    """
    with ExitStack() as open_things:
        robot.source.begin()
        writer = None if out is None else open_things.enter_context(open_writer(config, robot, out))
        wheel = Wheel(
            robot.source,
            robot.actuator,
            driver,
            config.robot.rates,
            config.robot.motions,
            arrival=robot.source.lidar.wait,
            wire=robot.wire,
        )
        watching = (*robot.observers, *observers)
        summary = drive(wheel, watching, config.seconds, robot.clock, writer, progress, control, interrupt)
    if writer is not None and summary.recording is not None:
        summary = replace(summary, recording=replace(summary.recording, size_bytes=writer.size))
    return summary


def control_robot(
    config: RobotRunConfig,
    robot: OpenRobot,
    follow: Driver,
    network: GestureNetwork | None,
    out: Path | None = None,
    observers: Sequence[Observer] = (),
    told: Callable[[VisionDecision], None] | None = None,
    seat: Callable[[Controller], Chooser] | None = None,
    progress: Callable[[RecordingProgress], None] | None = None,
    control: Control | None = None,
    interrupt: Interrupt | None = None,
) -> RobotRun:
    """Drive ``robot`` by the whole controller: ``network`` switches it, ``follow`` drives while it is active.

    ``seat`` puts a person beside the controller, ``told`` hears of vision decisions. Raises as ``drive_robot``,
    ConfigError for rates that do not fit.
    """
    eyes = None if network is None else BackgroundEyes(network)
    try:
        controller = Controller(follow, eyes, config.robot.rates, config.robot.controller, told)
        chooser = controller if seat is None else seat(controller)
        summary = drive_robot(config, robot, chooser, out, observers, progress, control, interrupt)
    finally:
        if eyes is not None:
            eyes.close()
    return RobotRun(summary, controller.unreadable)


def check_driven(config: RobotRunConfig, where: str) -> None:
    """Raise ConfigError where the robot lacks what is wanted of it."""
    if config.robot.base is None:
        raise ConfigError(f"{where}: the robot has no table 'base', so that nothing can be driven; add [base]")
    if config.vision is not None and config.robot.camera is None:
        raise ConfigError(f"{where}: --vision needs a camera; add [camera] to the robot's file")


def open_writer(config: RobotRunConfig, robot: OpenRobot, out: Path, start_ns: int | None = None) -> RecordingWriter:
    """A recording of ``robot``. Raises OutputExistsError."""
    return RecordingWriter(
        out,
        robot.source.info,
        run_toml(config),
        recording_id=random_id(),
        start_ns=robot.source.start_ns if start_ns is None else start_ns,
        realtime=True,
    )


def run_toml(config: RobotRunConfig) -> str:
    """The resolved configuration as it is kept beside what comes of it."""
    return dump_config(config.model_copy(update={"robot": shown(config.robot)}))
