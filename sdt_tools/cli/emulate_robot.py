"""``sdt robot emulate robot``: the whole robot, from one scene."""

import sys
from collections.abc import Callable
from contextlib import nullcontext
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit
from sdt_tools.emulation.camera.faults import FAULTS as CAMERA_FAULTS
from sdt_tools.emulation.faults import FORM_IN_HELP
from sdt_tools.emulation.lms1xx.fault_kinds import FAULTS as LIDAR_FAULTS
from sdt_tools.emulation.p3at.faults import FAULTS as BASE_FAULTS
from sdt_tools.errors import OutputExistsError

if TYPE_CHECKING:
    from sdt_tools.emulation.robot.robot import EmulatedRobot
    from sdt_tools.evaluation.robot_truth import RobotTruth

_FAULT_HELP = (
    f"What goes wrong, as DEVICE:{FORM_IN_HELP} in seconds from the start, as base:power@20-25; repeat for more. "
    f"lidar: {LIDAR_FAULTS} base: {BASE_FAULTS} camera: {CAMERA_FAULTS}"
)
KEYS_HELP = "Keys at a terminal: o has the operator show enable, p disable, i nothing."


class Protocol(Enum):
    """CoLa-A or CoLa-B."""

    A = "a"
    B = "b"


def whole_robot(
    scene: Annotated[str, typer.Option(help="Name or TOML file of a scenario.")] = "plain",
    seed: Annotated[int, typer.Option(min=0, help="Everything random comes from it: scene and faults.")] = 0,
    host: Annotated[str, typer.Option(help="Address to listen at; 0.0.0.0 lets other computers in.")] = "127.0.0.1",
    lidar_port: Annotated[int, typer.Option(min=0, max=65535, help="The LiDAR's port; 0 finds a free one.")] = 2111,
    base_port: Annotated[int, typer.Option(min=0, max=65535, help="The base's port; 0 finds a free one.")] = 8101,
    camera_port: Annotated[int, typer.Option(min=0, max=65535, help="The camera's port; 0 finds a free one.")] = 8080,
    no_camera: Annotated[bool, typer.Option("--no-camera", help="A robot without a camera.")] = False,
    protocol: Annotated[Protocol, typer.Option(help="The LiDAR's: CoLa-A, which is text, or CoLa-B.")] = Protocol.A,
    watchdog_ms: Annotated[int, typer.Option(min=0, help="The base's own watchdog; 0 switches it off.")] = 2000,
    fault: Annotated[list[str] | None, typer.Option(metavar="FAULT", help=_FAULT_HELP)] = None,
    write_config: Annotated[
        Path | None, typer.Option(help="Write the robot.toml with which it can be driven; it must not exist.")
    ] = None,
    seconds: Annotated[float | None, typer.Option(min=0.0, help="End after so long; else with Ctrl-C.")] = None,
    json_output: JsonFlag = False,
) -> None:
    """Be a whole robot: LiDAR, base and camera at addresses of their own, in one simulated world in real time.

    What the base is told to drive moves the robot in the world, the LiDAR and the camera see it, and the operator walks
    and gestures as the scenario has it, from when somebody first has scans sent to him. At the end it says how that
    went, by the truth: whether the robot has followed the operator.
    """
    from sdt_tools.config import dump_config
    from sdt_tools.emulation.robot.robot import EmulatedRobot, Places, parse_device_faults
    from sdt_tools.emulation.robot.world import EmulatedWorld
    from sdt_tools.evaluation.robot_truth import RobotTruth
    from sdt_tools.recording.live.interrupt import deferred_interrupt
    from sdt_tools.scene.scenario import layout_for

    faults = parse_device_faults(fault or [])
    if write_config is not None and write_config.exists():
        raise OutputExistsError(write_config, "--write-config")
    layout = layout_for(scene, seed)
    places = Places(host, lidar_port, base_port, None if no_camera else camera_port, protocol.value, watchdog_ms)
    world = EmulatedWorld(layout, camera=not no_camera)
    truth = RobotTruth(world.world, layout.timeout_s)
    with deferred_interrupt() as interrupt, EmulatedRobot(world, places, faults, seed=seed) as robot:
        if write_config is not None:
            write_config.write_text(dump_config(robot.config), encoding="utf-8")
        _introduce(robot, write_config)
        with _keys(robot):
            _play(robot, truth, seconds, lambda: interrupt.requested)
        report = robot.base.report
    if json_output:
        emit({"base": report.document(), "scans": robot.lidar.counts.sent, **truth.document()})
    else:
        console.print(
            f"{robot.lidar.counts.sent} scans sent, {report.packets_received} packets received, stopped by its "
            f"watchdog {report.watchdog_stops} times; {truth.text}",
            soft_wrap=True,
        )


def _introduce(robot: "EmulatedRobot", written: Path | None) -> None:
    config = robot.config
    console.print(f"LiDAR at {config.lidar.host}:{config.lidar.port}", soft_wrap=True)
    if config.base is not None:
        console.print(f"base at {config.base.address}", soft_wrap=True)
    if config.camera is not None:
        console.print(f"camera at {config.camera.source}", soft_wrap=True)
    if written is not None:
        console.print(f"drive it with: sdt drive robot --config {written}", soft_wrap=True)
    console.print("the operator starts when somebody asks for scans; Ctrl-C ends it", soft_wrap=True)


def _play(robot: "EmulatedRobot", truth: "RobotTruth", seconds: float | None, ended: Callable[[], bool]) -> None:
    from time import monotonic

    until_s = float("inf") if seconds is None else monotonic() + seconds
    if robot.wait_for_client(ended, seconds):
        console.print("the operator starts")
        robot.begin([truth])
    robot.base.wait(None, lambda: ended() or monotonic() >= until_s)


def _keys(robot: "EmulatedRobot") -> "nullcontext[None]":
    from sdt_tools.cli.keys import at_a_terminal, pressed_keys
    from sdt_tools.frames import Gesture

    gestures = {"o": Gesture.ENABLE, "p": Gesture.DISABLE, "i": Gesture.IDLE}

    def pressed(key: str) -> None:
        if key in gestures:
            robot.world.show(gestures[key])

    return pressed_keys(pressed, sys.stdin.fileno()) if at_a_terminal() else nullcontext()  # type: ignore[return-value]
