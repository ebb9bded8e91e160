"""``sdt evaluate``: closed-loop runs over scenarios."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli import evaluate_vision
from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sdt_tools.evaluation.evaluate import EvaluationSummary
    from sdt_tools.evaluation.results import Tally

app = typer.Typer(no_args_is_help=True, help="Drive networks through scenarios and count what comes of it.")


@app.callback()
def evaluate() -> None:
    """Drive networks through scenarios and count what comes of it."""


app.command("vision")(evaluate_vision.command)


@app.command("follow")
def follow(
    models: Annotated[
        list[str],
        typer.Argument(help="Checkpoint folders; also 'expert', 'polar' or 'constant:<motion class>' as baselines."),
    ],
    scenario: Annotated[
        list[str] | None,
        typer.Option(
            "--scenario", help="Name or TOML file of a scenario; may be given several times. [the seven standard ones]"
        ),
    ] = None,
    seeds: Annotated[str, typer.Option(help="Seeds, as in 1000-1019 or 3,5,7.")] = "1000-1019",
    out: Annotated[Path, typer.Option(help="Folder of the results; what it already has is not run again.")] = Path(
        "analysis/evaluation"
    ),
    save_runs: Annotated[
        str, typer.Option(help="Keep runs as recordings: none, failed or all, with the expert's advice in them.")
    ] = "none",
    figures: Annotated[bool, typer.Option("--figures", help="Draw the driven paths, to OUT/figures.")] = False,
    config: Annotated[Path | None, typer.Option(help="TOML file with tables scene and success.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one thread each.")] = 2,
    json_output: JsonFlag = False,
) -> None:
    """Let follow networks drive the robot in closed loop: scans at 50 Hz, decisions at 10 Hz, noise included."""
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.config import load_config
    from sdt_tools.errors import UsageError
    from sdt_tools.evaluation.closed_loop import ClosedLoopConfig
    from sdt_tools.evaluation.evaluate import evaluate_follow
    from sdt_tools.evaluation.grid import parse_seeds
    from sdt_tools.evaluation.saving import SaveRuns
    from sdt_tools.scene.scenario import STANDARD_FOLLOW

    if save_runs not in list(SaveRuns):
        raise UsageError(f"--save-runs {save_runs}: choose none, failed or all")
    scenarios = scenario or STANDARD_FOLLOW
    with progress_bar("driving") as progress:
        summary = evaluate_follow(
            models,
            scenarios,
            parse_seeds(seeds),
            load_config(ClosedLoopConfig, config),
            out,
            SaveRuns(save_runs),
            workers,
            progress,
        )
    pictures = _draw(summary, scenarios, out / "figures") if figures else []
    if json_output:
        emit(_document(summary, pictures))
    else:
        _show(summary, pictures)


def _draw(summary: "EvaluationSummary", scenarios: "Sequence[str]", folder: Path) -> list[Path]:
    """An overview of all models and scenarios, and the runs of each."""
    import polars as pl

    from sdt_tools.evaluation.figure import runs_figure, scenarios_figure
    from sdt_tools.evaluation.policies import policy_for
    from sdt_tools.scene.scenario import layout_for

    folder.mkdir(parents=True, exist_ok=True)
    runs, traces = pl.read_parquet(summary.runs), pl.read_parquet(summary.traces)
    first = min(runs["seed"].to_list())
    pictures = [folder / "scenarios.png"]
    rows = {model: policy_for(model).name.removeprefix("policy:") for model in summary.models}
    scenarios_figure(runs, traces, scenarios, rows, first, pictures[0])
    for number, (model, title) in enumerate(rows.items()):
        for scenario in scenarios:
            name = layout_for(scenario, first).name
            mine = (pl.col("model") == model) & (pl.col("scenario") == name)
            picture = folder / f"{number}_{title.replace(':', '-')}_{name}.png"
            runs_figure(runs.filter(mine), traces.filter(mine), scenario, f"{title} in {name}", picture)
            pictures.append(picture)
    return pictures


def _document(summary: "EvaluationSummary", pictures: "Sequence[Path]") -> dict[str, object]:
    return {
        "models": {
            model: {name: vars(tally) for name, tally in tallies.items()} for model, tallies in summary.models.items()
        },
        "total": {model: vars(tally) for model, tally in summary.total.items()},
        "nesting": [{**vars(pair), "nested": pair.nested} for pair in summary.nesting],
        "where_failed": [vars(one) for one in summary.where_failed],
        "real_time_factor": round(summary.real_time_factor, 1),
        "runs": str(summary.runs),
        "traces": str(summary.traces),
        "failures": str(summary.failures),
        "recordings": [str(path) for path in summary.recordings],
        "figures": [str(path) for path in pictures],
    }


def _show(summary: "EvaluationSummary", pictures: "Sequence[Path]") -> None:
    """A row a scenario, a column a model; then what the failures have in common."""
    from rich.table import Table

    table = Table("", *summary.models, title="runs that ended well, 95 % intervals, and the other outcomes")
    for name in next(iter(summary.models.values())):
        table.add_row(name, *(_cell(tallies[name]) for tallies in summary.models.values()))
    table.add_section()
    table.add_row("all", *(_cell(tally) for tally in summary.total.values()))
    console.print(table)
    for pair in summary.nesting:
        if pair.failed_by_first:
            console.print(
                f"of {pair.failed_by_first} runs that {pair.first} fails, {pair.second} fails {pair.failed_by_both}; "
                f"{pair.expected:.1f} would be by chance"
            )
    for one in summary.where_failed:
        if one.failures:
            console.print(
                f"{one.model}: {one.forward} of {one.failures} failures while driving forward; nearest thing in the "
                f"watched rays {one.median_watched_range_m:.2f} m (median)"
            )
    console.print(f"{summary.real_time_factor:.0f} times real time; runs in {summary.runs}")
    if pictures:
        console.print(f"driven paths: {pictures[0]} and {len(pictures) - 1} more beside it", soft_wrap=True)
    if summary.recordings:
        console.print(f"{len(summary.recordings)} recordings kept; look at one with:", soft_wrap=True)
        console.print(f"  sdt view {summary.recordings[0]} --open", soft_wrap=True)


def _cell(tally: "Tally") -> str:
    failures = ", ".join(f"{count} {name}" for name, count in tally.outcomes.items() if count and name != "ok")
    return f"{tally.ok} of {tally.runs} ({tally.wilson[0]:.0%} to {tally.wilson[1]:.0%}) {failures}".rstrip()
