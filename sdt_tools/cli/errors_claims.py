"""``sdt errors claims``: what the paper claims, held against predictions."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_incomplete

if TYPE_CHECKING:
    from sdt_tools.error_analysis.claims.judge import ClaimReport

_COLOURS = {"supported": "green", "contradicted": "red", "undecided": "yellow"}


def command(
    predictions: Annotated[
        list[Path],
        typer.Argument(
            metavar="PREDICTIONS...", help="Files that sdt replay made of the networks over the same recordings."
        ),
    ],
    model: Annotated[
        list[Path],
        typer.Option(metavar="CHECKPOINT", help="The networks that made them; several times. Level 0 is the standard."),
    ],
    out: Annotated[Path, typer.Option(help="Folder to write: claims.md, claims.json, claims.parquet, pictures.")],
    evaluation: Annotated[
        list[Path] | None,
        typer.Option(metavar="RUNS", help="Closed-loop runs of the networks (runs.parquet of sdt evaluate)."),
    ] = None,
    recordings: Annotated[
        list[Path] | None,
        typer.Option(help="The replayed recordings, or folders of them, for what needs the scans; several times."),
    ] = None,
    tags: Annotated[
        list[Path] | None,
        typer.Option(help="Folders that sdt errors wrote for these predictions; without, conditions are searched."),
    ] = None,
    adversarial: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="A model whose errors should be transient and even over scenarios."),
    ] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file of options, such as loss and resamples.")] = None,
    json_output: JsonFlag = False,
) -> None:
    """Say of each claim of the paper whether predictions support it, contradict it, or leave it undecided.

    Of vision networks these are the two claims about adversarial training, judged of those whose checkpoints say that
    they were trained so, and of those named.
    """
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.config import load_config
    from sdt_tools.error_analysis.claims.judge import Sources, judge_claims
    from sdt_tools.error_analysis.claims.options import ClaimOptions

    sources = Sources(
        tuple(predictions),
        tuple(model),
        tuple(evaluation or ()),
        tuple(tags or ()),
        tuple(recordings or ()),
        tuple(adversarial or ()),
    )
    options = load_config(ClaimOptions, config)
    with progress_bar("judging claims") as progress:
        report = judge_claims(sources, options, out, progress)
    if json_output:
        emit({**report.document(), "out": str(out)})
        return
    _print(report)
    print_incomplete(report.incomplete)
    console.print(f"written to {out}", soft_wrap=True)


def _print(report: "ClaimReport") -> None:
    from itertools import groupby

    from rich.table import Table
    from rich.text import Text

    for statement, verdicts in groupby(report.verdicts, key=lambda verdict: verdict.statement):
        console.print(f"\n{statement}", style="bold")
        table = Table.grid(padding=(0, 2))
        for _ in range(3):
            table.add_column(no_wrap=True)
        table.add_column()
        broken: dict[str, None] = {}
        for verdict in verdicts:
            finding = Text(str(verdict.finding), style=_COLOURS[str(verdict.finding)])
            value = verdict.estimate.text() if verdict.frames else ""
            support = f"{verdict.frames:,} in {verdict.recordings:,}" if verdict.recordings else verdict.reason
            table.add_row(verdict.about, finding, value, support)
            broken |= dict.fromkeys(premise.name for premise in verdict.premises if premise.holds is False)
        console.print(table)
        if broken:
            console.print(f"broken premises: {', '.join(broken)}", style="yellow")
    console.print("\nvalues with 95 % intervals over recordings; frames (or worlds, errors) in so many recordings")
    for left_out in report.summary["left_out"]:
        console.print(
            f"{left_out['model']}: {left_out['without_partner']:,} frames were not answered by all, "
            f"{left_out['other_label']:,} are labelled otherwise elsewhere; left out",
            style="yellow",
        )
