"""``sdt demo``: the whole pipeline on the scene."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit


def command(
    out: Annotated[Path, typer.Option(help="Folder of all that is made; a rerun resumes what it has.")] = Path(
        "analysis/demo"
    ),
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of practice worlds and training.")] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file with the demo's sizes and settings.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one thread each.")] = 2,
    json_output: JsonFlag = False,
) -> None:
    """Record in the scene, label, train, drive, replay, tag every wrong frame, and show it: a few minutes in all."""
    from dataclasses import asdict

    from sdt_tools.cli.progress import stage_progress
    from sdt_tools.config import load_config
    from sdt_tools.demo.config import DemoConfig
    from sdt_tools.demo.demo import run_demo

    settings = load_config(DemoConfig, config)
    if seed is not None:
        settings = settings.with_seed(seed)
    with stage_progress() as progress:
        summary = run_demo(out, settings, workers, progress)
    if json_output:
        emit(asdict(summary))
        return
    driven = ", ".join(f"{name} {run['ok']} of {run['runs']}" for name, run in summary.closed_loop.items())
    tags = ", ".join(f"{count} {tag}" for tag, count in summary.tags.items() if count)
    console.print(
        f"recorded   {summary.recordings} recordings, {summary.frames:,} scans, {summary.dropped_frames} dropped"
    )
    console.print(f"trained    {summary.val_accuracy:.1%} of {summary.val_frames} validation frames right")
    console.print(f"drove      {driven}, at {summary.real_time_factor:.0f} times real time")
    console.print(f"tagged     {tags}")
    console.print(f"report     {summary.report}")
    console.print(f"look       rerun {summary.rrd}")
