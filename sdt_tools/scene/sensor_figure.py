"""The sensor model beside the real sensor, as a picture."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sdt_tools.scene.sensor import SensorConfig
from sdt_tools.scene.sensor_fit import (
    NOISE_BINS_M,
    coded,
    coded_share,
    model_drives,
    noise_at_rest,
    run_lengths,
    standing_truths,
)

_REAL, _MODEL = "#343a40", "#d62828"
Drives = Sequence[Float64[np.ndarray, "_ rays"]]


def sensor_figure(drives_m: Drives, out: Path, config: SensorConfig | None = None, seed: int = 0) -> None:
    """Draw to the PNG ``out`` how codes and noise of real drives, ``[scans, 541]`` each, compare with the model's.

    The model makes as many drives of the same lengths, their scans 0.1 s apart.
    """
    truths = standing_truths([len(drive) for drive in drives_m], np.random.default_rng(seed))
    model = model_drives(truths, SensorConfig() if config is None else config, seed)
    figure = Figure(figsize=(11, 7), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2)
    _draw_shares(panels[0, 0], drives_m, model)
    _draw_courses(panels[0, 1], drives_m, model)
    _draw_runs(panels[1, 0], drives_m, model)
    _draw_noise(panels[1, 1], drives_m, model)
    figure.suptitle(f"SICK LMS1xx: {len(drives_m)} real drives (grey) and the sensor model (red)")
    figure.savefig(out, dpi=100)


def _draw_shares(panel: Axes, real: Drives, model: Drives) -> None:
    for drives, colour, name in ((real, _REAL, "real"), (model, _MODEL, "model")):
        shares = [coded_share(drive) for drive in drives]
        pooled = np.sort(np.concatenate(shares)) * 100
        panel.plot(pooled, np.linspace(0, 1, len(pooled)), color=colour, label=f"{name}, all scans")
        means = np.sort([share.mean() for share in shares]) * 100
        panel.plot(means, np.linspace(0, 1, len(means)), "--", color=colour, label=f"{name}, means of drives")
    panel.set(xlabel="coded rays, %", ylabel="share of scans (drives) below", title="Codes a scan", ylim=(0, 1.02))
    panel.legend(loc="lower right")


def _draw_courses(panel: Axes, real: Drives, model: Drives) -> None:
    for drives, colour, side in ((real, _REAL, 1), (model, _MODEL, -1)):
        for drive in drives[:8]:
            panel.plot(
                np.arange(len(drive)) / 10, side * coded_share(drive) * 100, color=colour, alpha=0.6, linewidth=1
            )
    panel.axhline(0, color="#adb5bd", linewidth=0.8)
    panel.set(xlabel="s", ylabel="coded rays, % (model downwards)", title="How codes come and go, eight drives each")


def _draw_runs(panel: Axes, real: Drives, model: Drives) -> None:
    edges = np.array([1, 2, 3, 4, 6, 10, 15, 20, 30, 61])
    for drives, colour, shift in ((real, _REAL, -0.2), (model, _MODEL, 0.2)):
        lengths = np.concatenate([run_lengths(coded(drive)) for drive in drives])
        share = np.histogram(lengths, edges)[0] / max(len(lengths), 1)
        panel.bar(np.arange(len(share)) + shift, share, 0.4, color=colour)
    names = [f"{a}" if b - a == 1 else f"{a}–{b - 1}" for a, b in pairwise(edges.tolist())]
    panel.set_xticks(range(len(names)), names)
    panel.set(xlabel="neighbouring coded rays", ylabel="share of runs", title="Runs of codes")


def _draw_noise(panel: Axes, real: Drives, model: Drives) -> None:
    middle = (np.array(NOISE_BINS_M[1:]) + np.array(NOISE_BINS_M[:-1])) / 2
    panel.plot(middle, noise_at_rest(real) * 1000, "o", color=_REAL)
    panel.plot(middle, noise_at_rest(model) * 1000, "-", color=_MODEL)
    panel.set(xlabel="range, m", ylabel="standard deviation, mm", title="Noise of a ray, robot at rest", ylim=(0, 14))
