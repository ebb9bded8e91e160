"""``sdt record robot``: recordings of the real robot."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from sdt_tools.cli.console import JsonFlag, emit
from sdt_tools.cli.endings import last_words
from sdt_tools.cli.live import Live
from sdt_tools.cli.record_report import print_recording, recording_document, seconds_of
from sdt_tools.errors import OutputExistsError, UsageError

if TYPE_CHECKING:
    from sdt_tools.control.driving import DriveSummary
    from sdt_tools.control.robot.drive import RobotRunConfig
    from sdt_tools.control.robot.opened import OpenRobot
    from sdt_tools.control.robot.takes import RobotTakesConfig
    from sdt_tools.protocols import Driver, Observer
    from sdt_tools.recording.live.takes import SessionSummary

NOBODY: Final = "none"
_FORMS: Final = "none, keyboard, gamepad, policy:MODEL_DIR or constant:CLASS"
_OPTIONS: Final = {"seconds": "--seconds", "keep_last_s": "--keep-last"}


def robot(
    out: Annotated[Path | None, typer.Option(help="The recording to write; it must not exist.")] = None,
    config: Annotated[
        Path | None,
        typer.Option(help="TOML file about the robot. Without, a LiDAR at 192.168.0.1 alone.", metavar="ROBOT.TOML"),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.02, help="How long to record, a take; without, until Ctrl-C.")
    ] = None,
    driver: Annotated[str, typer.Option(help=f"Who drives: {_FORMS}.", metavar="NAME")] = NOBODY,
    guard: Annotated[
        bool, typer.Option("--guard", help="Let nobody drive forward into what the LiDAR sees ahead.")
    ] = False,
    session: Annotated[
        Path | None, typer.Option(help="Instead of --out: a folder for take after take.", metavar="DIR")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the session that DIR holds.")] = False,
    keep_last: Annotated[
        str | None,
        typer.Option(
            help="With --session: no take at first, but the last seconds in memory, as in 30s or 2min, written out "
            "at a key, a change of mode, or an error.",
            metavar="TIME",
        ),
    ] = None,
    cockpit: Annotated[
        bool, typer.Option("--cockpit", help="See what is recorded, and take over from whoever drives.")
    ] = False,
    gamepad: Annotated[bool, typer.Option("--gamepad", help="In the cockpit, a gamepad drives too.")] = False,
    hold_s: Annotated[
        float, typer.Option(min=0.1, max=5.0, help="In the cockpit, how long a motion lasts after its key came once.")
    ] = 0.6,
    viewer: Annotated[bool, typer.Option("--viewer", help="Stream live to Rerun, in a window of its own.")] = False,
    json_output: JsonFlag = False,
) -> None:
    """Record the real robot: its LiDAR, and its camera and base where the file names them.

    Devices that are lost and come back are logged, with the gap. Where somebody drives, the robot stands when no scan
    or no decision comes for 0.2 s, on every signal and exception, and while its emergency stop is pulled. The recording
    ends whole on Ctrl-C, SIGTERM and SIGHUP (exit codes 143 and 129), and when its disk has no room left.
    """
    from sdt_tools.cli.record_takes import print_session, session_document
    from sdt_tools.cli.seat import in_cockpit
    from sdt_tools.config import load_config, parse_config
    from sdt_tools.control.robot.config import RobotFile
    from sdt_tools.control.robot.drive import RobotRunConfig, check_driven
    from sdt_tools.control.robot.takes import RobotTakesConfig

    if (out is None) == (session is None):
        raise UsageError("name either --out, for one recording, or --session, for takes")
    if session is None and (resume or keep_last is not None):
        raise UsageError(f"{'--resume' if resume else '--keep-last'} needs --session, the folder of the takes")
    seated = in_cockpit(driver, cockpit, gamepad, perturb=False)
    values: Mapping[str, object] = {
        "seconds": seconds,
        "driver": driver,
        "guarded": guard,
        "robot": load_config(RobotFile, config),
    }
    how = Live(seated, gamepad, hold_s, viewer)
    where = str(config or "record robot")
    if session is not None:
        kept_s = None if keep_last is None else seconds_of(keep_last)
        takes = parse_config(RobotTakesConfig, {**values, "keep_last_s": kept_s}, "record robot", _OPTIONS)
        if driver != NOBODY:
            check_driven(takes, where)
        summary = _record_takes(takes, session, resume, how)
        with last_words(summary.ending):
            emit(session_document(summary)) if json_output else print_session(summary)
        return
    assert out is not None
    if out.exists():
        raise OutputExistsError(out)
    settings = parse_config(RobotRunConfig, values, "record robot", _OPTIONS)
    if driver != NOBODY:
        check_driven(settings, where)
    recorded = _record_one(settings, out, how).recording
    assert recorded is not None
    with last_words(recorded.ending):
        emit(recording_document(out, recorded)) if json_output else print_recording(out, recorded)


def _driver(name: str) -> "Driver | None":
    """Who drives by itself: nobody, for ``none`` and by hand. Networks are ready to decide."""
    from sdt_tools.cli.drivers import make_robot_driver
    from sdt_tools.control.robot.drive import warm_up
    from sdt_tools.teleop.hand import GAMEPAD, KEYBOARD

    if name in (NOBODY, KEYBOARD, GAMEPAD):
        return None
    driver = make_robot_driver(name, "--driver", _FORMS)
    warm_up(driver)
    return driver


def _record_one(config: "RobotRunConfig", out: Path, how: Live) -> "DriveSummary":
    from sdt_tools.cli.recording_progress import recording_progress
    from sdt_tools.cli.robot_seat import robot_seat
    from sdt_tools.control.robot.drive import drive_robot
    from sdt_tools.control.robot.opened import open_robot

    driver = _driver(config.driver)
    with open_robot(config.robot, config.guarded) as opened:
        streams = _streams(opened, how)
        if not how.seated:
            with recording_progress(f"recording {out.name}") as progress:
                return drive_robot(config, opened, driver, out, streams, progress)
        from sdt_tools.teleop.app.app import drive

        with robot_seat(config.driver, out.name, how, opened.emergency) as (cockpit, seated):
            return drive(
                cockpit,
                lambda heard: drive_robot(
                    config,
                    opened,
                    seated(driver),
                    out,
                    [cockpit.watch, *streams],
                    cockpit.watch.tell,
                    cockpit.control,
                    heard,
                ),
            )


def _record_takes(config: "RobotTakesConfig", folder: Path, resume: bool, how: Live) -> "SessionSummary":
    from sdt_tools.cli.record_takes import takes_control
    from sdt_tools.cli.recording_progress import recording_progress
    from sdt_tools.cli.robot_seat import robot_seat
    from sdt_tools.control.robot.opened import open_robot
    from sdt_tools.control.robot.takes import open_session, record_robot_takes

    driver = _driver(config.driver)
    with open_robot(config.robot, config.guarded) as opened:
        streams, session = _streams(opened, how), open_session(config, folder, resume)
        if not how.seated:
            with takes_control() as control, recording_progress(f"session {folder.name}") as progress:
                return record_robot_takes(config, opened, session, driver, streams, progress, control)
        from sdt_tools.teleop.app.app import drive

        keeps_last = config.keep_last_s is not None
        with robot_seat(config.driver, folder.name, how, opened.emergency, True, keeps_last) as (cockpit, seated):
            return drive(
                cockpit,
                lambda heard: record_robot_takes(
                    config,
                    opened,
                    session,
                    seated(driver),
                    [cockpit.watch, *streams],
                    cockpit.watch.tell,
                    cockpit.control,
                    heard,
                ),
            )


def _streams(opened: "OpenRobot", how: Live) -> "Sequence[Observer]":
    from sdt_tools.cli.seat import viewer_observers

    return viewer_observers(how.viewer, opened.config.motions, realtime=True)()
