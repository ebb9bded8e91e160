"""A comparison as a picture: differences with intervals, and what got better and worse where."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from sdt_tools.error_analysis.compare.paired import Change, Measure

_WORSE, _BETTER, _NEUTRAL = "#d1495b", "#2a9d8f", "#444444"
_NAMES: Final = {"accuracy": "accuracy", "loss_ce": "cross-entropy", "forward_recall": "forward recall"}
DPI: Final = 110


def draw_comparison(base: str, other: str, measures: dict[str, Measure], changes: Sequence[Change], path: Path) -> None:
    """Left the paired differences; right the frames that changed, a row a group."""
    figure = Figure(figsize=(11.0, 2.0 + 0.3 * len(changes)), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.6))
    _differences(left, measures)
    _changes(right, changes)
    figure.suptitle(f"{other} against {base}: same frames, 95 % over recordings", fontsize=10)
    figure.savefig(path, dpi=DPI)


def _differences(axes: Axes, measures: dict[str, Measure]) -> None:
    axes.axvline(0.0, color=_NEUTRAL, linewidth=0.8)
    for place, (name, measure) in enumerate(measures.items()):
        one = measure.difference
        better = one.low > 0.0 if name != "loss_ce" else one.high < 0.0
        worse = one.high < 0.0 if name != "loss_ce" else one.low > 0.0
        colour = _BETTER if better else _WORSE if worse else _NEUTRAL
        spread = [[max(one.value - one.low, 0.0)], [max(one.high - one.value, 0.0)]] if np.isfinite(one.low) else None
        axes.errorbar(one.value, place, xerr=spread, fmt="o", color=colour, capsize=3)
        axes.annotate(
            f"{one.value:+.3f}", (one.value, place), (0, 9), textcoords="offset points", ha="center", fontsize=8
        )
    axes.set_yticks(range(len(measures)), [_NAMES[name] for name in measures])
    axes.set_ylim(len(measures) - 0.4, -0.6)
    axes.margins(x=0.15)
    axes.set_xlabel("difference (accuracy and recall in shares, loss in nats)")
    _tidy(axes)


def _changes(axes: Axes, changes: Sequence[Change]) -> None:
    for place, change in enumerate(changes):
        worse, better = (count / max(change.frames, 1) for count in (change.worse, change.better))
        axes.barh(place, worse, color=_WORSE, height=0.6, label="got worse" if place == 0 else None)
        axes.barh(place, -better, color=_BETTER, height=0.6, label="got better" if place == 0 else None)
        net = change.net
        if np.isfinite(net.low):
            spread = [[max(net.value - net.low, 0.0)], [max(net.high - net.value, 0.0)]]
            axes.errorbar(
                net.value,
                place,
                xerr=spread,
                fmt="o",
                color=_NEUTRAL,
                markersize=4,
                capsize=2,
                label="net" if place == 0 else None,
            )
    axes.axvline(0.0, color=_NEUTRAL, linewidth=0.8)
    names = [change.value.replace("_", " ") or "all frames" for change in changes]
    axes.set_yticks(
        range(len(changes)), [f"{name} ({change.frames:,})" for name, change in zip(names, changes, strict=True)]
    )
    axes.set_ylim(len(changes) - 0.4, -0.6)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    axes.set_xlabel("share of the frames of a motion or scenario")
    axes.legend(frameon=False, fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    _tidy(axes)


def _tidy(axes: Axes) -> None:
    axes.grid(axis="x", alpha=0.3)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
