"""``sdt errors compare``: models against each other on the same frames."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.error_analysis.compare.compare import Comparison


def command(
    predictions: Annotated[
        list[Path],
        typer.Argument(metavar="PREDICTIONS...", help="Files that sdt replay made of the models, with labels."),
    ],
    out: Annotated[Path, typer.Option(help="Folder to write: compare.json, changed_frames.parquet, pictures.")],
    model: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Models to compare, the first with each other one; without, all by name."),
    ] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file of options, such as resamples and lift.")] = None,
    json_output: JsonFlag = False,
) -> None:
    """Say what got better and worse from one model to another, where, and on what condition."""
    from sdt_tools.config import load_config
    from sdt_tools.error_analysis.compare.compare import compare_models
    from sdt_tools.error_analysis.compare.options import CompareOptions

    report = compare_models(predictions, tuple(model or ()), load_config(CompareOptions, config), out)
    if json_output:
        emit({**report.document(), "out": str(out)})
        return
    frames = report.frames
    console.print(f"{len(frames.recording):,} frames of {frames.recordings} recordings, answered by all")
    for one in frames.mismatches:
        if one.without_partner or one.other_label:
            console.print(
                f"{one.model}: {one.without_partner:,} frames were not answered by all, "
                f"{one.other_label:,} are labelled otherwise elsewhere; left out",
                style="yellow",
            )
    for comparison in report.comparisons:
        _print(comparison)
    console.print(f"written to {out}", soft_wrap=True)


def _print(comparison: "Comparison") -> None:
    from rich.table import Table

    numbers = Table("", comparison.base, comparison.other, "difference (95 %)")
    for name, measure in comparison.measures.items():
        numbers.add_row(
            name.replace("_", " "),
            f"{measure.base.value:.3f}",
            f"{measure.other.value:.3f}",
            measure.difference.text("+.3f"),
        )
    console.print(numbers)
    where = Table("where", "frames", "recordings", "got worse", "got better", "net (95 %)")
    for change in comparison.changes:
        where.add_row(
            f"{change.group} = {change.value}" if change.value else "all frames",
            f"{change.frames:,}",
            f"{change.recordings:,}",
            f"{change.worse:,}",
            f"{change.better:,}",
            change.net.text("+.3f"),
        )
    console.print(where)
    for what, search in (("worse", comparison.worse), ("better", comparison.better)):
        for verdict in search.confirmed:
            console.print(
                f"got {what} where {verdict.condition.text}: {verdict.mean_loss_in:.1%} of the frames inside, "
                f"{verdict.mean_loss_out:.1%} outside (p = {verdict.p_adjusted:.3f})"
            )
        if not search.confirmed:
            console.print(f"got {what}: {search.note or 'no condition was confirmed'}")
