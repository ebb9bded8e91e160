"""``sdt domains``: what a safety level, or a file of domains, asks for."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit


def command(
    level: Annotated[int | None, typer.Option(help="Safety level, 1 to 4.")] = None,
    domains: Annotated[Path | None, typer.Option(metavar="FILE", help="TOML file with domains of your own.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Draw a domain of each set; it must not exist.")
    ] = None,
    json_output: JsonFlag = False,
) -> None:
    """List safety domains, and draw them: the paper's levels, or a file of your own before it is trained on."""
    from sdt_tools.certify.specification import specification_of
    from sdt_tools.cli.pictures import check_picture
    from sdt_tools.robustness.figure import domains_figure

    specification = specification_of(level, domains)
    if out is not None:
        check_picture(out, "--out")
        out.parent.mkdir(parents=True, exist_ok=True)
        domains_figure(specification.sets, out)
    rows = [
        {
            "name": boxes.name,
            "domains": len(boxes),
            "rays": [int(boxes.rays.min()), int(boxes.rays.max())],
            "least_upper_m": float(boxes.upper_m.min()),
            "most_upper_m": float(boxes.upper_m.max()),
            "allowed": [motion.label for motion in sorted(boxes.allowed)],
        }
        for boxes in specification.sets
    ]
    if json_output:
        emit({"specification": specification.name, "sets": rows, "figure": str(out) if out else None})
        return
    from rich.table import Table

    table = Table("set", "domains", "rays", "near, far", "allowed")
    for row in rows:
        first, last = row["rays"] if isinstance(row["rays"], list) else (0, 0)
        allowed = ", ".join(str(label) for label in row["allowed"]) if isinstance(row["allowed"], list) else ""
        near = f"{row['least_upper_m']:g} m, {row['most_upper_m']:g} m"
        table.add_row(str(row["name"]), str(row["domains"]), f"{first} to {last}", near, allowed)
    console.print(table)
    if out is not None:
        console.print(f"drawn: {out}")
