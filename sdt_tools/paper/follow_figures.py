"""The pictures of the follow study."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import polars as pl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from sdt_tools.evaluation.figure import scenarios_figure
from sdt_tools.paper.follow_tables import FollowTables, level_rows, scenario_counts, sweep_rows
from sdt_tools.paper.printed import LEVELS
from sdt_tools.scene.scenario import STANDARD_FOLLOW

_LEVEL_COLOURS: Final = {1: "#2a9d8f", 2: "#1f6feb", 3: "#d1495b"}
_PAPER: Final = "#adb5bd"


def scenarios_overview(tables: FollowTables, families: Mapping[str, str], out: Path) -> None:
    """Each scenario with the driven paths of all networks in the first seed's worlds: a row a family."""
    by_family = [table.with_columns(pl.col("family").alias("model")) for table in (tables.runs, tables.traces)]
    runs, traces = by_family
    drawn = {family: title for family, title in families.items() if family in set(runs["family"])}
    scenarios_figure(runs, traces, STANDARD_FOLLOW, drawn, min(runs["seed"].to_list()), out)


def sweep_figure(tables: FollowTables, out: Path) -> None:
    """Validation accuracy over λ, a line a level."""
    rows = sweep_rows(tables)
    figure = Figure(figsize=(6.5, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for place, (level, colour) in enumerate(_LEVEL_COLOURS.items()):
        mine = [row for row in rows if row["level"] == level]
        weights, middle = [row["weight"] for row in mine], [row["val_accuracy"][1] for row in mine]
        axes.plot(weights, middle, "o-", color=colour, label=f"level {level}")
        axes.vlines(
            weights, [r["val_accuracy"][0] for r in mine], [r["val_accuracy"][2] for r in mine], color=colour, alpha=0.5
        )
        for row in mine:
            note = f"{row['least_certified']}"
            at, offset = (row["weight"], row["val_accuracy"][1]), (5, 12 - 10 * place)
            axes.annotate(note, at, offset, textcoords="offset points", fontsize=7, color=colour)
    axes.set(xscale="log", xlabel="λ", ylabel="validation accuracy", ylim=(0.0, 1.0))
    axes.set_title("Strictness and accuracy; numbers are certified domains of 240 in the worst network", fontsize=9)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    axes.grid(alpha=0.25)
    axes.legend(frameon=False)
    figure.savefig(out, dpi=110)


def margins_overview(tables: FollowTables, families: Mapping[str, str], out: Path) -> None:
    """What each family reaches on validation frames and in closed loop, the paper's figures beside it."""
    rows = level_rows(tables, list(families))
    counts = scenario_counts(tables, list(families))
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    accuracy, driving = figure.subplots(1, 2, sharey=True)
    for place, row in enumerate(rows):
        low, middle, high = row["val_accuracy"]
        accuracy.errorbar(middle, place, xerr=[[middle - low], [high - middle]], fmt="o", color="#1f6feb", capsize=3)
        total = counts[row["family"]]["total"]
        driving.plot(total["ok"] / max(total["runs"], 1), place, "o", color="#1f6feb")
        printed = LEVELS.get(row["level"]) if row["size"] == "paper" else None
        if printed:
            accuracy.plot(printed.val_percent / 100, place, "D", color=_PAPER)
            driving.plot(len(printed.passed) / len(STANDARD_FOLLOW), place, "D", color=_PAPER)
    accuracy.set_yticks(range(len(rows)), [families[row["family"]] for row in rows])
    accuracy.invert_yaxis()
    accuracy.set(title="validation accuracy", xlim=(0.0, 1.0))
    driving.set(title="scenario runs that end well", xlim=(0.0, 1.02))
    for axes in (accuracy, driving):
        axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        axes.grid(alpha=0.25)
    figure.suptitle("Measured (blue) and printed in the paper (grey diamonds)", fontsize=10)
    figure.savefig(out, dpi=110)
