"""``sdt attack``: searches for inputs that are answered with what is forbidden."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli import attack_vision
from sdt_tools.cli.console import JsonFlag, console, emit

app = typer.Typer(no_args_is_help=True, help="Search for inputs that networks answer with what is forbidden.")


@app.callback()
def attack() -> None:
    """Search for inputs that networks answer with what is forbidden."""


app.command("vision")(attack_vision.command)


@app.command("follow")
def follow(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Checkpoint folder.")],
    dataset: Annotated[
        Path | None, typer.Argument(metavar="[DATASET]", help="Data set whose forward scans are attacked too.")
    ] = None,
    level: Annotated[int | None, typer.Option(help="Safety level whose domains are searched.")] = None,
    domains: Annotated[Path | None, typer.Option(metavar="FILE", help="TOML file with domains of your own.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder to make: tables, attack.png, attack.rrd. [analysis/attack/<model>]")
    ] = None,
    restarts: Annotated[int, typer.Option(min=1, help="Searches a domain or scan.")] = 8,
    steps: Annotated[int, typer.Option(min=1, help="Steps of each search.")] = 50,
    near_scans: Annotated[int, typer.Option(min=1, help="Forward scans of DATASET that are attacked.")] = 200,
    radius_m: Annotated[float, typer.Option(help="How far each range of those may move.")] = 0.1,
    ray: Annotated[int, typer.Option(help="Where the object 10 cm ahead stands: 270 is straight ahead.")] = 270,
    seed: Annotated[int, typer.Option(min=0, help="Scans that are chosen and started from.")] = 0,
    json_output: JsonFlag = False,
) -> None:
    """Search for scans in safety domains, and near real scans with an object 10 cm ahead, that are answered forward."""
    from sdt_tools.certify.specification import specification_of
    from sdt_tools.config import parse_config
    from sdt_tools.dataset.load import load_dataset
    from sdt_tools.evaluation.attack_follow import attack_follow
    from sdt_tools.models.checkpoint import load_checkpoint
    from sdt_tools.robustness.attacks import AttackConfig
    from sdt_tools.robustness.figure import attacked_figure
    from sdt_tools.robustness.near_scans import NearScanConfig
    from sdt_tools.view.attack_view import write_attack_rrd

    specification = specification_of(level, domains)
    options = {"centre_ray": "--ray", "radius_m": "--radius-m"}
    near = parse_config(NearScanConfig, {"centre_ray": ray, "radius_m": radius_m}, "the options", options)
    loaded = load_checkpoint(model)
    frames = load_dataset(dataset).val if dataset else None
    folder = out or Path("analysis") / "attack" / loaded.name
    with console.status("attacking"):
        config = AttackConfig(restarts=restarts, steps=steps, seed=seed)
        summary, exhibit = attack_follow(loaded, specification.sets, frames, near, near_scans, config, folder)
        shown = (exhibit.original_m, exhibit.attacked_m, exhibit.logits, exhibit.title)
        attacked_figure(*shown, folder / "attack.png")
        write_attack_rrd(*shown, folder / "attack.rrd")
    files = {"out": str(folder), "figure": str(folder / "attack.png"), "rrd": str(folder / "attack.rrd")}
    if json_output:
        emit({**vars(summary), "specification": specification.name, "exhibit": exhibit.title, **files})
        return
    low, high = summary.violated_wilson
    console.print(
        f"{summary.violated} of {summary.domains} domains of {specification.name} violated ({low:.0%} to {high:.0%})"
    )
    if summary.near_scans:
        low, high = summary.forward_after_wilson
        console.print(
            f"of {summary.near_scans} forward scans with an object 10 cm ahead {summary.forward_before} are answered "
            f"forward as they are, {summary.forward_after} ({low:.0%} to {high:.0%}) within {radius_m:g} m of it"
        )
    if not exhibit.succeeded:
        console.print("no attack succeeded; the strongest attempt is shown")
    console.print(f"look at it with: rerun {folder / 'attack.rrd'}", soft_wrap=True)
