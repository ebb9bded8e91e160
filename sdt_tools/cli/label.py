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


LabelsOption = Annotated[Path, typer.Option(help="Folder of the journals, <recording>.<kind>.csv.")]
RecordingArgument = Annotated[Path, typer.Argument(metavar="REC", help="Recording (MCAP).")]


@app.command("edit")
def edit(
    recording: RecordingArgument,
    kind: Annotated[Kind, typer.Option(help="motion: a label a scan. gesture: a label a picture.")] = Kind.MOTION,
    labels: LabelsOption = Path("labels"),
    labeler: Annotated[str | None, typer.Option(help="Your name in the journal; without, that of your login.")] = None,
    predictions: Annotated[
        Path | None, typer.Option(help="Predictions by sdt replay, shown as pre-labels in place of the journal's.")
    ] = None,
    model: Annotated[str | None, typer.Option(help="Which model's predictions, where the file has several.")] = None,
    suspects: Annotated[Path | None, typer.Option(help="Suspect labels to go through (Parquet or CSV).")] = None,
    viewer: Annotated[bool, typer.Option("--viewer", help="Show each frame in Rerun's viewer as well.")] = False,
    json_output: JsonFlag = False,
) -> None:
    """Label by hand, in the terminal: one key a class, ? shows all keys. Each act is on disk before it is shown.

    Several people may label one recording at once. End with Ctrl-Q; the next time goes on where you left.
    """
    import getpass
    import signal
    import sys

    from sdt_tools.errors import UsageError
    from sdt_tools.labeling.app.app import label_by_hand
    from sdt_tools.labeling.app.desk import Task
    from sdt_tools.labeling.vocabulary import LabelKind

    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise UsageError("labeling by hand needs a terminal; 'sdt label import' takes labels from a file")
    if model is not None and predictions is None:
        raise UsageError("--model chooses among predictions; name their file with --predictions")
    task = Task(
        recording, LabelKind(kind), labels, labeler or getpass.getuser(), predictions, model=model, suspects=suspects
    )
    beside = None
    if viewer:
        from sdt_tools.cli.seat import keep_rerun_quiet

        keep_rerun_quiet()
        from sdt_tools.view.beside import RerunBeside

        beside = RerunBeside.in_window()
    sitting = label_by_hand(task, beside)
    if sitting.ended_by is signal.SIGHUP:  # nobody reads
        raise typer.Exit(128 + signal.SIGHUP)
    if json_output:
        emit(vars(sitting))
    else:
        new = sitting.labelled - sitting.labelled_before
        done = f"{sitting.labelled:,} of {sitting.frames:,} frames have your label, {new:+,} in this sitting"
        console.print(f"{recording.stem}: {done}; {sitting.conflicts:,} conflicts are open", soft_wrap=True)
    if sitting.ended_by is not None:
        raise typer.Exit(128 + sitting.ended_by)


@app.command("stats")
def stats(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC...", help="Labelled recordings.")],
    kind: Annotated[Kind, typer.Option(help="Which labels.")] = Kind.MOTION,
    labels: LabelsOption = Path("labels"),
    json_output: JsonFlag = False,
) -> None:
    """Say how far the labeling is, what was said how often, where people disagree, and how far they agree."""
    from dataclasses import asdict

    from sdt_tools.labeling.stats import label_stats
    from sdt_tools.labeling.vocabulary import LabelKind

    found = [label_stats(recording, LabelKind(kind), labels) for recording in recordings]
    if json_output:
        emit({"recordings": [asdict(one) for one in found]})
        return
    from sdt_tools.cli.label_tables import print_stats

    print_stats(console, found)


@app.command("export")
def export(
    recording: RecordingArgument,
    out: Annotated[Path, typer.Option(help="The CSV file to write.")],
    kind: Annotated[Kind, typer.Option(help="Which labels.")] = Kind.MOTION,
    labels: LabelsOption = Path("labels"),
    every_word: Annotated[
        bool, typer.Option("--all", help="All that stands, whoever said it; without, one label a frame.")
    ] = False,
    json_output: JsonFlag = False,
) -> None:
    """Write labels as a table: stamp_ns, time_s since the first frame, label, source, labeler."""
    from sdt_tools.labeling.exchange import export_labels
    from sdt_tools.labeling.vocabulary import LabelKind

    done = export_labels(recording, LabelKind(kind), labels, out, every_word=every_word)
    if json_output:
        emit(vars(done))
        return
    console.print(f"{out}: {done.labels:,} labels", soft_wrap=True)


@app.command("import")
def import_(
    recording: RecordingArgument,
    table: Annotated[Path, typer.Argument(metavar="CSV", help="Table with label and stamp_ns, or label and time_s.")],
    labeler: Annotated[str, typer.Option(help="Whose labels they are, or which tool's.")],
    kind: Annotated[Kind, typer.Option(help="Which labels.")] = Kind.MOTION,
    labels: LabelsOption = Path("labels"),
    json_output: JsonFlag = False,
) -> None:
    """Take labels from a table into the recording's journal, as imported: any person's label goes before them.

    stamp_ns must be that of a frame; time_s, in seconds since the first frame, means the nearest one.
    """
    from sdt_tools.labeling.exchange import import_labels
    from sdt_tools.labeling.vocabulary import LabelKind

    done = import_labels(recording, LabelKind(kind), labels, table, labeler)
    if json_output:
        emit(vars(done))
        return
    console.print(f"{done.path}: {done.labels:,} labels, {done.new:,} of them new", soft_wrap=True)


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
    labels: LabelsOption = Path("labels"),
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
