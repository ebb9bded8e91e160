"""``sdt evaluate vision``: the whole controller over scenarios, and what its vision network misread."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sdt_tools.evaluation.vision.evaluate import VisionSummary
    from sdt_tools.evaluation.vision.results import VisionTally
    from sdt_tools.evaluation.vision.spread import Evenness


def command(
    models: Annotated[
        list[str],
        typer.Argument(
            help="Checkpoint folders; also 'truth', which reads the scene, or 'constant:<gesture>' as baselines."
        ),
    ],
    follow: Annotated[
        str,
        typer.Option(help="Who drives while active: a follow network's folder, expert, polar or constant:CLASS."),
    ] = "expert",
    scenario: Annotated[
        list[str] | None,
        typer.Option(
            "--scenario", help="Name or TOML file of a scenario; may be given several times. [the seven standard ones]"
        ),
    ] = None,
    seeds: Annotated[str, typer.Option(help="Seeds, as in 1000-1019 or 3,5,7.")] = "1000-1019",
    out: Annotated[Path, typer.Option(help="Folder of the results; what it already has is not run again.")] = Path(
        "analysis/evaluation_vision"
    ),
    debounce: Annotated[
        int | None, typer.Option(min=1, help="Readings in a row that switch the mode. [1, at once, as in the paper]")
    ] = None,
    save_runs: Annotated[
        str, typer.Option(help="Keep runs as recordings: none, failed or all; mode errors are marked in their log.")
    ] = "none",
    figures: Annotated[bool, typer.Option("--figures", help="Draw errors and runs, to OUT/figures.")] = False,
    config: Annotated[
        Path | None, typer.Option(help="TOML file with tables scene, controller, success and whole.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one thread each.")] = 2,
    json_output: JsonFlag = False,
) -> None:
    """Let vision networks switch the robot on and off by the operator's gestures, and count what they misread.

    A mode error is a switch by a gesture that was not shown; one that changes nothing is none, as in the paper. A
    command is missed when no picture of its gesture, arms on the way included, switches the mode. A run is ok without
    mode errors and contact, when every command is heard within 2 s, the operator is followed until his arms begin to
    disable, and the idle robot stands.
    """
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.config import load_config
    from sdt_tools.errors import UsageError
    from sdt_tools.evaluation.grid import parse_seeds
    from sdt_tools.evaluation.saving import SaveRuns
    from sdt_tools.evaluation.vision.evaluate import evaluate_vision
    from sdt_tools.evaluation.vision.run import VisionLoopConfig
    from sdt_tools.scene.scenario import STANDARD_VISION

    if save_runs not in list(SaveRuns):
        raise UsageError(f"--save-runs {save_runs}: choose none, failed or all")
    settings = load_config(VisionLoopConfig, config)
    if debounce is not None:
        controller = settings.controller.model_copy(update={"debounce": debounce})
        settings = settings.model_copy(update={"controller": controller})
    with progress_bar("driving") as progress:
        summary = evaluate_vision(
            models,
            follow,
            scenario or STANDARD_VISION,
            parse_seeds(seeds),
            settings,
            out,
            SaveRuns(save_runs),
            workers,
            progress,
        )
    pictures = _draw(summary, out / "figures") if figures else []
    if json_output:
        emit(_document(summary, pictures))
    else:
        _show(summary, pictures)


def _draw(summary: "VisionSummary", folder: Path) -> list[Path]:
    import polars as pl

    from sdt_tools.evaluation.vision.figure import errors_figure, runs_figure
    from sdt_tools.paper.printed import MODE_ERRORS

    folder.mkdir(parents=True, exist_ok=True)
    pictures = [folder / "errors.png", folder / "runs.png"]
    names = short_names(list(summary.models))
    errors_figure({names[model]: scenarios for model, scenarios in summary.models.items()}, MODE_ERRORS, pictures[0])
    runs_figure(pl.read_parquet(summary.decisions), names, pictures[1])
    return pictures


def short_names(models: "Sequence[str]") -> "dict[str, str]":
    """The last part of each model's path, where these differ."""
    short = {model: Path(model).name or model for model in models}
    return short if len(set(short.values())) == len(short) else {model: model for model in models}


