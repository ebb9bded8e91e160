"""What commands print: tables and progress for people on stderr, one JSON document for machines on stdout."""

import json
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

if TYPE_CHECKING:
    from sdt_tools.recording.incomplete import Incomplete

JsonFlag = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]

console = Console(stderr=True, highlight=False, markup=False)
"""Names of files may hold brackets, so that nothing in them is markup."""


def emit(document: Mapping[str, Any]) -> None:
    """Print ``document`` as the one JSON document of this command."""
    json.dump(document, sys.stdout, indent=2, default=str)
    sys.stdout.write("\n")


def print_incomplete(recordings: "Iterable[Incomplete]") -> None:
    """Say of each of ``recordings`` where it is cut off and what is lost of it."""
    for recording in recordings:
        for line in recording.lines():
            console.print(line, style="yellow", markup=False, soft_wrap=True)


def print_messages(path: Path, messages: Mapping[str, int]) -> None:
    """Print how many messages of each topic are in ``path``."""
    from rich.table import Table

    table = Table("topic", "messages")
    for topic, count in messages.items():
        table.add_row(topic, str(count))
    console.print(f"{path}: {sum(messages.values())} messages")
    console.print(table)
