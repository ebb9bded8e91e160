"""``sdt errors selftest``: plant errors of known cause and see how well they are found again."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.error_analysis.selftest.run import SelfTest


def command(
    seed: Annotated[int, typer.Option(min=0, help="Seed of all trials.")] = 1000,
    trials: Annotated[
        int, typer.Option(min=1, help="Trials with planted conditions; a fifth as many (whole drives) judge the tags.")
    ] = 100,
    null: Annotated[
        bool,
        typer.Option("--null", help="Also errors without a cause: twice as many trials of each of four kinds."),
    ] = False,
    predictions: Annotated[
        Path | None,
        typer.Option(help="Plant into these labelled predictions, their own errors put right, not synthetic drives."),
    ] = None,
    recordings: Annotated[
        list[Path] | None,
        typer.Option("--recordings", help="The recordings behind --predictions; may be given several times."),
    ] = None,
    model: Annotated[str | None, typer.Option(help="Model, where the predictions are of several.")] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file of options, as for an analysis.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one thread each.")] = 2,
    json_output: JsonFlag = False,
) -> None:
    """Plant errors of known cause and count how well tags and conditions find them again.

    Errors are planted into synthetic drives (40 recordings of about 400 frames, 541 rays), or into your own
    predictions. Conditions hold for 5 to 25 % of the frames, in at least a fifth of the recordings: errors at 80 %
    inside and 2 % outside, with sharp ends and blurred ones in turn. A condition is found when its features, sides and
    names are right; its bounds are right within 10 % of the feature's range (5th to 95th percentile).
    """
    from tempfile import TemporaryDirectory

    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.config import load_config
    from sdt_tools.error_analysis.definitions import ErrorOptions
    from sdt_tools.error_analysis.selftest.material import Material
    from sdt_tools.error_analysis.selftest.run import keep_predictions, run_selftest
    from sdt_tools.errors import UsageError

    options = load_config(ErrorOptions, config)
    if (predictions is None) != (not recordings):
        raise UsageError("--predictions and --recordings go together: errors are planted where the scans are known")
    with TemporaryDirectory(prefix="sdt-selftest-") as folder:
        material = Material()
        if predictions and recordings:
            with progress_bar("reading scans") as progress:
                material = keep_predictions(predictions, recordings, options, Path(folder), model, progress)
        with progress_bar("trials") as progress:
            result = run_selftest(options, seed, trials, null, workers, material, progress)
    if json_output:
        emit(result.document())
    else:
        _show(result)


def _show(result: "SelfTest") -> None:
    from rich.table import Table

    tags = Table("planted", "errors", "precision", "recall", title="tags, of one kind alone and of all together")
    for name, scores in (("alone", result.alone), ("mixed", result.mixed)):
        for kind, score in scores.items():
            found = score.document()
            tags.add_row(f"{kind}, {name}", f"{score.planted:,}", _share(found["precision"]), _share(found["recall"]))
        tags.add_section()
    console.print(tags)
    conditions = Table("ends", "planted", "features right", "bounds right", title="conditions")
    for name, of in (("sharp", result.sharp), ("blurred", result.blurred)):
        conditions.add_row(
            name, str(of.planted), *(_of(right, of.planted) for right in (of.features_right, of.bounds_right))
        )
    console.print(conditions)
    console.print(f"{result.false} false conditions, {result.other} in other words than those planted")
    if result.null:
        null = Table("errors", "trials", "with a condition", title="no cause planted")
        for kind, (trials, false) in result.null.items():
            null.add_row(kind.replace("_", " "), str(trials), _of(false, trials))
        console.print(null)
    console.print(f"seed {result.seed}; {result.seconds:.0f} s")


def _share(value: object) -> str:
    return f"{value:.3f}" if isinstance(value, float) else "-"


def _of(part: int, whole: int) -> str:
    return f"{part} ({part / whole:.0%})" if whole else "-"
