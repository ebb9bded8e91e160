"""``sdt label``: label journals."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_incomplete

app = typer.Typer(no_args_is_help=True, help="Label recordings; labels lie in journals that are only ever added to.")


class Kind(StrEnum):
    """What is labelled."""

    MOTION = "motion"
    GESTURE = "gesture"


class From(StrEnum):
    """Where automatic labels come from."""

    COMMAND = "command"
    TRUTH = "truth"


@app.callback()
def label() -> None:
    """Label recordings; labels lie in journals that are only ever added to."""


@app.command("auto")
def auto(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC...", help="Recordings to label.")],
    source: Annotated[
        From,
        typer.Option(
            "--from",
            help="command: what was commanded while active. truth: what the scene's expert would have done, or the "
            "gesture that the operator made.",
        ),
    ],
    kind: Annotated[Kind, typer.Option(help="motion: a label a decision. gesture: a label an image.")] = Kind.MOTION,
    labels: Annotated[Path, typer.Option(help="Folder of the journals, <recording>.<kind>.csv.")] = Path("labels"),
    json_output: JsonFlag = False,
) -> None:
    """Label from what the recordings themselves say. Labels that already stand are not repeated."""
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.labeling.auto import AutoSource, label_automatically
    from sdt_tools.labeling.vocabulary import LabelKind, LabelSource

    sources: dict[From, AutoSource] = {From.COMMAND: LabelSource.COMMAND, From.TRUTH: LabelSource.TRUTH}
    summaries = []
    with progress_bar("labelling") as report:
        for done, recording in enumerate(recordings):
            report(done, len(recordings))
            summaries.append(label_automatically(recording, LabelKind(kind), sources[source], labels))
    broken = [(summary.journal, line) for summary in summaries for line in summary.broken_lines]
    incomplete = [summary.incomplete for summary in summaries if summary.incomplete is not None]
    counts = {name: sum(summary.counts[name] for summary in summaries) for name in LabelKind(kind).classes}
    if json_output:
        emit(
            {
                "recordings": len(summaries),
                "labels": sum(summary.labels for summary in summaries),
                "appended": sum(summary.appended for summary in summaries),
                "skipped": sum(summary.skipped for summary in summaries),
                "counts": counts,
                "broken_lines": [f"{journal}:{line}" for journal, line in broken],
                "truncated": any(recording.truncated for recording in incomplete),
                "incomplete": [recording.document() for recording in incomplete],
                "journals": [str(summary.journal) for summary in summaries],
            }
        )
        return
    from rich.table import Table

    table = Table("journal", "labels", "new", "skipped")
    for summary in summaries:
        table.add_row(str(summary.journal), f"{summary.labels:,}", f"{summary.appended:,}", f"{summary.skipped:,}")
    console.print(table)
    console.print(", ".join(f"{name} {count:,}" for name, count in counts.items()))
    print_incomplete(incomplete)
    for journal, line in broken:
        console.print(f"{journal}:{line}: the line is broken off; it is kept, and counts for nothing", soft_wrap=True)
