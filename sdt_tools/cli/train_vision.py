"""``sdt train vision``: the network that sees gestures, from a data set of pictures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sdt_tools.training.vision.config import VisionTrainingConfig
    from sdt_tools.training.vision.train import VisionSummary

_OPTIONS: Final = {
    "adversarial.epsilon": "--epsilon",
    "weights": "--weights",
    "last_blocks": "--last-blocks",
    "epochs": "--epochs",
    "seed": "--seed",
    "preprocess.width": "--width",
    "preprocess.height": "--height",
}
"""Options that stand for a setting."""


def command(
    dataset: Annotated[
        Path, typer.Argument(metavar="DATASET", help="Folder that 'sdt dataset build --kind gesture' made.")
    ],
    out: Annotated[Path, typer.Option(help="Checkpoint folder to make: weights, model.toml, learning curve.")],
    epsilon: Annotated[
        int | None,
        typer.Option(
            min=0, max=255, help="Adversarial training: steps of 8-bit colour that FGSM may move; 0 is plain. [0]"
        ),
    ] = None,
    backbone: Annotated[
        str | None, typer.Option(help="lite0 (EfficientNet-Lite0) or resnet50, the paper's. [lite0]")
    ] = None,
    weights: Annotated[
        Path | None,
        typer.Option(help="ImageNet weights: a file or a folder with model.safetensors. [those on this machine]"),
    ] = None,
    last_blocks: Annotated[
        int | None, typer.Option(min=0, help="Blocks before the classifier that are trained with it; 0 is it alone.")
    ] = None,
    width: Annotated[int | None, typer.Option(help="Width in pixels that pictures are resized to. [256]")] = None,
    height: Annotated[int | None, typer.Option(help="Height in pixels that pictures are resized to. [192]")] = None,
    config: Annotated[
        Path | None, typer.Option(help="TOML file, instead of the settings known to work; the options go before it.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Classifier's first weights, order and variations. [0]")] = None,
    epochs: Annotated[int | None, typer.Option(help="Passes over the training images.")] = None,
    json_output: JsonFlag = False,
) -> None:
    """Fine-tune the last layers of the vision network (pictures to idle, enable, disable), adversarially if asked.

    Nothing is downloaded. Interrupted with Ctrl-C, the same command goes on where it was.
    """
    from sdt_tools.cli.progress import epoch_bar, says_where_to_go_on
    from sdt_tools.training.vision.data import load_vision_data
    from sdt_tools.training.vision.train import train_vision

    asked = {
        "adversarial.epsilon": epsilon,
        "weights": weights,
        "last_blocks": last_blocks,
        "epochs": epochs,
        "seed": seed,
        "preprocess.width": width,
        "preprocess.height": height,
    }
    settings = _settings(config, backbone, {name: value for name, value in asked.items() if value is not None})
    data = load_vision_data(dataset, settings.preprocess)
    with epoch_bar(settings.epochs) as show, says_where_to_go_on(out):
        summary = train_vision(
            data,
            settings,
            out,
            lambda record, _: show(
                record.epoch,
                f"ε {record.epsilon}  loss {record.train_loss:.3f}  validation {record.val_accuracy:.1%}",
            ),
        )
    if json_output:
        emit(_document(summary))
    else:
        _show(summary)


def _settings(config: Path | None, backbone: str | None, asked: "Mapping[str, object]") -> "VisionTrainingConfig":
    """What a file or the recipe for the backbone and ε says, and then the options."""
    from sdt_tools.config import load_config, parse_config
    from sdt_tools.errors import UsageError
    from sdt_tools.training.vision.config import VisionTrainingConfig, vision_recipe

    if config is not None and backbone is not None:
        raise UsageError(f"--backbone: {config} says already what the network is; leave one of them out")
    epsilon, epochs = asked.get("adversarial.epsilon", 0), asked.get("epochs")
    assert isinstance(epsilon, int)
    assert epochs is None or isinstance(epochs, int)
    base = load_config(VisionTrainingConfig, config) if config else vision_recipe(backbone or "lite0", epsilon, epochs)
    values = base.model_dump(mode="json", exclude_none=True)
    for name, value in asked.items():
        *tables, key = name.split(".")
        table = values
        for step in tables:
            table = table[step]
        table[key] = value
    given = {name: option for name, option in _OPTIONS.items() if name in asked}
    return parse_config(VisionTrainingConfig, values, "the options", given)


def _document(summary: "VisionSummary") -> dict[str, object]:
    return {
        "checkpoint": str(summary.out),
        "epochs": summary.epochs,
        "seconds": round(summary.seconds, 1),
        "epsilon": summary.epsilon,
        **summary.attacked_train.as_metrics("adversarial_train"),
        **summary.train.as_metrics("train"),
        **summary.val.as_metrics("val"),
    }


def _show(summary: "VisionSummary") -> None:
    from rich.table import Table

    console.print(f"trained {summary.epochs} epochs in {summary.seconds:.0f} s")
    table = Table()
    for heading in ("", "training, attacked", "training", "validation"):
        table.add_column(heading, justify="right" if heading else "left")
    scores = (summary.attacked_train, summary.train, summary.val)
    table.add_row("images", *(str(score.frames) for score in scores))
    table.add_row("accuracy", *(f"{score.accuracy:.1%}" for score in scores), end_section=True)
    for label in summary.val.recall:
        table.add_row(f"recall of {label}", *(f"{score.recall[label]:.1%}" for score in scores))
    console.print(table)
    console.print(f"attacked is by the fast gradient sign at ε = {summary.epsilon} steps of 8-bit colour")
    console.print(f"checkpoint with curve.png: {summary.out}")
