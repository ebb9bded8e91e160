"""``sdt attack vision``: images that are changed imperceptibly, and answered otherwise."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.evaluation.attack_vision import VisionAttackSummary


def command(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Checkpoint folder of a vision network.")],
    dataset: Annotated[
        Path, typer.Argument(metavar="DATASET", help="Data set of gestures; its validation images are attacked.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder to make: tables, attack.png, attack.rrd. [analysis/attack/<model>]")
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
    """
    from sdt_tools.cli.progress import progress_bar
    from sdt_tools.evaluation.attack_vision import attack_vision
    from sdt_tools.models.vision.checkpoint import load_vision_checkpoint
    from sdt_tools.robustness.image_attacks import ImageAttackConfig
    from sdt_tools.robustness.image_figure import attacked_image_figure
    from sdt_tools.training.vision.data import load_vision_data
    from sdt_tools.view.image_attack_view import write_image_attack_rrd

    loaded = load_vision_checkpoint(model)
    val = load_vision_data(dataset, loaded.card.preprocess).val
    folder = out or Path("analysis") / "attack" / loaded.name
    config = ImageAttackConfig(steps=steps, restarts=restarts, seed=seed)
    with progress_bar("attacking") as report:
        summary, exhibit = attack_vision(
            loaded, val.images_u8, val.labels, sorted(set(epsilon or (1, 2))), config, images, folder, report
        )
    shown = (exhibit.original_u8, exhibit.attacked_u8, exhibit.logits, exhibit.epsilon, exhibit.title)
    attacked_image_figure(*shown, folder / "attack.png")
    write_image_attack_rrd(*shown, folder / "attack.rrd")
    if json_output:
        files = {"out": str(folder), "figure": str(folder / "attack.png"), "rrd": str(folder / "attack.rrd")}
        rates = [vars(rate) for rate in summary.rates]
        emit({**vars(summary), "rates": rates, "exhibit": exhibit.title, "succeeded": exhibit.succeeded, **files})
        return
    _show(summary)
    if not exhibit.succeeded:
        console.print("no disable image was turned into enable; the strongest attempt is shown")
    console.print(f"look at it with: rerun {folder / 'attack.rrd'}", soft_wrap=True)


def _show(summary: "VisionAttackSummary") -> None:
    from rich.table import Table

    console.print(
        f"{summary.model} answers {summary.answered_rightly} of {summary.images} images rightly; of these are turned:"
    )
    table = Table("attack", "by", "from", "into")
    for heading in ("images", "turned", "share", "interval"):
        table.add_column(heading, justify="right", no_wrap=True)
    for rate in summary.rates:
        low, high = rate.wilson
        table.add_row(
            rate.method.upper(),
            f"±{rate.epsilon}",
            rate.source,
            rate.target,
            str(rate.images),
            str(rate.succeeded),
            f"{rate.succeeded / rate.images:.0%}" if rate.images else "",
            f"{low:.0%} to {high:.0%}",
        )
    console.print(table)
    console.print("by so many steps of 8-bit colour at most; intervals of 95 %")
