"""Pictures of an error analysis: what ε means on the data at hand, and how the tags are shared out."""

from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sdt_tools.error_analysis.definitions import Tag
from sdt_tools.error_analysis.distance import Epsilon
from sdt_tools.error_analysis.report.document import ErrorReport

TAG_COLOURS: Final = {
    Tag.SYSTEMATIC: "#d81b82",
    Tag.CONDITIONAL: "#f08a00",
    Tag.TRANSIENT: "#e0c200",
    Tag.ISOLATED: "#1fa8bd",
    Tag.UNEXPLAINED: "#8e52cc",
    Tag.CORRECT: "#4caf62",
}
ERROR_TAGS: Final = tuple(tag for tag in Tag if tag is not Tag.CORRECT)
DPI: Final = 130


def draw_epsilon(epsilon: Epsilon, path: Path) -> None:
    """Distances between successive and between unrelated frames, and where ε lies between them."""
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    axes = figure.subplots()
    shown = np.concatenate([epsilon.successive_m, epsilon.unrelated_m, [epsilon.epsilon_m]])
    positive = shown[shown > 0]
    bins = np.geomspace(positive.min() * 0.9, positive.max() * 1.1, 60).tolist()
    for distances, colour, name in (
        (epsilon.successive_m, "#2a6fbb", "successive frames"),
        (epsilon.unrelated_m, "#8a8f98", "unrelated frames"),
    ):
        if distances.size:
            weights = np.full(distances.size, 100.0 / distances.size)
            within = np.mean(distances <= epsilon.epsilon_m)
            axes.hist(distances, bins, weights=weights, color=colour, alpha=0.7, label=f"{name}: {within:.1%} within ε")
    axes.axvline(epsilon.epsilon_m, color="#c62828", linewidth=2, label=f"ε = {epsilon.epsilon_m:.3g} m")
    axes.set_xscale("log")
    axes.set_xlabel("distance, root mean square per ray (m)")
    axes.set_ylabel("share of pairs (%)")
    axes.set_title(f"ε: {epsilon.source}", fontsize=10)
    _finish(axes)
    figure.savefig(path, dpi=DPI)


def draw_tags(report: ErrorReport, path: Path) -> None:
    """Each tag as a share of all frames, with its interval; what is right is left out."""
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    axes = figure.subplots()
    for place, tag in enumerate(reversed(ERROR_TAGS)):
        share = report.tags[tag]
        width = 100.0 * share.share
        whiskers = [[width - 100.0 * share.low], [100.0 * share.high - width]]
        axes.barh(place, width, xerr=whiskers, color=TAG_COLOURS[tag], ecolor="#444444", capsize=3, height=0.65)
        axes.annotate(
            f"{share.count:,}", (100.0 * share.high, place), (6, 0), textcoords="offset points", va="center", fontsize=9
        )
    axes.set_yticks(range(len(ERROR_TAGS)), [str(tag) for tag in reversed(ERROR_TAGS)])
    axes.set_xlim(0.0, max(1.0, 115.0 * max(report.tags[tag].high for tag in ERROR_TAGS)))
    axes.set_xlabel("share of all labelled frames (%), 95 % Wilson interval")
    axes.set_title(
        f"{report.model}: {report.errors:,} errors in {report.frames:,} frames of {report.recordings} recordings",
        fontsize=10,
    )
    axes.grid(axis="x", alpha=0.3)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=DPI)


def _finish(axes: Axes) -> None:
    axes.legend(frameon=False, fontsize=9)
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
