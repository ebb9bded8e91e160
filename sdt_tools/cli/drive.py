"""``sdt drive``: the whole controller, live."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, emit
from sdt_tools.cli.endings import last_words
from sdt_tools.cli.live import Live
from sdt_tools.errors import OutputExistsError, UsageError

if TYPE_CHECKING:
    from sdt_tools.cli.drive_report import Witness
    from sdt_tools.control.scene_drive import SceneDrive, SceneDriveConfig
    from sdt_tools.protocols import Driver, Observer
    from sdt_tools.recording.live.control import Control
    from sdt_tools.recording.live.outcome import RecordingProgress
    from sdt_tools.scene.source import SceneSource

    Tell = Callable[[RecordingProgress], None]

KEYS_HELP = (
    "Keys at a terminal: o has the operator show enable, p disable, i nothing; q ends the drive. With --cockpit its "
    "own keys, shown by ?."
)
_OPTIONS = {name: f"--{name}" for name in ("scenario", "seed", "seconds")} | {"controller.debounce": "--debounce"}

app = typer.Typer(no_args_is_help=True, help="Drive with the whole controller: gestures switch it, a network follows.")


@app.callback()
def drive() -> None:
    """Drive with the whole controller: gestures switch it, a network follows."""


@app.command("scene", epilog=KEYS_HELP)
def scene(
    vision: Annotated[
        Path | None,
        typer.Option(help="Checkpoint folder of the vision network; without, the robot is active throughout."),
    ] = None,
    follow: Annotated[
        str, typer.Option(help="Who drives while active: a follow network's folder, expert or constant:CLASS.")
    ] = "expert",
    scenario: Annotated[str, typer.Option(help="Name or TOML file of a scenario.")] = "summoned_plain",
    seed: Annotated[int, typer.Option(min=0, help="Everything random comes from it.")] = 0,
    seconds: Annotated[
        float | None, typer.Option(min=0.02, help="How long to drive; without, until the scenario ends.")
    ] = None,
    fast: Annotated[bool, typer.Option("--fast", help="As fast as it can, instead of in real time.")] = False,
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
    config: Annotated[Path | None, typer.Option(help="TOML file with tables scene and controller.")] = None,
    json_output: JsonFlag = False,
) -> None:
    """Drive the simulated robot: the vision network switches it on and off, the follow network drives while it is on.

    Says what happens as it happens, then how long it takes from a scan to its command, and what became of the
    operator's gestures. The robot stands on every way out: Ctrl-C, SIGTERM, SIGHUP, an exception.
    """
    from sdt_tools.cli.drive_report import Witness, drive_document, print_drive
    from sdt_tools.cli.seat import in_cockpit
    from sdt_tools.config import parse_config, read_toml
    from sdt_tools.control.scene_drive import SceneDriveConfig

    seated = in_cockpit(follow, cockpit, gamepad, perturb=False)
    if seated and fast:
        raise UsageError("--fast leaves a person no time; leave it or --cockpit out")
    if record is not None and record.exists():
        raise OutputExistsError(record, "--record")
    values = dict(read_toml(config)) if config is not None else {}
    if debounce is not None:
        values["controller"] = {**values.get("controller", {}), "debounce": debounce}
    given = {
        "scenario": scenario,
        "seed": seed,
        "seconds": seconds,
        "vision": None if vision is None else str(vision),
        "follow": follow,
        "camera": vision is not None or record is not None or viewer or seated,
        "realtime": not fast,
    }
    settings = parse_config(SceneDriveConfig, values | given, str(config or "drive scene"), _OPTIONS)
    witness = Witness()
    driven = _drive(settings, witness, record, Live(seated, gamepad, hold_s, viewer))
    with last_words(driven.summary.ending):
        if json_output:
            emit(drive_document(driven, witness, record))
        else:
            print_drive(driven, witness, record)


def _drive(config: "SceneDriveConfig", witness: "Witness", record: Path | None, how: Live) -> "SceneDrive":
    from sdt_tools.cli.drivers import make_driver
    from sdt_tools.cli.seat import seat_beside, viewer_observers
    from sdt_tools.control.scene_drive import SceneCrew, drive_scene
    from sdt_tools.models.vision.checkpoint import load_vision_checkpoint

    follow = f"policy:{config.follow}" if Path(config.follow).is_dir() else config.follow
    network = None if config.vision is None else load_vision_checkpoint(Path(config.vision))
    streams = viewer_observers(how.viewer, config.scene.motions, config.realtime)

    def driver_of(source: "SceneSource") -> "Driver":
        return make_driver(follow, source, "--follow", "a follow network's folder, expert or constant:CLASS")

    if how.seated:
        from sdt_tools.teleop.app.app import drive as drive_in_cockpit

        with seat_beside(config.follow, "drive scene", how) as (cockpit, seat):
            crew = SceneCrew(
                driver_of,
                network,
                lambda source: [witness.watch(source), cockpit.watch, *streams()],
                witness.decisions.append,
                seat,
            )
            return drive_in_cockpit(
                cockpit,
                lambda heard: drive_scene(config, crew, record, cockpit.watch.tell, cockpit.control, heard),
            )
    with _at_the_terminal(config.scenario) as (progress, control, telling):
        crew = SceneCrew(
            driver_of,
            network,
            lambda source: [witness.watch(source), telling(source), *streams()],
            witness.decisions.append,
        )
        return drive_scene(config, crew, record, progress, control)


@contextmanager
def _at_the_terminal(scenario: str) -> "Iterator[tuple[Tell, Control, Callable[[SceneSource], Observer]]]":
    """Progress, what keys ask for, and what tells of a scene as it goes on, within the block."""
    from sdt_tools.cli.drive_report import Telling
    from sdt_tools.cli.keys import at_a_terminal, pressed_keys
    from sdt_tools.cli.recording_progress import recording_progress
    from sdt_tools.frames import Gesture
    from sdt_tools.recording.live.control import Control, Wish

    control = Control()
    operators: list[SceneSource] = []
    gestures = {"o": Gesture.ENABLE, "p": Gesture.DISABLE, "i": Gesture.IDLE}

    def pressed(key: str) -> None:
        if key == "q":
            control.want(Wish.QUIT)
        elif key in gestures and operators:
            operators[-1].show(gestures[key])

    def telling(source: "SceneSource") -> "Observer":
        operators.append(source)
        return Telling(source.start_ns)

    keys = pressed_keys(pressed) if at_a_terminal() else nullcontext()
    with keys, recording_progress(f"driving {scenario}") as progress:
        yield progress, control, telling
