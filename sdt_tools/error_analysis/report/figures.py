"""Pictures of an error analysis: what ε means on the data at hand, how tags are shared out, where conditions lie.

Each can be saved as PNG, and put into a page as SVG in whose colours lines and letters follow the page's.
"""

import io
import re
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from jaxtyping import Bool, Float64
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sdt_tools.error_analysis.conditions.predicates import Predicate
from sdt_tools.error_analysis.definitions import ERROR_TAGS, Tag
from sdt_tools.error_analysis.epsilon import Epsilon
from sdt_tools.error_analysis.report.document import ErrorReport

TAG_COLOURS: Final = {
    Tag.SYSTEMATIC: "#d81b82",
    Tag.CONDITIONAL: "#f08a00",
    Tag.TRANSIENT: "#e0c200",
    Tag.ISOLATED: "#1fa8bd",
    Tag.UNEXPLAINED: "#8e52cc",
    Tag.CORRECT: "#4caf62",
}
DPI: Final = 130
BINS: Final = 24
"""Bars of a condition's picture; each stands for as many frames."""
_INK: Final = "#010203"
"""Black to the eye; in a page, the colour of its text."""


def save_png(figure: Figure, path: Path) -> None:
    """``figure`` on white."""
    figure.savefig(path, dpi=DPI)


def as_svg(figure: Figure, name: str) -> str:
    """``figure`` as an SVG element without a background; ``name`` keeps its ids apart from those of other figures."""
    with io.StringIO() as file, _style():
        figure.savefig(file, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
        text = file.getvalue()
    text = re.sub(r"font: ([0-9.]+px) [^;\"]*", r"font: \1 system-ui, sans-serif", text[text.index("<svg") :])
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'((?: id="|url\(#|href="#))', rf"\1{name}-", text)
    return text.replace(_INK, "currentColor")


def epsilon_figure(epsilon: Epsilon) -> Figure:
    """Distances between successive and between unrelated frames, and where ε lies between them."""
    figure, axes = _new(7.2, 3.6)
    shown = np.concatenate([epsilon.successive, epsilon.unrelated, [epsilon.value]])
    positive = shown[shown > 0]
    bins = np.geomspace(positive.min() * 0.9, positive.max() * 1.1, 60).tolist()
    for distances, colour, name in (
        (epsilon.successive, "#2a6fbb", "successive frames"),
        (epsilon.unrelated, "#8a8f98", "unrelated frames"),
    ):
        if distances.size:
            weights = np.full(distances.size, 100.0 / distances.size)
            within = np.mean(distances <= epsilon.value)
            axes.hist(distances, bins, weights=weights, color=colour, alpha=0.7, label=f"{name}: {within:.1%} within ε")
    axes.axvline(epsilon.value, color="#c62828", linewidth=2, label=f"ε = {epsilon.text}")
    axes.set_xscale("log")
    axes.set_xlabel(epsilon.measure.distance)
    axes.set_ylabel("share of pairs (%)")
    axes.set_title(f"ε: {epsilon.source}", fontsize=10)
    axes.legend(frameon=False, fontsize=9)
    _quiet(axes)
    return figure


def tags_figure(report: ErrorReport) -> Figure:
    """Each tag as a share of all frames, with its interval; what is right is left out."""
    figure, axes = _new(7.2, 3.0)
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
    _quiet(axes)
    return figure


def bound_figure(
    predicate: Predicate, values: Float64[np.ndarray, "frames"], wrong: Bool[np.ndarray, "frames"]
) -> Figure:
    """The share of errors over one feature, in bins of equally many frames, and on which side of a bound it counts."""
    figure, axes = _new(3.6, 2.1)
    known = np.isfinite(values)
    values, wrong = values[known], wrong[known]
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
    if len(edges) > 1:
        place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
        frames = np.bincount(place, minlength=len(edges) - 1)
        errors = np.bincount(place[wrong], minlength=len(edges) - 1)
        axes.stairs(100.0 * errors / np.maximum(frames, 1), edges, fill=True, color="#c62828", alpha=0.65)
    low, high = axes.get_xlim()
    bound = predicate.bound
    inside = (low, bound) if predicate.operator == "<" else (bound, high)
    axes.axvspan(*inside, color=TAG_COLOURS[Tag.CONDITIONAL], alpha=0.18, linewidth=0)
    axes.axvline(bound, color=TAG_COLOURS[Tag.CONDITIONAL], linewidth=1.5)
    axes.set_xlim(min(low, bound), max(high, bound))
    axes.set_ylim(0.0, 100.0)
    axes.set_xlabel(predicate.feature, fontsize=9)
    axes.set_ylabel("errors (%)", fontsize=9)
    _quiet(axes)
    return figure


def _style() -> AbstractContextManager[None]:
    return mpl.rc_context(
        {
            "axes.edgecolor": _INK,
            "axes.labelcolor": _INK,
            "text.color": _INK,
            "xtick.color": _INK,
            "ytick.color": _INK,
            "svg.fonttype": "none",
            "svg.hashsalt": "sdt",
            "font.size": 10.0,
        }
    )


def _new(width: float, height: float) -> tuple[Figure, Axes]:
    with _style():
        figure = Figure(figsize=(width, height), layout="constrained")
        return figure, figure.subplots()


def _quiet(axes: Axes) -> None:
    axes.grid(alpha=0.25)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
