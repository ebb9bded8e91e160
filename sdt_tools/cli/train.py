"""``sdt train``: networks from data sets."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli import train_vision
from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sdt_tools.training.follow import FollowTrainingConfig, TrainingSummary

app = typer.Typer(no_args_is_help=True, help="Train networks on data sets.")

_OF_DOMAINS = {"safety.inner": "--inner", "safety.weight": "--lambda", "safety.delta": "--delta"}
"""Options that say how a network is held to safety domains, by the setting that each stands for."""
_OPTIONS = _OF_DOMAINS | {
    "arch": "--arch",
    "seed": "--seed",
    "specification.level": "--level",
    "specification.domains": "--domains",
    "specification.epsilon_m": "--epsilon-m",
    "loop.epochs": "--epochs",
}
"""All options that stand for a setting."""


@app.callback()
def train() -> None:
    """Train networks on data sets."""


app.command("vision")(train_vision.command)


@app.command("follow")
def follow(
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="Folder that 'sdt dataset build' made.")],
    out: Annotated[Path, typer.Option(help="Checkpoint folder to make: weights, model.toml, learning curve.")],
    level: Annotated[
        int | None, typer.Option(min=0, max=4, help="Safety level: 0 asks for nothing, 1 to 3 are the paper's. [0]")
    ] = None,
    domains: Annotated[Path | None, typer.Option(help="Safety domains of your own, a TOML file.")] = None,
    epsilon_m: Annotated[
        float | None, typer.Option(help="Adversarial training: labels hold within so many metres of every range.")
    ] = None,
    arch: Annotated[str | None, typer.Option(help="plain, the paper's network, or gate. [plain]")] = None,
    inner: Annotated[
        str | None, typer.Option(help="Worst case by ibp, bounded (certified), or pgd, searched (empirical). [ibp]")
    ] = None,
    weight: Annotated[
        float | None, typer.Option("--lambda", help="Weight of the safety domains, the paper's λ.")
    ] = None,
    delta: Annotated[
        float | None, typer.Option(help="Safety bound in nats at which training may end, the paper's δ. [0.2]")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="TOML file, instead of the settings known to work; the options go before it.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="First weights, order of frames, variations. [0]")] = None,
    epochs: Annotated[int | None, typer.Option(help="Passes over the training frames. [80]")] = None,
    json_output: JsonFlag = False,
) -> None:
    """Train the follow network (541 ranges to seven motions), with safety domains if asked.

    Interrupted with Ctrl-C, the same command goes on where it was.
    """
    from sdt_tools.cli.progress import epoch_bar, says_where_to_go_on
    from sdt_tools.training.follow import train_follow
    from sdt_tools.training.record import EpochRecord

    asked = {
        "arch": arch,
        "seed": seed,
        "specification.level": level,
        "specification.domains": domains,
        "specification.epsilon_m": epsilon_m,
        "safety.inner": inner,
        "safety.weight": weight,
        "safety.delta": delta,
        "loop.epochs": epochs,
    }
    settings = _settings(config, {name: value for name, value in asked.items() if value is not None})
    with epoch_bar(settings.loop.epochs) as bar:

        def show(record: EpochRecord, _total: int) -> None:
            text = f"loss {record.train_loss:.3f}  validation {record.val_accuracy:.1%}"
            if record.bound is not None:
                text += f"  bound {record.bound:.2g}  certified {record.certified_share:.0%}"
            bar(record.epoch, text)

        with says_where_to_go_on(out):
            summary = train_follow(dataset, settings, out, show)
    if json_output:
        emit(_document(summary))
    else:
        _show(summary)
    if summary.satisfied is False:
        _refuse_unsatisfied(summary, settings)


def _settings(config: Path | None, asked: "Mapping[str, object]") -> "FollowTrainingConfig":
    """What a file or the recipe for the specification and architecture asked for says, and then the options."""
    from sdt_tools.config import load_config, parse_config
    from sdt_tools.errors import UsageError
    from sdt_tools.training.follow import FollowTrainingConfig
    from sdt_tools.training.recipes import recipe_for
    from sdt_tools.training.specification import SpecificationConfig

    if config is not None:
        base = load_config(FollowTrainingConfig, config)
    else:
        prefix = "specification."
        wanted = {name.removeprefix(prefix): value for name, value in asked.items() if name.startswith(prefix)}
        options = {name.removeprefix(prefix): option for name, option in _OPTIONS.items() if name.startswith(prefix)}
        specification = parse_config(SpecificationConfig, wanted, "the options", options)
        base = recipe_for(specification, str(asked.get("arch", "plain")), "--arch")
    values = base.model_dump(mode="json", exclude_none=True)
    for name, value in asked.items():
        *tables, key = name.split(".")
        table = values
        for step in tables:
            table = table[step]
        table[key] = value
    given = {name: option for name, option in _OPTIONS.items() if name in asked}
    settings = parse_config(FollowTrainingConfig, values, "the options", given)
    idle = [option for name, option in _OF_DOMAINS.items() if name in asked]
    if idle and settings.specification.empty:
        raise UsageError(
            f"{', '.join(idle)}: nothing without safety domains; add --level or --domains, or leave it out"
        )
    return settings


def _document(summary: "TrainingSummary") -> dict[str, object]:
    return {
        "checkpoint": str(summary.out),
        "epochs": summary.last.epoch,
        "seconds": round(summary.seconds, 1),
        "satisfied": summary.satisfied,
        "bound": summary.last.bound,
        "certified_share": summary.last.certified_share,
        **summary.train.as_metrics("train"),
        **summary.val.as_metrics("val"),
    }


def _show(summary: "TrainingSummary") -> None:
    from rich.table import Table

    console.print(f"trained {summary.last.epoch} epochs in {summary.seconds:.0f} s")
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
    if summary.last.bound is not None:
        console.print(
            f"largest worst-case loss of a domain: {summary.last.bound:.3g} nats; interval bounds certify "
            f"{summary.last.certified_share:.1%} of the domains"
        )
    console.print(f"checkpoint with curve.png: {summary.out}")


def _refuse_unsatisfied(summary: "TrainingSummary", settings: "FollowTrainingConfig") -> None:
    from sdt_tools.errors import RunError

    raise RunError(
        f"{summary.out}: after {summary.last.epoch} epochs the safety bound is {summary.last.bound:.3g} nats, above "
        f"delta = {settings.safety.delta:g}; the checkpoint is kept; try a larger --delta, --lambda or --epochs"
    )
