"""``sdt errors``: why frames are wrong."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli import errors_claims, errors_compare, errors_selftest, errors_suspects
from sdt_tools.cli.console import JsonFlag, console, emit, print_incomplete
from sdt_tools.cli.default_command import WithDefault


class Near(StrEnum):
    """Where frames are neighbours."""

    SCAN = "scan"
    FEATURE = "feature"
    TIME = "time"


app = typer.Typer(
    cls=WithDefault,
    no_args_is_help=True,
    help="Say of every wrong frame why it is wrong. Without a sub-command named: analyse.",
)


app.command("claims")(errors_claims.command)
app.command("compare")(errors_compare.command)
app.command("selftest")(errors_selftest.command)


@app.callback()
def errors() -> None:
    """Say of every wrong frame why it is wrong. Without a sub-command named: analyse."""


app.command("suspects")(errors_suspects.command)


@app.command("analyse")
def analyse(
    predictions: Annotated[Path, typer.Argument(metavar="PREDICTIONS", help="File that sdt replay made, with labels.")],
    recordings: Annotated[
        list[Path],
        typer.Option("--recordings", help="The replayed recordings, or folders of them; may be given several times."),
    ],
    out: Annotated[Path, typer.Option(help="Folder to write: report.html, tags.parquet, errors.json, figures.")],
    model: Annotated[str | None, typer.Option(help="Model, where the predictions are of several.")] = None,
    neighbourhood: Annotated[
        Near | None,
        typer.Option(
            help="Where the neighbours of a transient error are: in scans (follow networks), in the network's feature "
            "space (vision networks), or in time (frames within so many ms). [scan or feature]"
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            help="TOML file of options, such as loss, eta, and the ε of each neighbourhood: epsilon_m, "
            "epsilon_feature, epsilon_ms."
        ),
    ] = None,
    json_output: JsonFlag = False,
) -> None:
    """Tag every wrong frame: systematic, conditional (and on what), transient, isolated or unexplained.

    While it works, scans or features lie in a nameless file beside --out, 2.2 kB a scan, 4 bytes a feature: they need
    not fit in memory.
    """
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.config import load_config
    from sdt_tools.error_analysis.analyse import analyse_errors
    from sdt_tools.error_analysis.definitions import ErrorOptions

    options = load_config(ErrorOptions, config)
    if neighbourhood:
        options = options.model_copy(update={"neighbourhood": neighbourhood.value})
    with progress_bar("frames, then neighbours") as progress:
        report = analyse_errors(predictions, recordings, options, out, model, progress)
    if json_output:
        emit({**report.document(), "out": str(out)})
        return
    from rich.table import Table

    table = Table("tag", "frames", "share", "95 % interval")
    for tag, share in report.tags.items():
        table.add_row(str(tag), f"{share.count:,}", f"{share.share:.2%}", f"{share.low:.2%} to {share.high:.2%}")
    console.print(table)
    epsilon = report.epsilon
    console.print(
        f"{report.errors:,} errors in {report.frames:,} labelled frames; neighbours in {epsilon.measure.neighbourhood} "
        f"up to ε = {epsilon.text}"
    )
    if report.conditions:
        found = Table("condition", "frames", "mean loss inside", "outside", "p (Holm)")
        for condition in report.conditions:
            verdict = condition.verdict
            found.add_row(
                verdict.condition.text,
                f"{condition.frames:,}",
                f"{verdict.mean_loss_in:.2f}",
                f"{verdict.mean_loss_out:.2f}",
                f"{verdict.p_adjusted:.3f}",
            )
        console.print(found)
    else:
        console.print(report.note or "no condition was confirmed")
    for warning in report.warnings:
        console.print(warning, style="yellow")
    print_incomplete(report.incomplete)
    console.print(f"written to {out}; read {out / 'report.html'}", soft_wrap=True)
