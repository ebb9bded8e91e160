"""``sdt check``: the standing checks of networks."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.evaluation.standing_checks import ChecksReport


def command(
    models: Annotated[list[Path], typer.Argument(metavar="MODEL…", help="Checkpoint folders.")],
    dataset: Annotated[Path, typer.Option(help="Data set; its validation frames are used.")],
    seed: Annotated[int, typer.Option(min=0, help="Rays that turn into codes.")] = 0,
    json_output: JsonFlag = False,
) -> None:
    """Check networks where accuracy does not look: objects pasted ahead, clipped ranges, mirrored scans, codes."""
    from sdt_tools.dataset.load import load_dataset
    from sdt_tools.evaluation.standing_checks import standing_checks
    from sdt_tools.models.checkpoint import load_checkpoint

    loaded = {str(path): load_checkpoint(path) for path in models}
    frames = load_dataset(dataset).val
    with console.status("checking"):
        reports = {path: standing_checks(model, frames, seed) for path, model in loaded.items()}
    if json_output:
        emit(
            {
                "models": {
                    path: {**report.document(), "clip_loss": report.clip_loss()} for path, report in reports.items()
                }
            }
        )
    else:
        _show(reports)


def _show(reports: "dict[str, ChecksReport]") -> None:
    from rich.table import Table

    table = Table("check", *reports, title="shares of frames, 95 % intervals")
    for name in next(iter(reports.values())).rates:
        cells = []
        for report in reports.values():
            rate = report.rates[name]
            cells.append(f"{rate.share:.1%} ({rate.wilson[0]:.1%} to {rate.wilson[1]:.1%}) of {rate.trials}")
        table.add_row(name.replace("_", " "), *cells)
    console.print(table)
