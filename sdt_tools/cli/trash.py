"""``sdt edit trash``: recordings thrown away, and had back."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

app = typer.Typer(no_args_is_help=True, help="Throw recordings away with their labels, list them, have them back.")

Dir = Annotated[Path, typer.Option("--dir", help="The folder of the recordings, beside which their trash lies.")]
RECORDINGS = Path("recordings")


@app.command("list")
def list_(folder: Dir = RECORDINGS, json_output: JsonFlag = False) -> None:
    """List what is in the trash, oldest first."""
    from rich.table import Column, Table

    from sdt_tools.recording.trash import trashed

    entries = trashed(folder)
    if json_output:
        document = [
            {
                "name": entry.name,
                "discarded_ns": entry.discarded_ns,
                "reason": entry.reason,
                "size_bytes": entry.size_bytes,
                "files": {str(file.path): str(file.origin) for file in entry.files},
            }
            for entry in entries
        ]
        emit({"trash": document})
        return
    table = Table(Column("name", no_wrap=True, overflow="fold"), Column("from", overflow="fold"), "MB", "why")
    for entry in entries:
        origin = "unknown" if entry.discarded_ns is None else _seen_from_here(entry.files[0].origin)
        table.add_row(entry.name, origin, f"{entry.size_bytes / 1e6:.1f}", entry.reason)
    console.print(table if entries else f"{folder}: its trash is empty")


def _seen_from_here(path: Path) -> str:
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


@app.command("restore")
def restore(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A name from the list, or that of the recording.")],
    folder: Dir = RECORDINGS,
    json_output: JsonFlag = False,
) -> None:
    """Bring a recording and its labels back to where they were; nothing is written over."""
    from sdt_tools.recording import trash

    files = trash.restore(folder, name)
    if json_output:
        emit({"restored": [str(file) for file in files]})
        return
    for file in files:
        console.print(f"{file}: is back", soft_wrap=True)


@app.command("put")
def put(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC...", help="Recordings to throw away.")],
    reason: Annotated[str, typer.Option(help="Why; the list shows it.")] = "",
    labels: Annotated[Path, typer.Option(help="Folder of their journals, which go along.")] = Path("labels"),
    json_output: JsonFlag = False,
) -> None:
    """Move recordings and their label journals to the trash beside them."""
    import time

    from sdt_tools.labeling.follow import discard_with_labels

    folders = discard_with_labels(recordings, labels, reason, time.time_ns())
    if json_output:
        emit({"trashed": [str(folder) for folder in folders]})
        return
    for folder in folders:
        console.print(f"{folder}", soft_wrap=True)
