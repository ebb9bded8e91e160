"""``sdt drive robot``: the whole controller on the real robot."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from sdt_tools.cli.console import JsonFlag, emit
from sdt_tools.cli.endings import last_words
from sdt_tools.cli.live import Live
from sdt_tools.errors import OutputExistsError

if TYPE_CHECKING:
    from collections.abc import Callable

    from sdt_tools.control.controller import VisionDecision
    from sdt_tools.control.robot.drive import RobotRun, RobotRunConfig
    from sdt_tools.recording.live.control import Control
    from sdt_tools.recording.live.outcome import RecordingProgress

KEYS_HELP: Final = "Keys at a terminal: q ends the drive. With --cockpit its own keys, shown by ?."
_FORMS: Final = "a follow network's folder, or constant:CLASS"


def robot(
    follow: Annotated[str, typer.Option(help=f"Who drives while active: {_FORMS}.")],
    vision: Annotated[
        Path | None,
        typer.Option(help="Checkpoint folder of the vision network; without, the robot is active throughout."),
    ] = None,
    config: Annotated[
        Path, typer.Option(help="TOML file about the robot: its devices, watchdog, guard.", metavar="ROBOT.TOML")
    ] = Path("robot.toml"),
    guard: Annotated[
        bool, typer.Option("--guard", help="Let nobody drive forward into what the LiDAR sees ahead.")
    ] = False,
    seconds: Annotated[float | None, typer.Option(min=0.02, help="How long to drive; without, until Ctrl-C.")] = None,
    record: Annotated[Path | None, typer.Option(help="Record the drive to this file; it must not exist.")] = None,
    cockpit: Annotated[
        bool, typer.Option("--cockpit", help="See what the robot sees, and take over from the controller.")
    ] = False,
    gamepad: Annotated[bool, typer.Option("--gamepad", help="In the cockpit, a gamepad drives too.")] = False,
    hold_s: Annotated[
        float, typer.Option(min=0.1, max=5.0, help="In the cockpit, how long a motion lasts after its key came once.")
    ] = 0.6,
    viewer: Annotated[bool, typer.Option("--viewer", help="Stream live to Rerun, in a window of its own.")] = False,
    debounce: Annotated[
        int | None, typer.Option(min=1, help="Readings in a row that switch the mode. [1, at once, as in the paper]")
    ] = None,
    json_output: JsonFlag = False,
) -> None:
    """Drive the real robot: the vision network switches it on and off, the follow network drives while it is on.

    The robot stands when no scan or no decision comes for 0.2 s, on Ctrl-C, SIGTERM, SIGHUP and every exception, and
    while its emergency stop is pulled; if this program is killed, the base's own watchdog stops it. Says what happens
    as it happens, then how long it took from a scan's arrival to its command on the wire.
    """
    from sdt_tools.cli.drive_robot_report import print_robot_drive, robot_drive_document
    from sdt_tools.cli.seat import in_cockpit
    from sdt_tools.config import parse_config, read_toml
    from sdt_tools.control.robot.config import RobotFile
    from sdt_tools.control.robot.drive import RobotRunConfig, check_driven

    seated = in_cockpit(follow, cockpit, gamepad, perturb=False)
    if record is not None and record.exists():
        raise OutputExistsError(record, "--record")
    values = read_toml(config)
    if debounce is not None:
        values["controller"] = {**values.get("controller", {}), "debounce": debounce}
    given = {
        "seconds": seconds,
        "driver": follow,
        "vision": None if vision is None else str(vision),
        "guarded": guard,
        "robot": parse_config(RobotFile, values, str(config), {"controller.debounce": "--debounce"}),
    }
    settings = parse_config(RobotRunConfig, given, "drive robot", {"seconds": "--seconds"})
    check_driven(settings, str(config))
    decisions: list[VisionDecision] = []
    driven = _drive(settings, decisions.append, record, Live(seated, gamepad, hold_s, viewer))
    with last_words(driven.summary.ending):
        if json_output:
            emit(robot_drive_document(driven, decisions, record))
        else:
            print_robot_drive(driven, decisions, record)


def _drive(
    config: "RobotRunConfig", told: "Callable[[VisionDecision], None]", record: Path | None, how: Live
) -> "RobotRun":
    from sdt_tools.cli.drive_report import Telling
    from sdt_tools.cli.drivers import make_robot_driver
    from sdt_tools.cli.robot_seat import robot_seat
    from sdt_tools.cli.seat import viewer_observers
    from sdt_tools.control.robot.drive import control_robot, warm_up
    from sdt_tools.control.robot.opened import open_robot

    name = f"policy:{config.driver}" if Path(config.driver).is_dir() else config.driver
    follow = make_robot_driver(name, "--follow", _FORMS)
    network = None
    if config.vision is not None:
        from sdt_tools.models.vision.checkpoint import load_vision_checkpoint  # takes a second to import

        network = load_vision_checkpoint(Path(config.vision))
    warm_up(follow, network)
    with open_robot(config.robot, config.guarded) as opened:
        streams = viewer_observers(how.viewer, config.robot.motions, realtime=True)()
        if how.seated:
            from sdt_tools.teleop.app.app import drive as drive_in_cockpit

            with robot_seat(config.driver, "drive robot", how, opened.emergency) as (cockpit, seated):
                return drive_in_cockpit(
                    cockpit,
                    lambda heard: control_robot(
                        config,
                        opened,
                        follow,
                        network,
                        record,
                        [cockpit.watch, *streams],
                        told,
                        seated,
                        cockpit.watch.tell,
                        cockpit.control,
                        heard,
                    ),
                )
        with _at_the_terminal() as (progress, control):
            watching = [Telling(opened.source.start_ns), *streams]
            return control_robot(
                config, opened, follow, network, record, watching, told, progress=progress, control=control
            )


@contextmanager
def _at_the_terminal() -> "Iterator[tuple[Callable[[RecordingProgress], None], Control]]":
    """Progress, and what keys ask for, within the block."""
    from sdt_tools.cli.keys import at_a_terminal, pressed_keys
    from sdt_tools.cli.recording_progress import recording_progress
    from sdt_tools.recording.live.control import Control, Wish

    control = Control()

    def pressed(key: str) -> None:
        if key == "q":
            control.want(Wish.QUIT)

    keys = pressed_keys(pressed) if at_a_terminal() else nullcontext()
    with keys, recording_progress("driving") as progress:
        yield progress, control
