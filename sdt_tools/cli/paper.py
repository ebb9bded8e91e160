"""``sdt paper``: the paper's experiments done again."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

app = typer.Typer(no_args_is_help=True, help="Do the paper's experiments again, with intervals.")


@app.callback()
def paper() -> None:
    """Do the paper's experiments again, with intervals."""


@app.command("follow")
def follow(
    out: Annotated[Path, typer.Option(help="Folder of all that is made; a rerun resumes what it has.")] = Path(
        "analysis/follow"
    ),
    config: Annotated[Path | None, typer.Option(help="TOML file with the study's sizes and settings.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one thread each.")] = 2,
    json_output: JsonFlag = False,
) -> None:
    """Record, train, certify, check and drive the follow networks of all levels: about an hour and a half on two cores.

    Gives the paper's Tables III and IV with intervals, the sweep of λ, and level 4.
    """
    import json

    from sdt_tools.cli.progress import stage_progress
    from sdt_tools.config import load_config
    from sdt_tools.paper.follow_config import FollowStudyConfig
    from sdt_tools.paper.follow_study import run_follow_study

    with stage_progress() as progress:
        report = run_follow_study(out, load_config(FollowStudyConfig, config), workers, progress)
    if json_output:
        emit(json.loads(report.with_suffix(".json").read_text(encoding="utf-8")))
    else:
        console.print(f"report     {report}")


@app.command("vision")
def vision(
    out: Annotated[Path, typer.Option(help="Folder of all that is made; a rerun resumes what it has.")] = Path(
        "analysis/vision"
    ),
    follow: Annotated[
        str | None, typer.Option(help="Who drives while active: a follow network's folder, or expert. [expert]")
    ] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file with the study's sizes and settings.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one thread each.")] = 2,
    json_output: JsonFlag = False,
) -> None:
    """Record, train, attack and drive the vision networks of all ε: some hours on two cores.

    Gives the paper's Tables I and V with intervals, and the attack figure.
    """
    import json

    from sdt_tools.cli.progress import stage_progress
    from sdt_tools.config import load_config
    from sdt_tools.paper.vision_config import VisionStudyConfig
    from sdt_tools.paper.vision_study import run_vision_study

    settings = load_config(VisionStudyConfig, config)
    if follow is not None:
        settings = settings.model_copy(update={"follow": follow})
    with stage_progress() as progress:
        report = run_vision_study(out, settings, workers, progress)
    if json_output:
        emit(json.loads(report.with_suffix(".json").read_text(encoding="utf-8")))
    else:
        console.print(f"report     {report}")
