"""``sdt repair``: a broken recording, made whole."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.recording.repair import RepairReport


def command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The recording that was cut off or damaged.")],
    out: Annotated[Path, typer.Option(help="The repaired recording; it must not exist.")],
    json_output: JsonFlag = False,
) -> None:
    """Save all that can be read of a recording into a new one that every reader opens; the original is left as it is.

    The new file is read back with another reader before it gets its name. Intervals that are lost are named.
    """
    from sdt_tools.recording.repair import repair_recording

    report = repair_recording(file, out)
    if json_output:
        emit(report.document())
    else:
        _print(report)


def _print(report: "RepairReport") -> None:
    from rich.table import Table

    lost = report.lost or {}
    table = Table("topic", "messages saved", *(["lost"] if any(lost.values()) else []))
    for topic, count in report.messages.items():
        table.add_row(topic, str(count), *([str(lost.get(topic, 0))] if any(lost.values()) else []))
    console.print(table)
    if report.truncated:
        console.print("the original has no end; it was saved up to where it stops")
    for damage in report.damage:
        console.print(damage.text, soft_wrap=True)
    state = "there was nothing to repair; the copy is whole" if report.sound else "repaired, and read back"
    console.print(f"{report.out}: {state}", soft_wrap=True)
