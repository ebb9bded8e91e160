"""``sdt replay``: a model over recordings."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_incomplete


class Every(StrEnum):
    """Which frames are answered."""

    ALL = "all"
    LABELLED = "labelled"


def command(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Checkpoint folder, of a follow or a vision network.")],
    recordings: Annotated[list[Path], typer.Argument(metavar="REC...", help="Recordings to replay.")],
    out: Annotated[Path, typer.Option(help="Predictions file to write (Parquet); a .toml beside it says from what.")],
    labels: Annotated[
        Path | None, typer.Option(help="Folder of label journals; without it predictions have no loss.")
    ] = None,
    every: Annotated[Every, typer.Option(help="Answer all frames, or only those with a label.")] = Every.ALL,
    batch: Annotated[int, typer.Option(min=1, max=4096, help="Frames answered at once, on one thread.")] = 128,
    json_output: JsonFlag = False,
) -> None:
    """Answer every frame of recordings with a model and keep the predictions, with what is known about each frame.

    The frames of a follow network are scans, and their labels motions; those of a vision network are pictures, and
    their labels gestures. Pictures that cannot be decoded are passed over, counted and named.
    """
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.errors import UsageError
    from sdt_tools.models.either import load_either
    from sdt_tools.replay.replay import ReplayConfig, replay

    others = [path for path in recordings if (path / "model.toml").is_file()]
    if others:
        raise UsageError(f"{others[0]}: is a checkpoint too; replay one model at a time, each into a file of its own")
    config = ReplayConfig(frames=every.value, batch=batch)
    loaded = load_either(model)
    with progress_bar("replaying") as progress:
        summary = replay(loaded, recordings, labels, out, config, model, progress)
    if json_output:
        told = {
            "truncated": summary.truncated,
            "unreadable": [vars(one) for one in summary.unreadable],
            "incomplete": [recording.document() for recording in summary.incomplete],
            "frames_per_s": round(summary.frames_per_s),
            "accuracy": summary.accuracy,
        }
        emit(vars(summary) | told)
        return
    console.print(
        f"{summary.frames:,} {summary.kind} of {summary.recordings} recordings answered by {summary.model} "
        f"({summary.frames_per_s:,.0f} a second): {summary.out}",
        soft_wrap=True,
    )
    if summary.accuracy is None:
        console.print("no labels, so no losses" if labels is None else "none of these frames has a label")
    else:
        console.print(f"{summary.labelled:,} labelled, {summary.wrong:,} wrong: accuracy {summary.accuracy:.1%}")
    if summary.without_journal:
        console.print(f"without a label journal: {', '.join(summary.without_journal)}", style="yellow")
    print_incomplete(summary.incomplete)
    for one in summary.unreadable:
        stamps = ", ".join(map(str, one.stamps_ns[:3])) + (" …" if len(one.stamps_ns) > 3 else "")
        console.print(
            f"{one.recording}: {len(one.stamps_ns)} pictures cannot be decoded and were passed over, at {stamps} ns",
            style="yellow",
            soft_wrap=True,
        )
    if summary.labels_without_frame:
        console.print(f"{summary.labels_without_frame} labels lie at stamps without a frame", style="yellow")
