"""``sdt import``: recordings from other formats."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

app = typer.Typer(no_args_is_help=True, help="Make recordings from drives in other formats.")


@app.callback()
def import_() -> None:
    """Make recordings from drives in other formats."""


@app.command("lidar-csv")
def lidar_csv(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The drive: .csv, or .csv.gz compressed with gzip.")],
    hz: Annotated[float, typer.Option(help="Scans a second; the file does not say.")],
    out: Annotated[Path, typer.Option(help="The recording to write; it must not exist.")],
    json_output: JsonFlag = False,
) -> None:
    """Import a drive with one LMS1xx scan a row: step, two state values, 541 ranges in metres, steering.

    Only the scans are taken: state and steering have no topic in a recording. Stamps start at 2025-01-01.
    """
    from sdt_tools.recording.exchange.lidar_csv import import_lidar_csv

    summary = import_lidar_csv(file, out, hz)
    if json_output:
        emit({**vars(summary), "path": str(summary.path)})
    else:
        console.print(
            f"{summary.path}: {summary.scans} scans, {summary.seconds:.1f} s at {hz:g} Hz, "
            f"{summary.invalid_share:.2%} of the rays without a distance; steering and state columns left out"
        )
