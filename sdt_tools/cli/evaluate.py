"""``sdt evaluate``: closed-loop runs over scenarios."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

app = typer.Typer(no_args_is_help=True, help="Drive networks through scenarios and count what comes of it.")


@app.callback()
def evaluate() -> None:
    """Drive networks through scenarios and count what comes of it."""


@app.command("follow")
def follow(
    models: Annotated[
        list[str], typer.Argument(help="Checkpoint folders; also 'expert' or 'constant:<motion class>' as baselines.")
    ],
    scenario: Annotated[
        list[str], typer.Option("--scenario", help="Name or TOML file of a scenario; may be given several times.")
    ],
    seeds: Annotated[str, typer.Option(help="Seeds, as in 1000-1019 or 3,5,7.")] = "1000-1019",
    out: Annotated[Path, typer.Option(help="Folder of the results; what it already has is not run again.")] = Path(
        "analysis/evaluation"
    ),
    save_runs: Annotated[
        str, typer.Option(help="Keep runs as recordings: none, failed or all, with the expert's advice in them.")
    ] = "none",
    config: Annotated[Path | None, typer.Option(help="TOML file with tables scene and success.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one thread each.")] = 2,
    json_output: JsonFlag = False,
) -> None:
    """Let follow networks drive the robot in closed loop: scans at 50 Hz, decisions at 10 Hz, noise included."""
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.config import load_config
    from sdt_tools.errors import UsageError
    from sdt_tools.evaluation.closed_loop import ClosedLoopConfig
    from sdt_tools.evaluation.evaluate import evaluate_follow, parse_seeds
    from sdt_tools.evaluation.saving import SaveRuns

    if save_runs not in list(SaveRuns):
        raise UsageError(f"--save-runs {save_runs}: choose none, failed or all")
    with progress_bar("driving") as progress:
        summary = evaluate_follow(
            models,
            scenario,
            parse_seeds(seeds),
            load_config(ClosedLoopConfig, config),
            out,
            SaveRuns(save_runs),
            workers,
            progress,
        )
    if json_output:
        emit(
            {
                "models": {
                    model: {name: vars(tally) for name, tally in tallies.items()}
                    for model, tallies in summary.models.items()
                },
                "real_time_factor": round(summary.real_time_factor, 1),
                "runs": str(summary.runs),
                "traces": str(summary.traces),
                "recordings": [str(path) for path in summary.recordings],
            }
        )
        return
    from rich.table import Table

    table = Table("model", "scenario", "ok", "95 % interval", "outcomes")
    for model, tallies in summary.models.items():
        for name, tally in tallies.items():
            failures = ", ".join(f"{count} {outcome}" for outcome, count in tally.outcomes.items() if count)
            interval = f"{tally.wilson[0]:.0%} to {tally.wilson[1]:.0%}"
            table.add_row(model, name, f"{tally.ok} of {tally.runs}", interval, failures)
    console.print(table)
    console.print(f"{summary.real_time_factor:.0f} times real time; runs in {summary.runs}")
    if summary.recordings:
        console.print(f"{len(summary.recordings)} recordings below {out}")
