"""``sdt edit``: parts of recordings, joins of them, what is left without something; and the trash."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli import trash
from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.labeling.follow import FollowedJournal
    from sdt_tools.recording.editing.plan import Cut, Merge
    from sdt_tools.recording.editing.provenance import EditedRecording

app = typer.Typer(no_args_is_help=True, help="Trim, split, merge and drop, into new files; label journals follow.")
app.add_typer(trash.app, name="trash")

Recording = Annotated[Path, typer.Argument(metavar="REC", help="The recording; it is only read.")]
Out = Annotated[Path, typer.Option(help="The new recording; it must not exist.")]
Labels = Annotated[Path, typer.Option(help="Folder of the journals, of the originals and of the new recordings.")]
From = Annotated[
    str | None,
    typer.Option("--from", metavar="TIME", help="Seconds from the start, as 2.5, or nanoseconds since 1970, as 17…ns."),
]
To = Annotated[str | None, typer.Option("--to", metavar="TIME", help="The same; that very moment is out.")]
LABELS = Path("labels")


@app.callback()
def edit() -> None:
    """Trim, split, merge and drop, into new files; label journals follow.

    Stamps and data stay to the bit, topics of others too. A part that begins later is given the last calibration and
    transforms before its beginning.
    """


@app.command("trim")
def trim(
    recording: Recording,
    out: Out,
    start: From = None,
    end: To = None,
    labels: Labels = LABELS,
    json_output: JsonFlag = False,
) -> None:
    """Keep what was received from --from to --to; without one of them, from or to the recording's own end."""
    from sdt_tools.recording.editing.plan import plan_trim

    _carry_out(plan_trim(recording, start, end, out), labels, json_output)


@app.command("split")
def split(
    recording: Recording,
    out_dir: Annotated[Path, typer.Option(help="Folder of the parts, <recording>_01 and so on.")],
    at: Annotated[
        list[str] | None, typer.Option(metavar="TIME", help="A moment as in trim, where a part begins; repeat it.")
    ] = None,
    every: Annotated[float | None, typer.Option(metavar="SECONDS", help="How long each part lasts.")] = None,
    labels: Labels = LABELS,
    json_output: JsonFlag = False,
) -> None:
    """Make parts that follow each other, --at moments or --every so many seconds. Empty ones are left out."""
    from sdt_tools.errors import UsageError
    from sdt_tools.recording.editing.plan import plan_split, plan_split_every

    if at and every is None:
        plan = plan_split(recording, at, out_dir)
    elif every is not None and not at:
        plan = plan_split_every(recording, every, out_dir)
    else:
        raise UsageError("say where to split: --at or --every, one of them")
    _carry_out(plan, labels, json_output)


@app.command("merge")
def merge(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC...", help="Two recordings or more; only read.")],
    out: Out,
    labels: Labels = LABELS,
    json_output: JsonFlag = False,
) -> None:
    """Make one of several, in the order of time; where they overlap, their messages are interleaved.

    What several hold alike, as parts of one recording that overlap do, is taken once.
    """
    from sdt_tools.recording.editing.plan import plan_merge

    _carry_out(plan_merge(recordings, out), labels, json_output)


@app.command("drop")
def drop(
    recording: Recording,
    out: Out,
    topic: Annotated[list[str] | None, typer.Option(metavar="TOPIC", help="A topic to leave out; repeat it.")] = None,
    start: From = None,
    end: To = None,
    labels: Labels = LABELS,
    json_output: JsonFlag = False,
) -> None:
    """Leave out topics, or an interval out of the middle."""
    from sdt_tools.errors import UsageError
    from sdt_tools.recording.editing.plan import plan_drop_interval, plan_drop_topics

    interval = start is not None or end is not None
    if topic and not interval:
        plan = plan_drop_topics(recording, topic, out)
    elif interval and not topic:
        plan = plan_drop_interval(recording, start, end, out)
    else:
        raise UsageError("say what to drop: topics, or an interval by --from and --to, one of them")
    _carry_out(plan, labels, json_output)


def _carry_out(plan: "Cut | Merge", labels: Path, json_output: bool) -> None:
    from sdt_tools.labeling.follow import edit_with_labels

    edited, journals = edit_with_labels(plan, labels)
    if json_output:
        told = [{"path": str(j.path), "acts": j.acts, "of": j.given} for j in journals]
        emit({"recordings": [recording.document() for recording in edited], "journals": told})
    else:
        _print(edited, journals)


def _print(edited: "tuple[EditedRecording, ...]", journals: "tuple[FollowedJournal, ...]") -> None:
    from rich.table import Column, Table

    table = Table(Column("recording", overflow="fold"), "seconds", "messages", "carried to the beginning")
    for new in edited:
        table.add_row(str(new.out), f"{new.seconds:.3f}", f"{sum(new.messages.values()):,}", str(len(new.carried)))
    console.print(table)
    for new in edited:
        for span in new.interleaved:
            console.print(f"the originals overlap from {span.start_ns} to {span.end_ns} ns", soft_wrap=True)
        if new.shared:
            console.print(f"{new.shared:,} messages stand in several originals and were taken once", soft_wrap=True)
    for original in edited[0].originals:
        if original.truncated:
            console.print(f"{original.path}: is cut off; it was read up to where it stops", soft_wrap=True)
    damaged = dict.fromkeys((o.path, met) for new in edited for o in new.originals for met in o.damage)
    for path, met in damaged:
        console.print(f"{path}: {met.text}", soft_wrap=True)
    for journal in journals:
        console.print(f"{journal.path}: {journal.acts:,} of {journal.given:,} acts", soft_wrap=True)
