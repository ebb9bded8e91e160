"""``sdt errors suspects``: labels that are probably wrong."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit


def command(
    out: Annotated[Path, typer.Option(help="File to write, .csv or .parquet, for the labelling tool.")],
    dataset: Annotated[
        Path | None, typer.Argument(metavar="[DATASET]", help="Data set whose labels are questioned.")
    ] = None,
    recordings: Annotated[
        list[Path] | None, typer.Option(help="Labelled recording, in place of a data set; may be given several times.")
    ] = None,
    labels: Annotated[Path, typer.Option(help="With --recordings: folder of their journals.")] = Path("labels"),
    predictions: Annotated[
        list[Path] | None,
        typer.Option(
            help="Predictions of a network that did not learn from these recordings, in place of networks trained for "
            "the purpose; may be given several times."
        ),
    ] = None,
    model: Annotated[str | None, typer.Option(help="Model, where the predictions are of several.")] = None,
    folds: Annotated[int | None, typer.Option(help="Parts that the recordings are split into. [5]")] = None,
    epochs: Annotated[
        int | None, typer.Option(help="Epochs that the network of each fold is trained for. [30]")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Deals out the folds, begins the networks. [0]")] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file of options; those above go before it.")] = None,
    json_output: JsonFlag = False,
) -> None:
    """List frames whose label is probably wrong.

    Networks are trained on all recordings but those that they then answer; where they contradict a label with more
    confidence than is usual for its class (cleanlab's confident learning), it is suspect. Frames between two classes
    are among them: people decide.
    """
    from sdt_tools.cli.progress import stage_progress
    from sdt_tools.config import load_config, parse_config
    from sdt_tools.error_analysis.suspects.options import SuspectOptions
    from sdt_tools.error_analysis.suspects.run import LabelSource, write_suspect_labels

    values = load_config(SuspectOptions, config).model_dump(mode="json", exclude_none=True)
    values |= {name: value for name, value in (("folds", folds), ("seed", seed)) if value is not None}
    if epochs is not None:
        values["training"]["loop"]["epochs"] = epochs
    options = parse_config(SuspectOptions, values, "the options")
    source = LabelSource(dataset, recordings or [], labels, predictions or [], model)
    with stage_progress() as progress:
        report = write_suspect_labels(source, options, out, progress)
    if json_output:
        emit({**report.document(), "out": str(out)})
        return
    from rich.table import Table

    console.print(
        f"{len(report.suspects):,} of {report.frames:,} labels of {report.recordings} recordings are suspect; networks "
        f"that did not see a recording agree with {report.agreement:.1%} of its labels"
    )
    worst = Table("recording", "stamp_ns", "label", "rather", "score")
    for row in report.suspects.head(10).iter_rows(named=True):
        worst.add_row(row["recording"], str(row["stamp_ns"]), row["label"], row["suggested"], f"{row['score']:.3f}")
    if len(report.suspects):
        console.print(worst)
    console.print(f"written to {out}", soft_wrap=True)
