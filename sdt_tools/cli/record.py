"""``sdt record``: recordings."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit
from sdt_tools.cli.endings import last_words
from sdt_tools.cli.live import Live
from sdt_tools.errors import OutputExistsError, UsageError

if TYPE_CHECKING:
    from sdt_tools.recording.live.outcome import RecordingSummary
    from sdt_tools.recording.live.scene_session import SceneRecordingConfig

KEYS_HELP = (
    "Keys with --session at a terminal: space pauses and resumes, n ends the take and starts the next, k keeps it and "
    "stops, x discards it (or the last one) to the trash, m marks the moment, s saves what --keep-last holds, q quits."
)

_OPTIONS = {name: f"--{name}" for name in ("scenario", "seed", "seconds", "driver")} | {"keep_last_s": "--keep-last"}
"""Options that stand for a setting, by its name."""

app = typer.Typer(no_args_is_help=True, help="Record scans, images, poses and commands in step into one MCAP file.")


@app.callback()
def record() -> None:
    """Record scans, images, poses and commands in step into one MCAP file."""


@app.command("scene", epilog=KEYS_HELP)
def scene(
    out: Annotated[Path | None, typer.Option(help="The recording to write; it must not exist.")] = None,
    scenario: Annotated[
        str, typer.Option(help="Name or TOML file of a scenario, or a practice family, as 'practice'.")
    ] = "plain",
    seed: Annotated[int, typer.Option(min=0, help="Everything random comes from it.")] = 0,
    seconds: Annotated[
        float | None, typer.Option(min=0.02, help="How long to record, a take; without, until the scenario ends.")
    ] = None,
    driver: Annotated[
        str,
        typer.Option(help="Who drives: expert, constant:CLASS, policy:MODEL_DIR, keyboard or gamepad.", metavar="NAME"),
    ] = "expert",
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Keep the pace of real time, instead of running as fast as possible.")
    ] = False,
    no_camera: Annotated[bool, typer.Option("--no-camera", help="Leave images out.")] = False,
    perturb: Annotated[
        bool, typer.Option("--perturb", help="Force random motions now and then, for training data off the good path.")
    ] = False,
    config: Annotated[
        Path | None, typer.Option(help="TOML file about the scene: tables rates, motions, sensor, drive; linger_s.")
    ] = None,
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
        bool,
        typer.Option("--cockpit", help="See what is recorded, and take over from whoever drives; in real time."),
    ] = False,
    gamepad: Annotated[bool, typer.Option("--gamepad", help="In the cockpit, a gamepad drives too.")] = False,
    hold_s: Annotated[
        float, typer.Option(min=0.1, max=5.0, help="In the cockpit, how long a motion lasts after its key came once.")
    ] = 0.6,
    viewer: Annotated[bool, typer.Option("--viewer", help="Stream live to Rerun, in a window of its own.")] = False,
    json_output: JsonFlag = False,
) -> None:
    """Record the simulated robot. The same options give the same bytes, except with --realtime.

    Drivers keyboard and gamepad open the cockpit, in the terminal and in real time; ? shows its keys.

    In real time the recording ends, whole, when its disk has no room left. It ends whole on Ctrl-C too, and on SIGTERM
    and SIGHUP (exit codes 143 and 129).
    """
    from sdt_tools.cli.seat import in_cockpit
    from sdt_tools.config import load_config, parse_config
    from sdt_tools.recording.live.perturb import PerturbConfig
    from sdt_tools.recording.live.scene_session import SceneRecordingConfig
    from sdt_tools.scene.config import SceneConfig

    seated = in_cockpit(driver, cockpit, gamepad, perturb)
    values = {
        "scenario": scenario,
        "seed": seed,
        "seconds": seconds,
        "driver": driver,
        "camera": not no_camera,
        "realtime": realtime or seated,
        "perturb": PerturbConfig() if perturb else None,
        "scene": load_config(SceneConfig, config),
    }
    if (out is None) == (session is None):
        raise UsageError("name either --out, for one recording, or --session, for takes")
    how = Live(seated, gamepad, hold_s, viewer)
    if session is not None:
        _scene_session(values, session, resume, keep_last, how, json_output)
        return
    if resume or keep_last is not None:
        raise UsageError(f"{'--resume' if resume else '--keep-last'} needs --session, the folder of the takes")
    assert out is not None
    recording = parse_config(SceneRecordingConfig, values, "record scene", _OPTIONS)
    summary = _record_one(recording, out, how)
    with last_words(summary.ending):
        if json_output:
            emit(_document(out, summary))
        else:
            _print(out, summary)


def _record_one(config: "SceneRecordingConfig", out: Path, how: Live) -> "RecordingSummary":
    from sdt_tools.cli.drivers import make_driver
    from sdt_tools.cli.recording_progress import recording_progress
    from sdt_tools.cli.seat import seat, viewer_observers
    from sdt_tools.recording.live.scene_session import record_scene

    observers = viewer_observers(how.viewer, config.scene.motions, config.realtime)
    if not how.seated:
        with recording_progress(f"recording {out.name}") as progress:
            return record_scene(config, out, make_driver, observers(), progress)
    from sdt_tools.teleop.app.app import drive

    if out.exists():
        raise OutputExistsError(out)
    with seat(config.driver, out.name, how) as (cockpit, make_seated):
        return drive(
            cockpit,
            lambda interrupt: record_scene(
                config,
                out,
                make_seated,
                [cockpit.watch, *observers()],
                cockpit.watch.tell,
                cockpit.control,
                interrupt,
            ),
        )


def _scene_session(
    values: Mapping[str, object], folder: Path, resume: bool, keep_last: str | None, how: Live, json_output: bool
) -> None:
    from sdt_tools.cli.record_takes import print_session, record_takes, session_document
    from sdt_tools.config import parse_config
    from sdt_tools.recording.live.scene_takes import SceneTakesConfig

    keep_last_s = None if keep_last is None else seconds_of(keep_last)
    config = parse_config(SceneTakesConfig, {**values, "keep_last_s": keep_last_s}, "record scene", _OPTIONS)
    summary = record_takes(config, folder, resume, how)
    with last_words(summary.ending):
        if json_output:
            emit(session_document(summary))
        else:
            print_session(summary)


def seconds_of(text: str) -> float:
    """The seconds in ``30s``, ``2min`` or ``30``. Raises UsageError for anything else."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(s|min)?", text.strip())
    seconds = float(found[1]) * (60 if found[2] == "min" else 1) if found else 0.0
    if seconds <= 0:
        raise UsageError(f"--keep-last {text}: no length of time; write it as 30s or 2min")
    return seconds


