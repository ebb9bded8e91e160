"""A layout from above, with what was driven in it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from sdt_tools.frames import ROBOT_LENGTH_M, ROBOT_WIDTH_M, Pose2D
from sdt_tools.scene.layout import Box, Layout

Path2D = Float64[np.ndarray, "_ 3"]


def layout_figure(layouts: Layout | Sequence[Layout], paths: Sequence[Path2D], out: Path) -> None:
    """Draw layouts side by side to the PNG ``out``, each with the path in ``paths`` that the robot drove in it.

    A path holds x, y and yaw of the robot's centre, one row a step; an empty one draws the robot where it starts.
    """
    several = [layouts] if isinstance(layouts, Layout) else list(layouts)
    columns = min(4, len(several))
    rows = -(-len(several) // columns)
    figure = Figure(figsize=(5.0 * columns, 4.2 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, columns, squeeze=False).flatten()
    for panel in panels[len(several) :]:
        panel.set_axis_off()
    for panel, layout, path in zip(panels, several, paths, strict=False):
        draw_layout(panel, layout)
        _draw_robot(panel, layout.robot, path)
        panel.set_title(f"{layout.name}, seed {layout.seed}", fontsize=10)
    figure.savefig(out, dpi=80)


def draw_layout(panel: Axes, layout: Layout) -> None:
    """The room and the operator's path; x to the right, y up, metres."""
    draw_room(panel, layout)
    way = np.array(layout.operator.path_m)
    panel.plot(way[:, 0], way[:, 1], "o--", color="#e76f51", markersize=3, linewidth=1)
    panel.plot(*way[0], "o", color="#e76f51", markersize=7)


def draw_room(panel: Axes, layout: Layout) -> None:
    """Walls, boxes and posts; x to the right, y up, metres."""
    for wall in layout.walls:
        panel.plot([wall.x0_m, wall.x1_m], [wall.y0_m, wall.y1_m], color="#343a40", linewidth=1.6)
    for box in layout.boxes:
        panel.add_patch(Polygon(box.corners(), facecolor="#ced4da", edgecolor="#343a40"))
    for post in layout.posts:
        panel.add_patch(Circle((post.x_m, post.y_m), post.radius_m, color="#343a40"))
    panel.set_aspect("equal")


def _draw_robot(panel: Axes, start: Pose2D, path: Path2D) -> None:
    if len(path):
        panel.plot(path[:, 0], path[:, 1], color="#2a9d8f", linewidth=1.8)
    shown = [start, *(Pose2D(*row) for row in path[:: max(1, len(path) // 6)][1:].tolist())]
    for pose in shown:
        outline = Box(pose.x_m, pose.y_m, ROBOT_LENGTH_M, ROBOT_WIDTH_M, pose.yaw_rad).corners()
        panel.add_patch(Polygon(outline, fill=False, edgecolor="#2a9d8f", linewidth=0.8))
        nose = outline[1:3].mean(axis=0)
        panel.plot([pose.x_m, nose[0]], [pose.y_m, nose[1]], color="#2a9d8f", linewidth=0.8)
