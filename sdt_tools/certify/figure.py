"""Provable margins over the angle of a domain's ray, coloured by verdict, one row a set."""

from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sdt_tools.certify.ledger import ledger_table
from sdt_tools.certify.verdicts import Ledger, Verdict
from sdt_tools.frames import ray_angles_rad

VERDICT_COLOURS: Final = {
    Verdict.CERTIFIED: "#2a9d8f",
    Verdict.VIOLATED: "#d62828",
    Verdict.UNKNOWN: "#f4a261",
    Verdict.ERROR: "#7b2cbf",
}
_FOUND: Final = "#6c757d"
_ROW_IN: Final = 3.0
_MOST_ROWS: Final = 6
"""More sets than that share one row."""


def margins_figure(ledger: Ledger, title: str, out: Path) -> None:
    """Draw the ledger to the PNG ``out``.

    A dot is what bounds prove, a dash the smallest margin that a search met: the true smallest one lies between. The
    axis is linear within ±1 logit and logarithmic beyond. Domains without a margin stand as crosses at its foot.
    """
    table = ledger_table(ledger)
    sets = table["set"].unique(maintain_order=True).to_list()
    shown = {name: table.filter(pl.col("set") == name) for name in sets}
    if len(sets) > _MOST_ROWS:
        shown = {f"{len(sets)} sets": table}
    figure = Figure(figsize=(9.0, _ROW_IN * len(shown) + 1.0), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(shown), 1, squeeze=False, sharex=True)[:, 0]
    for panel, (name, rows) in zip(panels, shown.items(), strict=True):
        _draw_set(panel, rows, ledger.required_margin)
        counts = dict(rows.group_by("verdict").len().iter_rows())
        told = ", ".join(f"{counts[verdict]} {verdict}" for verdict in Verdict if counts.get(verdict))
        panel.set_title(f"{name}: {len(rows)} domains, {told}", fontsize=10, loc="left")
    panels[-1].set_xlabel("←  left      angle of the domain's ray, degrees      right  →")
    panels[-1].invert_xaxis()  # left is on the left, as the robot sees it
    figure.suptitle(title, fontsize=11)
    legend = _legend(table, ledger.required_margin)
    figure.legend(handles=legend, loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    figure.savefig(out, dpi=110)


def _draw_set(panel: Axes, rows: pl.DataFrame, required_margin: float | None) -> None:
    angle_deg = np.rad2deg(ray_angles_rad())[rows["ray"].to_numpy()]
    margin = rows["margin"].cast(pl.Float64).to_numpy()
    found = -rows["violation"].cast(pl.Float64).to_numpy()
    verdicts = rows["verdict"].to_numpy()
    panel.axhline(0.0, color="#212529", linewidth=0.8)
    if required_margin is not None:
        panel.axhline(required_margin, color="#212529", linewidth=0.8, linestyle=":")
    panel.plot(angle_deg, found, "_", color=_FOUND, markersize=5, markeredgewidth=1.0)
    for verdict, colour in VERDICT_COLOURS.items():
        own = (verdicts == verdict.value) & np.isfinite(margin)
        panel.plot(angle_deg[own], margin[own], "o", color=colour, markersize=3.5, markeredgewidth=0)
    nothing = ~np.isfinite(margin)
    panel.plot(
        angle_deg[nothing],
        np.full(nothing.sum(), 0.03),
        "x",
        color=VERDICT_COLOURS[Verdict.ERROR],
        markersize=4,
        transform=panel.get_xaxis_transform(),
    )
    panel.set_yscale("symlog", linthresh=1.0)
    drawn = np.concatenate([margin, found])
    drawn = drawn[np.isfinite(drawn)]
    low, high = (drawn.min(), drawn.max()) if len(drawn) else (0.0, 0.0)
    panel.set_ylim(min(-2.0, 2.5 * low), max(2.0, 2.5 * high))
    panel.set_ylabel("margin, logits")
    panel.grid(alpha=0.25)


def _legend(table: pl.DataFrame, required_margin: float | None) -> list[Line2D]:
    given = set(table["verdict"])
    dots = [
        Line2D(
            [],
            [],
            color=colour,
            marker="x" if verdict is Verdict.ERROR else "o",
            linestyle="",
            markersize=4,
            label=f"{verdict}" if verdict is Verdict.ERROR else f"bound, {verdict}",
        )
        for verdict, colour in VERDICT_COLOURS.items()
        if verdict.value in given
    ]
    searched = table["violation"].is_not_null().any()
    search = Line2D([], [], color=_FOUND, marker="_", linestyle="", label="smallest margin met by the search")
    label = f"required: {required_margin:.2g}" if required_margin is not None else ""
    required = Line2D([], [], color="#212529", linewidth=0.8, linestyle=":", label=label)
    return [*dots, *([search] if searched else []), *([required] if label else [])]
