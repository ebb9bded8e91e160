"""``sdt view``: a recording and what is known of it, in Rerun."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_incomplete

if TYPE_CHECKING:
    from sdt_tools.view.log import ViewSummary

LISTED = 20
"""Errors that are listed on the terminal; --json and the view have all."""


def command(
    recording: Annotated[Path, typer.Argument(metavar="REC", help="Recording (MCAP).")],
    labels: Annotated[
        Path | None, typer.Option(help="Folder of label journals; without, the labels that predictions carry.")
    ] = None,
    predictions: Annotated[
        list[Path] | None,
        typer.Option(
            help="Predictions by sdt replay; may be given several times. The first follow network colours the scans, "
            "and the answers of vision networks stand in the pictures."
        ),
    ] = None,
    errors: Annotated[
        list[Path] | None,
        typer.Option(
            help="Folder that sdt errors wrote, or the tags in it; may be given several times. Its errors are listed, "
            "and the timeline 'error' steps from one to the next."
        ),
    ] = None,
    tag: Annotated[
        list[str] | None,
        typer.Option(
            help="Step through the errors of this tag alone, such as transient, beginning at the first; may be given "
            "several times."
        ),
    ] = None,
    at: Annotated[
        int | None, typer.Option(metavar="STAMP_NS", help="With --open: begin at this stamp, in nanoseconds.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The .rrd to write; without, beside the recording, with --open in a folder that the system clears."
        ),
    ] = None,
    every: Annotated[int, typer.Option(min=1, help="Show one scan in so many.")] = 1,
    open_: Annotated[bool, typer.Option("--open", help="Open it in Rerun's viewer.")] = False,
    json_output: JsonFlag = False,
) -> None:
    """Write scans, camera, truth, labels, predictions and error tags into one .rrd that brings its layout along."""
    from sdt_tools.errors import UsageError
    from sdt_tools.view.files import write_rrd_from_files

    if tag and not errors:
        raise UsageError("--tag chooses among the errors of --errors; name the folder that `sdt errors` wrote")
    if at is not None and not open_:
        raise UsageError("--at says where the viewer begins; add --open")
    target = out or _place(recording, open_)
    with console.status(f"writing {target.name}"):
        summary = write_rrd_from_files(
            recording,
            target,
            labels_dir=labels,
            predictions=predictions or [],
            errors=errors or [],
            step_tags=tag or [],
            every=every,
        )
    if open_:
        _open(target, summary, at)
    if json_output:
        told = {
            "errors": [vars(step) for step in summary.errors],
            "truncated": summary.truncated,
            "incomplete": None if summary.incomplete is None else summary.incomplete.document(),
            "size_bytes": target.stat().st_size,
        }
        emit(vars(summary) | told)
        return
    models = f", models: {', '.join(summary.models)}" if summary.models else ""
    console.print(
        f"{target}: {summary.scans_shown:,} of {summary.scans:,} scans, {summary.images:,} images{models} "
        f"({target.stat().st_size / 1e6:.1f} MB in {summary.seconds:.1f} s)",
        soft_wrap=True,
    )
    if summary.incomplete is not None:
        print_incomplete([summary.incomplete])
    if errors:
        _list_errors(summary, " or ".join(tag or []))
    if not open_:
        console.print(f"look at it with: rerun {target}", soft_wrap=True)


def _place(recording: Path, opened: bool) -> Path:
    """Where the .rrd goes if nobody says: what is only looked at leaves nothing beside the recording."""
    if not opened:
        return recording.with_suffix(".rrd")
    return Path(tempfile.mkdtemp(prefix="sdt-view-")) / f"{recording.stem}.rrd"


def _open(target: Path, summary: "ViewSummary", at: int | None) -> None:
    """Open the viewer, at the error of that stamp, or at the stamp itself."""
    from sdt_tools.view.viewer import go_to, open_window

    port = open_window([target])
    if at is not None:
        step = next((number for number, error in enumerate(summary.errors) if error.stamp_ns == at), None)
        go_to(port, target, time_ns=at, error=step)


def _list_errors(summary: "ViewSummary", tags: str) -> None:
    """The errors to step through, and where there are more."""
    kind = f"{tags} errors" if tags else "errors"
    if summary.errors:
        from rich.table import Table

        table = Table("error", "stamp_ns", "model", "tag", "says", "label", padding=(0, 1, 0, 0), pad_edge=False)
        for column in table.columns:
            column.overflow, column.no_wrap = "fold", column.header in {"stamp_ns", "tag"}
        for number, step in enumerate(summary.errors[:LISTED]):
            words = (step.model, step.tag, step.predicted, step.label)
            table.add_row(str(number), str(step.stamp_ns), *words)
        console.print(table)
        if len(summary.errors) > LISTED:
            console.print(f"and {len(summary.errors) - LISTED:,} more {kind}")
    else:
        console.print(f"no {kind} in this recording")
    others = list(summary.errors_elsewhere.items())
    if others:
        named = ", ".join(f"{name} ({count:,})" for name, count in others[:5])
        more = f", and {len(others) - 5} more recordings" if len(others) > 5 else ""
        console.print(f"{kind} elsewhere: {named}{more}", soft_wrap=True)
