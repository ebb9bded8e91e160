"""``sdt dataset``: data sets from labelled recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_incomplete

if TYPE_CHECKING:
    from sdt_tools.dataset.build import DatasetSummary

app = typer.Typer(no_args_is_help=True, help="Build data sets from labelled recordings.")


@app.callback()
def dataset() -> None:
    """Build data sets from labelled recordings."""


@app.command("build")
def build(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC...", help="Labelled recordings.")],
    out: Annotated[Path, typer.Option(help="Folder to make, with frames.parquet and manifest.toml.")],
    validation: Annotated[
        list[Path] | None,
        typer.Option(metavar="REC", help="A recording to validate with, in place of a share of REC...; repeatable."),
    ] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file; the options below go before it.")] = None,
    kind: Annotated[
        str | None, typer.Option(help="motion, labels of scans, or gesture, labels of pictures. [motion]")
    ] = None,
    labels: Annotated[Path, typer.Option(help="Folder of the journals, <recording>.<kind>.csv.")] = Path("labels"),
    train_frames: Annotated[int | None, typer.Option(help="Training frames in all; without, as many as fit.")] = None,
    val_frames: Annotated[int | None, typer.Option(help="Validation frames in all; without, as many as fit.")] = None,
    val_share: Annotated[float | None, typer.Option(help="Share of the recordings kept for validation. [0.2]")] = None,
    balanced: Annotated[
        bool | None, typer.Option("--balanced/--as-recorded", help="Equal numbers of each class, or as they come.")
    ] = None,
    per_recording_cap: Annotated[int | None, typer.Option(help="At most so many frames of one recording. [40]")] = None,
    spacing_s: Annotated[float | None, typer.Option(help="Least time between frames of one recording. [0.4]")] = None,
    tolerance_ms: Annotated[float | None, typer.Option(help="Most time between a label and its frame. [10]")] = None,
    seed: Annotated[int | None, typer.Option(help="Chooses the recordings that validate, and frames. [0]")] = None,
    conflict_level: Annotated[
        int | None, typer.Option(help="Level of the safety domains that labels must not contradict, 0 for none. [3]")
    ] = None,
    allow_conflicts: Annotated[
        bool | None,
        typer.Option("--allow-conflicts", help="List such labels in the manifest, do not refuse them."),
    ] = None,
    interventions: Annotated[
        bool,
        typer.Option("--interventions", help="Only frames at which a person took over, labelled by that motion."),
    ] = False,
    with_interventions: Annotated[
        bool, typer.Option("--with-interventions", help="Such frames beside the labelled ones.")
    ] = False,
    json_output: JsonFlag = False,
) -> None:
    """Join scans or pictures with labels, choose frames by the rules, split them by recording, write them down.

    A manifest beside the frames says what they were made from. Pictures that no decoder reads are left out and named.
    """
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.config import parse_config, read_toml
    from sdt_tools.dataset.build import build_dataset
    from sdt_tools.dataset.config import DatasetConfig
    from sdt_tools.errors import UsageError
    from sdt_tools.robustness.conflicts import conflict_check

    options = {
        "kind": kind,
        "train_frames": train_frames,
        "val_frames": val_frames,
        "val_share": val_share,
        "balanced": balanced,
        "per_recording_cap": per_recording_cap,
        "spacing_s": spacing_s,
        "tolerance_ms": tolerance_ms,
        "seed": seed,
        "conflict_level": conflict_level,
        "allow_conflicts": allow_conflicts,
        "interventions": "only" if interventions else "also" if with_interventions else None,
    }
    if interventions and with_interventions:
        raise UsageError("--interventions and --with-interventions: choose one, such frames alone or beside others")
    if validation and val_share is not None:
        raise UsageError("--validation and --val-share: choose one, recordings to validate with or a share of them")
    given = {name: value for name, value in options.items() if value is not None}
    file_values = {} if config is None else read_toml(config)
    settings = parse_config(DatasetConfig, file_values, str(config))
    settings = parse_config(DatasetConfig, file_values | given, "the options", {name: _option(name) for name in given})
    with progress_bar("reading recordings") as report:
        check = conflict_check(settings.conflict_level)
        summary = build_dataset(recordings, labels, settings, out, check, report, validation or ())
    if json_output:
        emit(_document(summary))
    else:
        _show(summary)


def _option(setting: str) -> str:
    return f"--{setting.replace('_', '-')}"


def _document(summary: "DatasetSummary") -> dict[str, object]:
    return {
        "out": str(summary.folder),
        "hash": summary.hash,
        "recordings": summary.recordings,
        "train_frames": summary.train_frames,
        "val_frames": summary.val_frames,
        "counts": summary.counts,
        "conflicts": summary.conflicts,
        "interventions": summary.interventions,
        "unmatched_labels": summary.unmatched_labels,
        "unreadable_pictures": {name: list(stamps_ns) for name, stamps_ns in summary.unreadable.items()},
        "disputed_stamps": summary.disputed_stamps,
        "broken_lines": summary.broken_lines,
        "truncated": any(recording.truncated for recording in summary.incomplete),
        "incomplete": [recording.document() for recording in summary.incomplete],
    }


def _show(summary: "DatasetSummary") -> None:
    from rich.table import Table

    table = Table("class", *summary.counts)
    for name in summary.counts["train"]:
        table.add_row(name, *(f"{by_class[name]:,}" for by_class in summary.counts.values()))
    table.add_row("all", f"{summary.train_frames:,}", f"{summary.val_frames:,}")
    console.print(table)
    notes = {
        "motions that people drove after taking over, among the labels": summary.interventions,
        "frames in a safety domain with a label that it forbids, listed in the manifest": summary.conflicts,
        "labels without a scan or readable picture near enough": summary.unmatched_labels,
        "pictures that no decoder reads, left out and named in the manifest": sum(
            map(len, summary.unreadable.values())
        ),
        "stamps left out because humans disagree": summary.disputed_stamps,
        "broken lines in journals, which count for nothing": summary.broken_lines,
    }
    for what, count in notes.items():
        if count:
            console.print(f"{what}: {count:,}", soft_wrap=True)
    print_incomplete(summary.incomplete)
    console.print(f"{summary.folder} from {summary.recordings} recordings, hash {summary.hash[:16]}", soft_wrap=True)
