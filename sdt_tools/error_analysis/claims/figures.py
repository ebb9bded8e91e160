"""A picture a claim, drawn from the numbers of its verdicts."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter, PercentFormatter

from sdt_tools.error_analysis.claims import adversarial, implication, nested, profile, propositions, theorem
from sdt_tools.error_analysis.claims.locality import Correlogram
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, Finding
from sdt_tools.frames import MotionClass

DPI: Final = 110
LOCALITY_PICTURE: Final = "locality.png"
_SAFE, _STANDARD, _CHANCE = "#d1495b", "#1f6feb", "#8a8f98"
_FINDING: Final = {Finding.SUPPORTED: "#2a9d8f", Finding.CONTRADICTED: "#d1495b", Finding.UNDECIDED: "#8a8f98"}
_NATS: Final = {"cross_entropy": "cross-entropy (nats)", "zero_one": "error rate"}


def draw_claims(verdicts: Sequence[ClaimVerdict], correlogram: Correlogram | None, folder: Path) -> tuple[str, ...]:
    """Draw each claim of which there is something to draw; returns the names of the files written to ``folder``."""
    drawers: Mapping[str, Callable[[Sequence[ClaimVerdict]], Figure]] = {
        theorem.PICTURE: _theorem,
        implication.PICTURE: _implication,
        nested.PICTURE: _nested,
        profile.PICTURE: _profile,
        adversarial.PICTURE: _uniform,
        propositions.PICTURE: _propositions,
    }
    written = []
    for name, drawer in drawers.items():
        drawable = [verdict for verdict in verdicts if verdict.picture == name and verdict.numbers]
        if drawable:
            drawer(drawable).savefig(folder / name, dpi=DPI)
            written.append(name)
    if correlogram is not None:
        _locality(correlogram).savefig(folder / LOCALITY_PICTURE, dpi=DPI)
        written.append(LOCALITY_PICTURE)
    return tuple(written)


def _theorem(verdicts: Sequence[ClaimVerdict]) -> Figure:
    """Mean loss inside and outside, of the safe networks and of standard ones, a row a level."""
    figure = Figure(figsize=(9.0, 1.6 + 0.9 * len(verdicts)), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for panel, loss in zip(panels, _NATS, strict=True):
        for place, verdict in enumerate(verdicts):
            numbers = verdict.numbers[loss]
            for part, offset, filled in (("inside", -0.12, True), ("outside", 0.12, False)):
                _point(panel, numbers[part], place + offset, _SAFE, filled)
                if f"standard_{part}" in numbers:
                    _point(panel, numbers[f"standard_{part}"], place + offset, _STANDARD, filled, thin=True)
        panel.set(xlabel=_NATS[loss], xlim=(0.0, None))
        _tidy(panel, "x")
    panels[0].set_yticks(range(len(verdicts)), [_label(verdict) for verdict in verdicts])
    panels[0].set_ylim(len(verdicts) - 0.5, -0.5)
    figure.suptitle(
        "Theorem 1: mean loss inside the domains (filled) and outside (open), 95 % over recordings", fontsize=10
    )
    _legend(figure, {"networks held to the domains": _SAFE, "level 0 on the same frames": _STANDARD})
    return figure


def _implication(verdicts: Sequence[ClaimVerdict]) -> Figure:
    """Excess loss over distance, a column a level."""
    figure = Figure(figsize=(max(3.4 * len(verdicts) + 0.6, 6.4), 5.8), layout="constrained")
    grid = figure.subplots(2, len(verdicts), squeeze=False, sharey="row")
    for row, loss in zip(grid, _NATS, strict=True):
        for panel, verdict in zip(row, verdicts, strict=True):
            numbers = verdict.numbers[loss]
            middle_m = verdict.numbers["distance_mean_m"]
            curve = numbers["curve"]
            panel.axhline(0.0, color="#444444", linewidth=0.8)
            panel.fill_between(
                middle_m,
                [_or_nan(point["low"]) for point in curve],
                [_or_nan(point["high"]) for point in curve],
                color=_SAFE,
                alpha=0.2,
            )
            panel.plot(middle_m, [point["value"] for point in curve], "o-", color=_SAFE, markersize=4)
            panel.plot(middle_m, numbers["decreasing_fit"], "--", color=_CHANCE, linewidth=1.5)
            panel.set_xscale("log")
            panel.xaxis.set_minor_formatter(NullFormatter())
            value, low, high = (_or_nan(numbers["rank_correlation"][name]) for name in ("value", "low", "high"))
            panel.set_title(f"rank correlation {value:.2f} ({low:.2f} to {high:.2f})", fontsize=8)
            _tidy(panel, "both")
        row[0].set_ylabel(f"excess {_NATS[loss]}", fontsize=9)
    for panel, verdict in zip(grid[0], verdicts, strict=True):
        panel.set_title(f"{_label(verdict)}\n{panel.get_title()}", fontsize=9)
    for panel in grid[-1]:
        panel.set_xlabel("distance to the domains (m, RMS per ray)", fontsize=9)
    figure.suptitle(
        "Implication 1: what safety training adds, by distance\n(band: 95 % over recordings; dashed: best falling)",
        fontsize=10,
    )
    return figure


def _nested(verdicts: Sequence[ClaimVerdict]) -> Figure:
    """The share of failures that recur, with what chance and training again would give."""
    figure = Figure(figsize=(8.4, 1.4 + 0.45 * len(verdicts)), layout="constrained")
    axes = figure.subplots()
    for place, verdict in enumerate(verdicts):
        _point(axes, verdict.estimate.document(), place, _FINDING[verdict.finding], filled=True)
        axes.plot(verdict.numbers["chance"], place, "|", color=_CHANCE, markersize=14, markeredgewidth=2.5)
        again = verdict.numbers["recurs_when_trained_again"]
        if again is not None:
            axes.plot(again, place, "D", color=_STANDARD, markersize=5, fillstyle="none")
    labels = [f"{verdict.about}, {verdict.numbers['units']}" for verdict in verdicts]
    axes.set_yticks(range(len(verdicts)), labels)
    axes.set_ylim(len(verdicts) - 0.5, -0.5)
    axes.set(xlim=(0.0, 1.02), xlabel="failures that recur at the stricter level")
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    _tidy(axes, "x")
    axes.set_title("Nested failures: measured with 95 % intervals; 100 % is nested", fontsize=10)
    _legend(
        figure,
        {
            **{str(finding): _FINDING[finding] for finding in {verdict.finding for verdict in verdicts}},
            "by chance": _CHANCE,
            "in the same level, trained again": _STANDARD,
        },
        {"by chance": "|", "in the same level, trained again": "D"},
    )
    return figure


def _profile(verdicts: Sequence[ClaimVerdict]) -> Figure:
    """Forward shares and conditional shares, and error rates by motion."""
    forward = [verdict for verdict in verdicts if verdict.claim == profile.FORWARD]
    conditional = [verdict for verdict in verdicts if verdict.claim == profile.CONDITIONAL]
    figure = Figure(figsize=(11.0, 2.2 + 0.6 * max(len(forward), len(conditional), 1)), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.9))
    for place, verdict in enumerate(forward):
        _point(left, verdict.numbers["share"], place - 0.1, _SAFE, filled=True)
        _point(left, verdict.numbers["base"], place + 0.1, _CHANCE, filled=False)
        if "share_standard" in verdict.numbers:
            _point(left, verdict.numbers["share_standard"], place, _STANDARD, filled=True, thin=True)
    left.set_title("on forward frames: errors and (open) all frames", fontsize=9)
    for place, verdict in enumerate(conditional):
        _point(middle, verdict.numbers["share"], place, _SAFE, filled=True)
        if "share_standard" in verdict.numbers:
            _point(middle, verdict.numbers["share_standard"], place + 0.15, _STANDARD, filled=True, thin=True)
    middle.set_title("errors that are conditional", fontsize=9)
    for panel, rows in ((left, forward), (middle, conditional)):
        panel.set_yticks(range(len(rows)), [_label(verdict) for verdict in rows])
        panel.set_ylim(max(len(rows), 1) - 0.5, -0.5)
        panel.set_xlim(0.0, 1.0)
        panel.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        _tidy(panel, "x")
    _rates(right, forward)
    _legend(figure, {"networks held to domains": _SAFE, "level 0": _STANDARD, "all frames": _CHANCE})
    return figure


def _rates(axes: Axes, verdicts: Sequence[ClaimVerdict]) -> None:
    """Error rate by right motion, a line a level."""
    names = [motion.label for motion in MotionClass]
    shades = np.linspace(0.35, 1.0, max(len(verdicts), 1))
    lines: list[tuple[str, Mapping[str, Any], str, float]] = [
        (verdict.about, verdict.numbers["rates_by_motion"], _SAFE, float(shade))
        for verdict, shade in zip(verdicts, shades, strict=False)
    ]
    if verdicts and "rates_by_motion_standard" in verdicts[0].numbers:
        lines.append(("level 0", verdicts[0].numbers["rates_by_motion_standard"], _STANDARD, 1.0))
    for name, rates, colour, alpha in lines:
        values = [_or_nan(rates[motion]["value"]) if motion in rates else np.nan for motion in names]
        axes.plot(range(len(names)), values, "o-", color=colour, alpha=alpha, label=name, markersize=4)
    axes.set_xticks(range(len(names)), [name.replace("_", "\n") for name in names], fontsize=7)
    axes.set_ylim(0.0, 1.0)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    axes.set_title("error rate by right motion", fontsize=9)
    _tidy(axes, "y")
    if lines:
        axes.legend(frameon=False, fontsize=7, ncols=2)


def _uniform(verdicts: Sequence[ClaimVerdict]) -> Figure:
    """Error rate of each scenario over that of all, and the shares of tags."""
    ratios = [verdict for verdict in verdicts if "ratios" in verdict.numbers]
    shares = [verdict for verdict in verdicts if "shares" in verdict.numbers]
    rows = sum(len(verdict.numbers["ratios"]) for verdict in ratios) + sum(
        len(verdict.numbers["shares"]) for verdict in shares
    )
    figure = Figure(figsize=(9.0, 1.6 + 0.26 * max(rows, 4)), layout="constrained")
    left, right = figure.subplots(1, 2)
    _named_points(left, [(_of(v, ratios, n), p) for v in ratios for n, p in v.numbers["ratios"].items()])
    left.axvline(1.0, color="#444444", linewidth=0.8)
    left.set_xlabel("error rate of a scenario, over that of all")
    _named_points(right, [(_of(v, shares, n), p) for v in shares for n, p in v.numbers["shares"].items()])
    right.set_xlabel("share of errors")
    about = f"{verdicts[0].about}: " if len({verdict.about for verdict in verdicts}) == 1 else ""
    figure.suptitle(f"{about}errors by scenario and by tag, 95 % over recordings", fontsize=10)
    return figure


def _of(verdict: ClaimVerdict, verdicts: Sequence[ClaimVerdict], name: str) -> str:
    """The name of a row, with the model where there are several."""
    shown = name.replace("_", " ")
    return f"{verdict.about}: {shown}" if len(verdicts) > 1 else shown


def _named_points(axes: Axes, points: Sequence[tuple[str, Mapping[str, Any]]]) -> None:
    for place, (_, point) in enumerate(points):
        _point(axes, point, place, _SAFE, filled=True)
    axes.set_yticks(range(len(points)), [name for name, _ in points], fontsize=8)
    axes.set_ylim(max(len(points), 1) - 0.5, -0.5)
    _tidy(axes, "x")


def _propositions(verdicts: Sequence[ClaimVerdict]) -> Figure:
    """The two criteria sample by sample, and how many neighbours the transient errors have."""
    figure = Figure(figsize=(8.4, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for verdict in verdicts:
        if verdict.claim == propositions.PROPOSITION_1:
            worst, safety = verdict.numbers["adversarial"], verdict.numbers["safety_domain"]
            left.plot([0, max(worst)], [0, max(worst)], color=_CHANCE, linewidth=1)
            left.plot(worst, safety, "o", color=_SAFE, markersize=4, alpha=0.7)
        if verdict.claim == propositions.TRANSIENT:
            neighbours = np.array(verdict.numbers["neighbours"])
            bins = np.geomspace(1.0, max(float(neighbours.max()), 2.0) * 1.05, 20).tolist()
            right.hist(neighbours, bins, color=_STANDARD, alpha=0.8)
            right.set_xscale("log")
    left.set(xlabel="worst loss, adversarial training (nats)", ylabel="worst loss, ball as a safety domain (nats)")
    left.set_title("Proposition 1: a point a sample", fontsize=9)
    right.set(xlabel="frames within ε, all right", ylabel="transient errors")
    right.set_title("Proposition 2: complements of one-point conditions", fontsize=9)
    for panel in (left, right):
        _tidy(panel, "both")
    return figure


def _locality(correlogram: Correlogram) -> Figure:
    """Correlation of losses by distance."""
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axes = figure.subplots()
    axes.axhline(0.0, color="#444444", linewidth=0.8)
    axes.fill_between(correlogram.upper_m, correlogram.low, correlogram.high, color=_SAFE, alpha=0.2)
    axes.plot(correlogram.upper_m, correlogram.correlation, "o-", color=_SAFE, markersize=4)
    axes.set(xlabel="distance of two frames, up to (m, RMS per ray)", ylabel="correlation of their losses")
    axes.set_title("Locality: losses of frames of different recordings, 95 % over recordings", fontsize=9)
    _tidy(axes, "both")
    return figure


def _point(
    axes: Axes, estimate: Mapping[str, Any], place: int | float, colour: str, filled: bool, thin: bool = False
) -> None:
    """A value with its interval, lying."""
    value, low, high = (_or_nan(estimate[name]) for name in ("value", "low", "high"))
    spread = [[max(value - low, 0.0)], [max(high - value, 0.0)]] if np.isfinite(low) else None
    axes.errorbar(
        value,
        place,
        xerr=spread,
        fmt="o",
        color=colour,
        markerfacecolor=colour if filled else "white",
        markersize=4 if thin else 6,
        alpha=0.7 if thin else 1.0,
        capsize=2 if thin else 3,
    )


def _label(verdict: ClaimVerdict) -> str:
    return f"{verdict.about}: {verdict.finding}"


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


def _tidy(axes: Axes, grid: str) -> None:
    axes.grid(axis=grid, alpha=0.3)  # type: ignore[arg-type]
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _legend(figure: Figure, colours: Mapping[str, str], markers: Mapping[str, str] | None = None) -> None:
    """Names below the picture; those without a marker of their own have a dot."""
    handles = [
        Line2D([], [], color=colour, marker=(markers or {}).get(name, "o"), linestyle="", label=name)
        for name, colour in colours.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=8)