def _document(summary: "VisionSummary", pictures: "Sequence[Path]") -> dict[str, object]:
    from sdt_tools.paper.printed import MODE_ERRORS

    return {
        "models": {
            model: {name: vars(tally) for name, tally in tallies.items()} for model, tallies in summary.models.items()
        },
        "total": {model: vars(tally) for model, tally in summary.total.items()},
        "spread": {
            model: {**vars(one), "expected": dict(zip(summary.models[model], one.expected, strict=True))}
            | {"decided": one.decided}
            for model, one in summary.spread.items()
        },
        "paper": {str(epsilon): dict(errors) for epsilon, errors in MODE_ERRORS.items()},
        "errors_while": {model: dict(counts) for model, counts in summary.errors_while.items()},
        "cpu_seconds_a_run": round(summary.run_s, 2),
        "runs": str(summary.runs),
        "decisions": str(summary.decisions),
        "recordings": [str(path) for path in summary.recordings],
        "figures": [str(path) for path in pictures],
    }


def _show(summary: "VisionSummary", pictures: "Sequence[Path]") -> None:
    """A row a scenario: the paper's errors of one run each, then ours; below it how they spread."""
    from rich.table import Table

    from sdt_tools.paper.printed import MODE_ERRORS

    names = short_names(list(summary.models))
    table = Table("", title="mode errors a run, 95 % intervals, beside the paper's (one run each)", show_lines=True)
    for epsilon in MODE_ERRORS:
        table.add_column(f"paper\nε={epsilon}", justify="right")
    for model in summary.models:
        table.add_column(names[model])
    for name in next(iter(summary.models.values())):
        printed = [str(errors[name]) if name in errors else "" for errors in MODE_ERRORS.values()]
        table.add_row(name, *printed, *(_cell(tallies[name]) for tallies in summary.models.values()))
    complete = set(next(iter(summary.models.values()))) == set(MODE_ERRORS[0])
    printed = [str(sum(errors.values())) if complete else "" for errors in MODE_ERRORS.values()]
    scenarios = len(next(iter(summary.models.values())))
    table.add_row("all, once each", *printed, *(_cell(tally, scenarios) for tally in summary.total.values()))
    console.print(table)
    console.print(
        "interval: the wider of bootstrap over runs (over seeds, for all) and the exact Poisson one", style="dim"
    )
    for model, one in summary.spread.items():
        console.print(f"{names[model]}: {spread_words(one)}", soft_wrap=True)
        if doing := summary.errors_while[model]:
            told = ", ".join(f"{what} {count}" for what, count in list(doing.items())[:6])
            console.print(f"  while the operator's hands did: {told}", soft_wrap=True)
    console.print(f"{summary.run_s:.1f} processor seconds a run; runs in {summary.runs}", soft_wrap=True)
    if pictures:
        console.print(f"figures: {', '.join(map(str, pictures))}", soft_wrap=True)
    if summary.recordings:
        console.print(f"{len(summary.recordings)} recordings kept; look at one with:", soft_wrap=True)
        console.print(f"  sdt view {summary.recordings[0]} --open", soft_wrap=True)


def spread_words(one: "Evenness") -> str:
    """Whether errors spread evenly over the scenarios, in words."""
    if one.p_value is None:
        return f"{one.errors} mode errors" if one.errors else "no mode errors"
    tested = f"{one.errors} mode errors, evenly spread over scenarios: p = {one.p_value:.2g}"
    if not one.decided:
        return f"{tested}, too few to tell"
    return f"{tested}, {'they are not' if one.p_value < 0.05 else 'no sign that they are not'}"


def _cell(tally: "VisionTally", scenarios: int = 1) -> str:
    """``scenarios``: of how many the errors are summed up."""
    low, high = (scenarios * end for end in tally.interval)
    heard = f"{tally.missed} of {tally.commands} commands missed" if tally.commands else "no commands"
    return (
        f"{scenarios * tally.per_run:.2f} ({low:.2f} to {high:.2f}), {tally.mode_errors} in {tally.runs} runs\n"
        f"{heard}; {tally.ok} ok{_others(tally)}"
    )


def _others(tally: "VisionTally") -> str:
    """As `` (3 switched, 1 missed)``."""
    others = ", ".join(f"{count} {name}" for name, count in tally.outcomes.items() if count and name != "ok")
    return f" ({others})" if others else ""
