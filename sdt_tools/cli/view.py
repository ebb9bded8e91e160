"""``sdt view``: a recording and what is known of it, in Rerun."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_incomplete


def command(
    recording: Annotated[Path, typer.Argument(metavar="REC", help="Recording (MCAP).")],
    labels: Annotated[Path | None, typer.Option(help="Folder of label journals.")] = None,
    predictions: Annotated[
        list[Path] | None,
        typer.Option(help="Predictions by sdt replay; may be given several times. The first model colours the scans."),
    ] = None,
    tags: Annotated[
        list[Path] | None,
        typer.Option(help="Tags by sdt errors, file or folder; may be given several times."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The .rrd to write; without, beside the recording.")] = None,
    every: Annotated[int, typer.Option(min=1, help="Show one scan in so many.")] = 1,
    open_: Annotated[bool, typer.Option("--open", help="Open it in Rerun's viewer.")] = False,
    json_output: JsonFlag = False,
) -> None:
    """Write scans, camera, truth, labels, predictions and error tags into one .rrd that brings its layout along."""
    from sdt_tools.view.files import write_rrd_from_files

    target = out or recording.with_suffix(".rrd")
    with console.status(f"writing {target.name}"):
        summary = write_rrd_from_files(
            recording, target, labels_dir=labels, predictions=predictions or [], tags=tags or [], every=every
        )
    if open_:
        from sdt_tools.view.viewer import open_window

        open_window([target])
    if json_output:
        told = {
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
    if not open_:
        console.print(f"look at it with: rerun {target}", soft_wrap=True)
