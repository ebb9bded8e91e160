"""An evaluation of vision networks as pictures: mode errors by scenario, and every run as a strip of time."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sdt_tools.class_colors import GESTURES, MODES
from sdt_tools.evaluation.vision.results import VisionTally
from sdt_tools.frames import Gesture, Mode

_MODELS: Final = ("#264653", "#2a9d8f", "#e9a03b", "#d1495b", "#7b2cbf", "#6c757d")
_ERROR: Final = "#d00000"
_DPI: Final = 100


def errors_figure(
    models: Mapping[str, Mapping[str, VisionTally]], printed: Mapping[int, Mapping[str, int]], out: Path
) -> None:
    """Draw the mode errors a run of each model and scenario, with intervals, to the PNG ``out``.

    ``printed`` are the paper's, by adversarial radius: white diamonds, at the model in the same place.
    """
    scenarios = list(next(iter(models.values())))
    figure = Figure(figsize=(2.0 + 1.4 * len(scenarios), 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    width = 0.8 / len(models)
    for number, (model, tallies) in enumerate(models.items()):
        places = np.arange(len(scenarios)) + (number - (len(models) - 1) / 2) * width
        colour = _MODELS[number % len(_MODELS)]
        means = np.array([tallies[name].per_run for name in scenarios])
        ends = np.array([tallies[name].interval for name in scenarios]).T
        axes.bar(places, means, width * 0.9, color=colour, label=model)
        axes.errorbar(places, means, np.abs(ends - means), fmt="none", ecolor="#343a40", capsize=2, linewidth=0.9)
        theirs = list(printed.values())[number] if number < len(printed) and len(models) <= len(printed) else {}
        shown = [(place, theirs[name]) for place, name in zip(places, scenarios, strict=True) if name in theirs]
        if shown:
            axes.plot(
                *zip(*shown, strict=True), "D", color="white", markeredgecolor="black", markersize=5, clip_on=False
            )
    axes.set_xticks(range(len(scenarios)), [name.replace("_", "\n", 1).replace("_", " ") for name in scenarios])
    axes.tick_params(labelsize=8)
    axes.set_ylabel("mode errors a run")
    axes.set_ylim(bottom=0)
    axes.spines[["top", "right"]].set_visible(False)
    handles, labels = axes.get_legend_handles_labels()
    if any(set(scenarios) & set(errors) for errors in printed.values()) and len(models) <= len(printed):
        radii = ", ".join(f"ε = {epsilon}" for epsilon in list(printed)[: len(models)])
        handles.append(Line2D([], [], color="white", markeredgecolor="black", marker="D", linestyle=""))
        labels.append(f"the paper's, one run each: {radii} from left to right")
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    figure.savefig(out, dpi=_DPI)


def runs_figure(decisions: pl.DataFrame, names: Mapping[str, str], out: Path) -> None:
    """Draw each run (rows of an evaluation's table of decisions) as a strip of time to the PNG ``out``.

    A row of panels a model, called as ``names`` says, a column a scenario. Strips are grey while idle and blue while
    active; below a strip are the gestures shown, on it marks where the mode changed by a misread gesture.
    """
    scenarios = decisions["scenario"].unique(maintain_order=True).to_list()
    most = decisions["seed"].n_unique()
    size = (2.6 * len(scenarios) + 0.6, (0.6 + 0.14 * most) * len(names) + 1.0)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(len(names), len(scenarios), squeeze=False, sharex="col")
    for row, (model, title) in zip(grid, names.items(), strict=True):
        for panel, scenario in zip(row, scenarios, strict=True):
            mine = decisions.filter((pl.col("model") == model) & (pl.col("scenario") == scenario))
            _strips(panel, mine)
        row[0].set_ylabel(title, fontsize=9)
    for panel, scenario in zip(grid[0], scenarios, strict=True):
        panel.set_title(scenario.replace("_", " "), fontsize=9)
    for panel in grid[-1]:
        panel.set_xlabel("s", fontsize=8)
    figure.legend(handles=_handles(), loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    figure.suptitle("Every run a strip: its mode, the gestures shown, and mode errors", fontsize=10)
    figure.savefig(out, dpi=_DPI)


def _strips(panel: Axes, decisions: pl.DataFrame) -> None:
    seeds = decisions["seed"].unique(maintain_order=True).to_list()
    for place, seed in enumerate(seeds):
        run = decisions.filter(pl.col("seed") == seed).sort("time_s")
        times_s = run["time_s"].to_numpy()
        ends_s = np.append(times_s[1:], times_s[-1:] + np.diff(times_s[-2:]).sum())
        for column, low, height, colours in (("after", 0.0, 0.45, MODES), ("shown", 0.45, 0.3, GESTURES)):
            states = run[column].to_list()
            for start, end, state in _spans(states):
                if column == "after" or state != Gesture.IDLE.label:
                    left_s, width_s = times_s[start], ends_s[end - 1] - times_s[start]
                    panel.broken_barh([(left_s, width_s)], (place + low, height), facecolors=_rgb(colours[state]))
        wrong = run.filter(pl.col("error"))["time_s"].to_numpy()
        panel.plot(wrong, np.full(len(wrong), place + 0.22), "|", color=_ERROR, markersize=7, markeredgewidth=1.6)
    panel.set_yticks(np.arange(len(seeds)) + 0.3, [str(seed) for seed in seeds], fontsize=5)
    panel.set_ylim(len(seeds), -0.2)
    panel.tick_params(axis="x", labelsize=7)
    panel.tick_params(axis="y", length=0)
    panel.spines[["top", "right", "left"]].set_visible(False)


def _spans(states: Sequence[str]) -> list[tuple[int, int, str]]:
    """Runs of equal states as (start, end, state), ends exclusive."""
    changes = [0, *[i for i in range(1, len(states)) if states[i] != states[i - 1]], len(states)]
    return [(start, end, states[start]) for start, end in pairwise(changes) if end > start]


def _rgb(colour: tuple[int, int, int]) -> tuple[float, float, float]:
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def _handles() -> list[Patch | Line2D]:
    return [
        *[Patch(color=_rgb(MODES[mode.label]), label=mode.label) for mode in Mode],
        *[
            Patch(color=_rgb(GESTURES[gesture.label]), label=f"{gesture.label} shown")
            for gesture in (Gesture.ENABLE, Gesture.DISABLE)
        ],
        Line2D([], [], color=_ERROR, marker="|", linestyle="", markeredgewidth=1.6, label="mode error"),
    ]
