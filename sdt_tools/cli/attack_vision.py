"""``sdt attack vision``: images that are changed imperceptibly, and answered otherwise."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.evaluation.attack_vision import AttackRate, ImageExhibit, VisionAttackSummary
    from sdt_tools.models.vision.loaded import LoadedVisionModel
    from sdt_tools.robustness.image_attacks import ImageAttackConfig


def command(
    models: Annotated[
        list[Path], typer.Argument(metavar="MODEL...", help="Checkpoint folders of vision networks, one or more.")
    ],
    dataset: Annotated[
        Path, typer.Argument(metavar="DATASET", help="Data set of gestures; its validation images are attacked.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to make: tables, attack.png, attack.rrd; of several models, a folder of these for each. "
            "[analysis/attack/<model>, of several analysis/attack]"
        ),
    ] = None,
    epsilon: Annotated[
        list[int] | None,
        typer.Option(min=1, max=255, help="Steps of 8-bit colour that a pixel may move; repeatable. [1 and 2]"),
    ] = None,
    images: Annotated[int, typer.Option(min=3, help="Images that are drawn, a third of each gesture.")] = 120,
    steps: Annotated[int, typer.Option(min=1, help="Steps of projected gradient.")] = 10,
    restarts: Annotated[int, typer.Option(min=1, help="Random starts of projected gradient.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Images that are drawn, and random starts.")] = 0,
    json_output: JsonFlag = False,
) -> None:
    """Change images by a few steps of colour so that they are answered otherwise, disable turned into enable first.

    By the fast gradient sign and by projected gradient; what they find is rounded to 8 bits and judged after that.
    Success is counted over images that are answered rightly as they are. The figure shows the largest --epsilon.
    Several models are attacked on the same images, and stand in one table.
    """
    from sdt_tools.errors import OutputExistsError, UsageError
    from sdt_tools.models.vision.checkpoint import load_vision_checkpoint
    from sdt_tools.robustness.image_attacks import ImageAttackConfig

    loaded = [load_vision_checkpoint(model) for model in models]
    if len({model.name for model in loaded}) < len(loaded):
        raise UsageError("two checkpoints have the same name, by which the results are filed; rename one")
    top = out or Path("analysis") / "attack"
    folders = [top if out and len(loaded) == 1 else top / model.name for model in loaded]
    for folder in folders:
        if folder.exists():
            raise OutputExistsError(folder)
    config = ImageAttackConfig(steps=steps, restarts=restarts, seed=seed)
    epsilons = sorted(set(epsilon or (1, 2)))
    attacked = [
        _attack(model, dataset, epsilons, config, images, folder) for model, folder in zip(loaded, folders, strict=True)
    ]
    if json_output:
        told = [_document(*one, folder) for one, folder in zip(attacked, folders, strict=True)]
        emit(told[0] if len(told) == 1 else {"models": told})
        return
    _show([summary for summary, _ in attacked])
    for (summary, exhibit), folder in zip(attacked, folders, strict=True):
        if not exhibit.succeeded:
            console.print(f"{summary.model}: no disable image was turned into enable; the strongest attempt is shown")
        console.print(f"look at it with: rerun {folder / 'attack.rrd'}", soft_wrap=True)


def _attack(
    model: "LoadedVisionModel",
    dataset: Path,
    epsilons: list[int],
    config: "ImageAttackConfig",
    images: int,
    folder: Path,
) -> "tuple[VisionAttackSummary, ImageExhibit]":
    """Attack one model, and draw what tells it best."""
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.evaluation.attack_vision import attack_vision
    from sdt_tools.robustness.image_figure import attacked_image_figure
    from sdt_tools.training.vision.data import load_vision_data
    from sdt_tools.view.image_attack_view import write_image_attack_rrd

    val = load_vision_data(dataset, model.card.preprocess).val
    with progress_bar(f"attacking {model.name}") as report:
        summary, exhibit = attack_vision(model, val.images_u8, val.labels, epsilons, config, images, folder, report)
    shown = (exhibit.original_u8, exhibit.attacked_u8, exhibit.logits, exhibit.epsilon, exhibit.title)
    attacked_image_figure(*shown, folder / "attack.png")
    write_image_attack_rrd(*shown, folder / "attack.rrd")
    return summary, exhibit


def _document(summary: "VisionAttackSummary", exhibit: "ImageExhibit", folder: Path) -> dict[str, object]:
    files = {"out": str(folder), "figure": str(folder / "attack.png"), "rrd": str(folder / "attack.rrd")}
    rates = [vars(rate) for rate in summary.rates]
    return {**vars(summary), "rates": rates, "exhibit": exhibit.title, "succeeded": exhibit.succeeded, **files}


def _show(summaries: "list[VisionAttackSummary]") -> None:
    for summary in summaries:
        console.print(f"{summary.model} answers {summary.answered_rightly} of {summary.images} images rightly")
    if len(summaries) == 1:
        _show_one(summaries[0])
    else:
        _show_several(summaries)
    console.print("by so many steps of 8-bit colour at most; intervals of 95 %")


def _show_one(summary: "VisionAttackSummary") -> None:
    from rich.table import Table

    table = Table("attack", "by", "from", "into", title="of these are turned", title_justify="left")
    for heading in ("images", "turned", "share", "interval"):
        table.add_column(heading, justify="right", no_wrap=True)
    for rate in summary.rates:
        counts = (str(rate.images), str(rate.succeeded), *_share(rate))
        table.add_row(rate.method.upper(), f"±{rate.epsilon}", rate.source, rate.target, *counts)
    console.print(table)


def _show_several(summaries: "list[VisionAttackSummary]") -> None:
    """A table for each aim, with a row a model and a column an attack."""
    from rich.table import Table

    for aim in dict.fromkeys((rate.source, rate.target) for rate in summaries[0].rates):
        table = Table("model", title=f"{aim[0]} turned into {aim[1]}", title_justify="left")
        rates = [[rate for rate in summary.rates if (rate.source, rate.target) == aim] for summary in summaries]
        for rate in rates[0]:
            table.add_column(f"{rate.method.upper()} ±{rate.epsilon}", justify="right")
        for summary, own in zip(summaries, rates, strict=True):
            table.add_row(summary.model, *("\n".join(_share(rate)) for rate in own))
        console.print(table)


def _share(rate: "AttackRate") -> tuple[str, str]:
    """The share that was turned, and its interval."""
    low, high = rate.wilson
    return (f"{rate.succeeded / rate.images:.0%}" if rate.images else ""), f"{low:.0%} to {high:.0%}"
