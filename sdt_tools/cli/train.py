"""``sdt train``: networks from data sets."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.training.follow import FollowTrainingConfig, TrainingSummary

app = typer.Typer(no_args_is_help=True, help="Train networks on data sets.")


@app.callback()
def train() -> None:
    """Train networks on data sets."""


@app.command("follow")
def follow(
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="Folder that 'sdt dataset build' made.")],
    out: Annotated[Path, typer.Option(help="Checkpoint folder to make: weights, model.toml, learning curve.")],
    config: Annotated[Path | None, typer.Option(help="TOML file; the options below go before it.")] = None,
    seed: Annotated[int | None, typer.Option(help="First weights, order of frames, variations. [0]")] = None,
    epochs: Annotated[int | None, typer.Option(help="Passes over the training frames. [80]")] = None,
    json_output: JsonFlag = False,
) -> None:
    """Train the follow network (541 ranges to seven motions); Ctrl-C keeps the best epoch so far."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from sdt_tools.training.follow import train_follow
    from sdt_tools.training.loop import EpochRecord

    settings = _settings(config, seed, epochs)
    columns = (
        TextColumn("epoch"),
        MofNCompleteColumn(),
        BarColumn(),
        TextColumn("{task.description}"),
        TimeElapsedColumn(),
        TextColumn("eta"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=settings.loop.epochs)

        def show(record: EpochRecord, total: int) -> None:
            text = f"loss {record.train_loss:.3f}  validation {record.val_accuracy:.1%}"
            bar.update(task, completed=record.epoch, total=total, description=text)

        summary = train_follow(dataset, settings, out, show)
    if json_output:
        emit(_document(summary))
    else:
        _show(summary)


def _settings(config: Path | None, seed: int | None, epochs: int | None) -> "FollowTrainingConfig":
    from sdt_tools.config import load_config, parse_config
    from sdt_tools.training.follow import FollowTrainingConfig

    values = load_config(FollowTrainingConfig, config).model_dump(mode="json")
    if seed is not None:
        values["seed"] = seed
    if epochs is not None:
        values["loop"]["epochs"] = epochs
    return parse_config(FollowTrainingConfig, values, "the options")


def _document(summary: "TrainingSummary") -> dict[str, object]:
    return {
        "checkpoint": str(summary.out),
        "epochs": summary.epochs,
        "kept_epoch": summary.kept_epoch,
        "interrupted": summary.interrupted,
        "seconds": round(summary.seconds, 1),
        **summary.train.as_metrics("train"),
        **summary.val.as_metrics("val"),
    }


def _show(summary: "TrainingSummary") -> None:
    from rich.table import Table

    ended = "interrupted after" if summary.interrupted else "trained"
    console.print(
        f"{ended} {summary.epochs} epochs in {summary.seconds:.0f} s; weights of epoch {summary.kept_epoch} kept"
    )
    table = Table()
    for heading in ("", "training", "validation"):
        table.add_column(heading, justify="right" if heading else "left")
    train, val = summary.train, summary.val
    table.add_row("frames", str(train.frames), str(val.frames))
    table.add_row("accuracy", f"{train.accuracy:.1%}", f"{val.accuracy:.1%}")
    table.add_row("forward recall", f"{train.forward_recall:.1%}", f"{val.forward_recall:.1%}", end_section=True)
    for label, share in train.recall.items():
        table.add_row(f"recall of {label}", f"{share:.1%}", f"{val.recall[label]:.1%}")
    console.print(table)
    console.print(f"checkpoint with curve.png: {summary.out}")