def _document(out: Path, summary: "RecordingSummary") -> dict[str, object]:
    return {
        "out": str(out),
        "recording_id": summary.recording_id,
        "seconds": summary.seconds,
        "wall_s": round(summary.wall_s, 3),
        "real_time_factor": round(summary.real_time_factor, 2),
        "ending": summary.ending,
        "interrupted": summary.interrupted,
        "frames": dict(summary.frames),
        "dropped": dict(summary.dropped),
        "missing": dict(summary.missing),
        "missed_deadlines": summary.missed_deadlines,
        "decisions": summary.decisions,
        "forced_decisions": summary.forced,
        "size_bytes": summary.size_bytes,
    }


def _print(out: Path, summary: "RecordingSummary") -> None:
    from rich.table import Table

    table = Table("topic", "messages", "per second", "dropped", "missing")
    for topic, count in summary.frames.items():
        rate = f"{count / summary.seconds:.1f}" if summary.seconds > 0 else ""
        lost = (str(summary.dropped.get(topic, "")), str(summary.missing.get(topic, "")))
        table.add_row(topic, str(count), rate, *lost)
    console.print(table)
    ending = {
        "time": "",
        "source": "; the scenario ended",
        "interrupted": "; you stopped it, the file is whole",
        "terminated": "; SIGTERM stopped it, the file is whole",
        "hangup": "; its terminal hung up, the file is whole",
        "disk": "; its disk is nearly full: it was ended while there was room for a whole file",
    }.get(summary.ending, "")
    late = f", {summary.missed_deadlines} deadlines missed" if summary.missed_deadlines else ""
    console.print(
        f"{out}: {summary.seconds:.1f} s in {summary.wall_s:.1f} s ({summary.real_time_factor:.0f} times real time), "
        f"{summary.size_bytes / 1e6:.1f} MB{late}{ending}"
    )
