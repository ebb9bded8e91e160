"""Driven paths on their layouts: one small map a run, or all scenarios side by side."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import polars as pl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.scene.figure import draw_room
from sdt_tools.scene.scenario import layout_for

OUTCOME_COLOURS: Final = {
    Outcome.OK.value: "#2a9d8f",
    Outcome.CONTACT.value: "#d62828",
    Outcome.LOST.value: "#f77f00",
    Outcome.STUCK.value: "#7b2cbf",
    Outcome.TIMEOUT.value: "#6c757d",
}
_COLUMNS: Final = 5
_PANEL_IN: Final = 2.6


def runs_figure(runs: pl.DataFrame, traces: pl.DataFrame, scenario: str, title: str, out: Path) -> None:
    """Draw the runs of one policy in one scenario (rows of the tables of an evaluation) to the PNG ``out``.

    ``scenario`` is the name or file that the runs were made with.
    """
    rows = max(1, math.ceil(len(runs) / _COLUMNS))
    figure = Figure(figsize=(_COLUMNS * _PANEL_IN, rows * _PANEL_IN * 0.8 + 0.8), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).flatten()
    for panel in panels:
        panel.set_axis_off()
    for panel, run in zip(panels, runs.sort("seed").iter_rows(named=True), strict=False):
        draw_room(panel, layout_for(scenario, run["seed"]))
        _draw_run(panel, traces.filter(pl.col("seed") == run["seed"]), run["outcome"])
        panel.set_title(f"{run['seed']}: {run['outcome']}, {run['simulated_s']:.0f} s", fontsize=8)
    figure.suptitle(title, fontsize=11)
    end = Line2D([], [], color="#495057", marker="x", linestyle="", label="operator's end")
    handles = [*_legend(set(runs["outcome"])), end]
    figure.legend(handles=handles, loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    figure.savefig(out, dpi=90)


def scenarios_figure(
    runs: pl.DataFrame, traces: pl.DataFrame, scenarios: Sequence[str], rows: Mapping[str, str], seed: int, out: Path
) -> None:
    """Draw every scenario in the world of ``seed``, with all paths driven in it: a row a model, or group of models.

    ``rows`` are values of the tables' column ``model`` and what to call them; ``scenarios`` the names or files that the
    runs were made with. Runs of one row are drawn over each other, the place of a failure is marked.
    """
    layouts = [layout_for(scenario, seed) for scenario in scenarios]
    figure = Figure(figsize=(2.3 * len(layouts) + 0.4, 1.9 * len(rows) + 0.8), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(len(rows), len(layouts), squeeze=False)
    shown = runs.filter(pl.col("seed") == seed)
    paths = traces.filter(pl.col("seed") == seed)
    for panel, layout in zip(grid[0], layouts, strict=True):
        panel.set_title(layout.name.replace("_", " "), fontsize=9)
    for panels, (model, title) in zip(grid, rows.items(), strict=True):
        for panel, layout in zip(panels, layouts, strict=True):
            draw_room(panel, layout)
            panel.set(xticks=[], yticks=[], frame_on=False)
            here = (pl.col("model") == model) & (pl.col("scenario") == layout.name)
            for run in shown.filter(here).iter_rows(named=True):
                _draw_path(panel, paths.filter(here & (pl.col("policy") == run["policy"])), run["outcome"])
        panels[0].set_ylabel(title, fontsize=8)
    figure.suptitle(f"Seed {seed}; failures end in a cross", fontsize=10)
    outcomes = set(shown["outcome"])
    figure.legend(handles=_legend(outcomes), loc="outside lower center", ncols=7, fontsize=8, frameon=False)
    figure.savefig(out, dpi=90)


def _draw_path(panel: Axes, trace: pl.DataFrame, outcome: str) -> None:
    """One of several paths: thin, its end marked where it failed."""
    trace = trace.sort("time_s")
    colour = OUTCOME_COLOURS[outcome]
    panel.plot(trace["operator_x_m"], trace["operator_y_m"], color="#adb5bd", linewidth=0.8, linestyle="--")
    panel.plot(trace["robot_x_m"], trace["robot_y_m"], color=colour, linewidth=1.1, alpha=0.8)
    if outcome != Outcome.OK.value:
        panel.plot(trace["robot_x_m"][-1:], trace["robot_y_m"][-1:], "x", color=colour, markersize=6)


def _draw_run(panel: Axes, trace: pl.DataFrame, outcome: str) -> None:
    panel.plot(trace["operator_x_m"], trace["operator_y_m"], color="#adb5bd", linewidth=1.0, linestyle="--")
    panel.plot(trace["robot_x_m"], trace["robot_y_m"], color=OUTCOME_COLOURS[outcome], linewidth=1.6)
    panel.plot(trace["robot_x_m"][:1], trace["robot_y_m"][:1], "o", color=OUTCOME_COLOURS[outcome], markersize=4)
    panel.plot(trace["operator_x_m"][-1:], trace["operator_y_m"][-1:], "x", color="#495057", markersize=5)


def _legend(outcomes: set[str]) -> list[Line2D]:
    robot = [
        Line2D([], [], color=colour, label=f"robot's centre, {name}")
        for name, colour in OUTCOME_COLOURS.items()
        if name in outcomes
    ]
    operator = Line2D([], [], color="#adb5bd", linestyle="--", label="operator")
    return [*robot, operator]
