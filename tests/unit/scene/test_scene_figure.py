"""The picture of layouts."""

from pathlib import Path

import matplotlib.image
import numpy as np

from sdt_tools.scene.figure import layout_figure
from sdt_tools.scene.scenario import layout_for


def test_layouts_are_drawn_with_their_paths(tmp_path: Path) -> None:
    layouts = [layout_for("plain", 1000), layout_for("practice", 0)]
    path = np.column_stack([np.linspace(0, 3, 50), np.zeros(50), np.zeros(50)])

    layout_figure(layouts, [path, np.empty((0, 3))], tmp_path / "layouts.png")

    image = matplotlib.image.imread(tmp_path / "layouts.png")
    green = (image[..., 1] > 0.55) & (image[..., 0] < 0.3)
    assert green[:, : image.shape[1] // 2].sum() > green[:, image.shape[1] // 2 :].sum() > 0
