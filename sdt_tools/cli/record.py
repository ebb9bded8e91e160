"""``sdt record``: recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.recording.live.outcome import RecordingSummary

app = typer.Typer(no_args_is_help=True, help="Record scans, images, poses and commands in step into one MCAP file.")


@app.callback()
def record() -> None:
    """Record scans, images, poses and commands in step into one MCAP file."""


@app.command("scene")
def scene(
    out: Annotated[Path, typer.Option(help="The recording to write; it must not exist.")],
    scenario: Annotated[str, typer.Option(help="Name or TOML file of a scenario, or 'practice'.")] = "plain",
    seed: Annotated[int, typer.Option(min=0, help="Everything random comes from it.")] = 0,
    seconds: Annotated[
        float | None, typer.Option(min=0.02, help="How long to record; without, until the scenario ends.")
    ] = None,
    driver: Annotated[
        str, typer.Option(help="Who drives: expert, constant:CLASS or policy:MODEL_DIR.", metavar="NAME")
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
    json_output: JsonFlag = False,
) -> None:
    """Record the simulated robot. The same options give the same bytes, except with --realtime."""
    from sdt_tools.cli.drivers import make_driver
    from sdt_tools.cli.recording_progress import recording_progress
    from sdt_tools.config import load_config, parse_config
    from sdt_tools.recording.live.perturb import PerturbConfig
    from sdt_tools.recording.live.scene_session import SceneRecordingConfig, record_scene
    from sdt_tools.scene.config import SceneConfig

    values = {
        "scenario": scenario,
        "seed": seed,
        "seconds": seconds,
        "driver": driver,
        "camera": not no_camera,
        "realtime": realtime,
        "perturb": PerturbConfig() if perturb else None,
        "scene": load_config(SceneConfig, config),
    }
    recording = parse_config(SceneRecordingConfig, values, "record scene")
    with recording_progress(f"recording {out.name}") as progress:
        summary = record_scene(recording, out, make_driver, progress=progress)
    if json_output:
        emit(_document(out, summary))
    else:
        _print(out, summary)


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
        "missed_deadlines": summary.missed_deadlines,
        "decisions": summary.decisions,
        "forced_decisions": summary.forced,
        "size_bytes": summary.size_bytes,
    }


def _print(out: Path, summary: "RecordingSummary") -> None:
    from rich.table import Table

    table = Table("topic", "messages", "per second", "dropped")
    for topic, count in summary.frames.items():
        rate = f"{count / summary.seconds:.1f}" if summary.seconds > 0 else ""
        table.add_row(topic, str(count), rate, str(summary.dropped.get(topic, "")))
    console.print(table)
    ending = {
        "time": "",
        "source": "; the scenario ended",
        "interrupted": "; you stopped it, the file is whole",
    }.get(summary.ending, "")
    late = f", {summary.missed_deadlines} deadlines missed" if summary.missed_deadlines else ""
    console.print(
        f"{out}: {summary.seconds:.1f} s in {summary.wall_s:.1f} s ({summary.real_time_factor:.0f} times real time), "
        f"{summary.size_bytes / 1e6:.1f} MB{late}{ending}"
    )
