"""Safety domains and attacked scans from above, ahead at the top and left on the left, as in the paper's Figure 3."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Float, Float64
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon

from sdt_tools.frames import LIDAR_AHEAD_M, RAYS, ROBOT_LENGTH_M, ROBOT_WIDTH_M, MotionClass, ray_angles_rad
from sdt_tools.robustness.boxes import DomainSet

_FREE, _NEAR, _ROBOT = "#95d5b2", "#d62828", "#343a40"
_ORIGINAL, _MOVED = "#8a8f98", "#1f6feb"
_SHOWN_M: Final = 4.5


def domains_figure(sets: Sequence[DomainSet], out: Path) -> None:
    """Draw, for each set, the region that the rays of its middle domain may end in, and the rays that have a domain."""
    columns = min(4, len(sets))
    rows = -(-len(sets) // columns)
    figure = Figure(figsize=(4.2 * columns, 4.6 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, columns, squeeze=False).flatten()
    for panel in panels[len(sets) :]:
        panel.set_axis_off()
    for panel, boxes in zip(panels, sets, strict=False):
        _draw_domain(panel, boxes, len(boxes) // 2)
    handles = [
        Patch(facecolor=_FREE, alpha=0.5, label="where a ray may end"),
        Patch(facecolor=_NEAR, alpha=0.6, label="the same, rays held nearest"),
        Patch(facecolor="none", edgecolor=_NEAR, linestyle=":", label="bearings that have a domain"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(3, columns), fontsize=8, frameon=False)
    figure.savefig(out, dpi=100)


def attacked_figure(
    original_m: Float64[np.ndarray, "rays"],
    attacked_m: Float64[np.ndarray, "rays"],
    logits: Sequence[Float[np.ndarray, "classes"]],
    title: str,
    out: Path,
) -> None:
    """A scan before and after the attack, from above, and what the network answers to each.

    ``logits`` are those of the original and of the attacked scan.
    """
    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    above, bars = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    reach_m = float(np.clip(np.percentile(attacked_m, 90) * 1.1, 1.0, 8.0))
    _draw_robot(above)
    for ranges_m, colour, size, label in (
        (original_m, _ORIGINAL, 5.0, "as it was"),
        (attacked_m, _MOVED, 4.0, "attacked"),
    ):
        x, y = _screen(ranges_m)
        above.scatter(x, y, s=size, color=colour, label=label, zorder=3)
    _frame(above, reach_m)
    above.legend(loc="lower right", frameon=False, fontsize=8)
    places = np.arange(len(MotionClass))
    for offset, values, colour in ((-0.2, logits[0], _ORIGINAL), (0.2, logits[1], _MOVED)):
        bars.barh(places + offset, values, height=0.38, color=colour)
        best = int(np.argmax(values))
        bars.annotate(
            "answer", (values[best], best + offset), (4, 0), textcoords="offset points", va="center", fontsize=8
        )
    bars.set_yticks(places, [motion.label for motion in MotionClass])
    bars.invert_yaxis()
    bars.margins(x=0.15)
    bars.set(xlabel="logit", title="answers")
    bars.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title, fontsize=10)
    figure.savefig(out, dpi=100)


def _draw_domain(panel: Axes, boxes: DomainSet, domain: int) -> None:
    lower_m, upper_m = boxes.lower_m[domain], boxes.upper_m[domain]
    near = upper_m <= upper_m.min() + 1e-9
    near = near if not near.all() else np.zeros_like(near)
    _draw_sector(panel, lower_m, upper_m, ~near, _FREE, 0.5)
    _draw_sector(panel, lower_m, upper_m, near, _NEAR, 0.6)
    edge_m = 0.93 * _SHOWN_M
    for ray in (int(boxes.rays.min()), int(boxes.rays.max())):
        x, y = _screen(np.full(RAYS, edge_m))
        panel.plot([0, x[ray]], [0, y[ray]], color=_NEAR, linestyle=":", linewidth=1.0)
    _draw_robot(panel)
    _frame(panel, _SHOWN_M)
    far_m = float(np.median(upper_m))
    beyond = f", shown to {_SHOWN_M:g} m" if far_m > _SHOWN_M else ""
    panel.set_title(f"{boxes.name}: {len(boxes)} domains, this one ray {boxes.rays[domain]}{beyond}", fontsize=9)
    allowed = ", ".join(motion.label for motion in sorted(boxes.allowed))
    panel.set_xlabel(f"allowed: {allowed}", fontsize=7, wrap=True)


def _draw_sector(
    panel: Axes,
    lower_m: Float64[np.ndarray, "rays"],
    upper_m: Float64[np.ndarray, "rays"],
    chosen: np.ndarray,
    colour: str,
    alpha: float,
) -> None:
    """The area between the bounds of each run of chosen rays; a single ray is drawn half a step wide."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(np.int8)))
    angles = ray_angles_rad()
    half_step = (angles[1] - angles[0]) / 2
    for first, end in edges.reshape(-1, 2):
        at = np.concatenate([[angles[first] - half_step], angles[first:end], [angles[end - 1] + half_step]])
        low = np.minimum(np.pad(lower_m[first:end], 1, mode="edge"), _SHOWN_M)
        high = np.minimum(np.pad(upper_m[first:end], 1, mode="edge"), _SHOWN_M)
        outline = np.concatenate(
            [
                np.stack([-np.sin(at) * high, np.cos(at) * high], axis=1),
                np.stack([-np.sin(at) * low, np.cos(at) * low], axis=1)[::-1],
            ]
        )
        panel.add_patch(Polygon(outline, facecolor=colour, alpha=alpha, edgecolor=colour, linewidth=1.0))


def _draw_robot(panel: Axes) -> None:
    half_width, front, back = ROBOT_WIDTH_M / 2, ROBOT_LENGTH_M / 2 - LIDAR_AHEAD_M, -ROBOT_LENGTH_M / 2 - LIDAR_AHEAD_M
    corners = np.array([[-half_width, back], [half_width, back], [half_width, front], [-half_width, front]])
    panel.add_patch(Polygon(corners, fill=False, edgecolor=_ROBOT, linewidth=1.2))
    panel.plot(0, 0, "^", color=_ROBOT, markersize=4)


def _screen(ranges_m: Float64[np.ndarray, "rays"]) -> tuple[np.ndarray, np.ndarray]:
    angles = ray_angles_rad()
    return -np.sin(angles) * ranges_m, np.cos(angles) * ranges_m


def _frame(panel: Axes, reach_m: float) -> None:
    panel.set_aspect("equal")
    panel.set(xlim=(-reach_m, reach_m), ylim=(-0.75 * reach_m, reach_m))
    panel.tick_params(labelsize=7)
    panel.grid(alpha=0.2)
    panel.set_ylabel("ahead, m", fontsize=8)
