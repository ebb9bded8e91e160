"""The timing of a recording as a picture: intervals of each sensor, delay and drift, skew of scans and images."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Int64
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import DiskRefusedError, OutputExistsError
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN, SENSORS
from sdt_tools.recording.timing.pairs import TOLERANCE_NS, pair_skews
from sdt_tools.recording.timing.pauses import Pauses, spans_pause
from sdt_tools.recording.timing.stamps import StampLog, TopicStamps
from sdt_tools.recording.timing.topic import LATE, TopicTiming, topic_timing

_COLOURS: Final = {LIDAR_SCAN: "#2a6fbb", CAMERA_IMAGE: "#e07a2f", "other": "#2a9d8f"}
_GAP_COLOUR: Final = "#c62828"
_LOG_BEYOND: Final = 8
"""An interval of so many periods would press all others to the ground."""
_MS_NS: Final = 1_000_000
_MOST_POINTS: Final = 20_000
"""More would only make the picture slow: of longer series, the largest value of each stretch is drawn."""


def timing_figure(log: StampLog, pauses: Pauses, out: Path, title: str) -> None:
    """Draw what ``log`` saw of the sensors to the PNG ``out``; ``pauses`` are grey.

    Raises OutputExistsError where ``out`` exists, DiskRefusedError where it cannot be written.
    """
    if out.exists():
        raise OutputExistsError(out, "--plot")
    seen = dict(log.topics())
    sensors: dict[str, TopicStamps] = {name: seen[name] for name in SENSORS if name in seen}
    begin_ns = min((int(stamps.stamps_ns.min()) for stamps in sensors.values()), default=0)
    rows = len(sensors) + 1
    figure = Figure(figsize=(10.0, 2.3 * rows + 1.2), layout="constrained")
    grid = figure.add_gridspec(rows, 2, width_ratios=(1.6, 1.0))
    panels = {name: figure.add_subplot(grid[row, :]) for row, name in enumerate(sensors)}
    panels |= {name: figure.add_subplot(grid[-1, column]) for column, name in enumerate(("delay", "skew"))}
    for name, stamps in sensors.items():
        _draw_intervals(panels[name], name, stamps, begin_ns, pauses)
    _draw_delays(panels["delay"], sensors, begin_ns)
    _draw_skew(panels["skew"], sensors)
    for panel in panels.values():
        panel.grid(alpha=0.3)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title, fontsize=11)
    _save(figure, out)


def _draw_intervals(panel: Axes, name: str, stamps: TopicStamps, begin_ns: int, pauses: Pauses) -> None:
    """The interval before each message, and where it is a gap."""
    timing = topic_timing(stamps, periodic=True, pauses=pauses)
    in_order = np.argsort(stamps.stamps_ns, kind="stable")
    counts = ~spans_pause(stamps.received_ns[in_order], pauses)
    intervals_ns = np.diff(stamps.stamps_ns[in_order])[counts]
    ends_s = (stamps.stamps_ns[in_order][1:][counts] - begin_ns) / SECOND_NS
    shown = _peaks(intervals_ns)
    panel.plot(ends_s[shown], intervals_ns[shown] / _MS_NS, ".", markersize=3, color=_colour(name))
    for start_ns, end_ns in pauses:
        panel.axvspan((start_ns - begin_ns) / SECOND_NS, (end_ns - begin_ns) / SECOND_NS, color="#dee2e6")
    if timing.period_ns is not None:
        gap = intervals_ns > LATE * timing.period_ns
        panel.plot(
            ends_s[gap],
            intervals_ns[gap] / _MS_NS,
            "o",
            markersize=5,
            color=_GAP_COLOUR,
            label=f"gap: over {LATE:g} periods",
        )
        panel.axhline(timing.period_ns / _MS_NS, color="#444444", linewidth=0.8)
        if gap.any():
            panel.legend(frameon=False, fontsize=8, loc="upper right")
    _scale(panel, intervals_ns, timing)
    panel.set(ylabel="interval (ms)")
    panel.set_title(f"{name}: {_rate(timing)}", fontsize=10)


def _draw_delays(panel: Axes, sensors: Mapping[str, TopicStamps], begin_ns: int) -> None:
    """Host time less sensor time of each message, with the drift as a line through the middle."""
    for name, stamps in sensors.items():
        order = np.argsort(stamps.stamps_ns, kind="stable")
        stamps_ns = stamps.stamps_ns[order]
        delays_ns = (stamps.received_ns - stamps.stamps_ns)[order]
        drift = topic_timing(stamps, periodic=True).drift
        shown = _peaks(delays_ns)
        label = name if drift is None else f"{name}: {drift.ppm:+.1f} ppm"
        at_s = (stamps_ns - begin_ns) / SECOND_NS
        panel.plot(at_s[shown], delays_ns[shown] / _MS_NS, ".", markersize=2, color=_colour(name), alpha=0.5)
        panel.plot([], [], "-", color=_colour(name), label=label)
        if drift is not None:
            line_ns = np.median(delays_ns) + drift.ppm * 1e-6 * (stamps_ns - np.median(stamps_ns))
            panel.plot(at_s[[0, -1]], line_ns[[0, -1]] / _MS_NS, "-", color="#222222", linewidth=1.2)
    panel.set(xlabel="sensor time since the first message (s)", ylabel="delay (ms)")
    panel.set_title("from the sensor to the host, and its drift", fontsize=10)
    if sensors:
        panel.legend(frameon=False, fontsize=8)
    _at_least(panel, 1.0)


def _draw_skew(panel: Axes, sensors: Mapping[str, TopicStamps]) -> None:
    """How far the scan of each image is from it."""
    panel.set_title("image less its scan", fontsize=10)
    if LIDAR_SCAN not in sensors or CAMERA_IMAGE not in sensors:
        panel.text(0.5, 0.5, "no scans and images to pair", ha="center", va="center", transform=panel.transAxes)
        panel.set(xticks=[], yticks=[])
        return
    skews_ms = pair_skews(sensors[LIDAR_SCAN].stamps_ns, sensors[CAMERA_IMAGE].stamps_ns) / _MS_NS
    bound_ms = TOLERANCE_NS / _MS_NS
    panel.hist(skews_ms, np.linspace(-bound_ms, bound_ms, 41).tolist(), color="#7a5ea8")
    panel.set(xlabel="skew (ms)", ylabel="pairs", xlim=(-bound_ms, bound_ms))


def _peaks(values: Int64[np.ndarray, "values"]) -> Int64[np.ndarray, "shown"]:
    """Where the values to draw stand: all of few, of many the largest of each stretch."""
    if len(values) <= _MOST_POINTS:
        return np.arange(len(values))
    stretches = np.array_split(np.arange(len(values)), _MOST_POINTS)
    return np.array([stretch[np.argmax(values[stretch])] for stretch in stretches], np.int64)


def _scale(panel: Axes, intervals_ns: Int64[np.ndarray, "intervals"], timing: TopicTiming) -> None:
    """From nothing to beyond the longest interval; logarithmic where it would hide all others."""
    longest_ns = int(intervals_ns.max()) if intervals_ns.size else 0
    usual_ns = timing.period_ns or longest_ns
    if longest_ns > _LOG_BEYOND * usual_ns:
        panel.set_yscale("log")
        panel.set_ylim(usual_ns / _MS_NS / 4, longest_ns / _MS_NS * 2)
        panel.yaxis.set_major_formatter("{x:g}")
    else:
        panel.set_ylim(0.0, max(1.15 * longest_ns, 2.0 * usual_ns, 1.0) / _MS_NS)


def _rate(timing: TopicTiming) -> str:
    if timing.period_ns is None or timing.max_gap_ns is None:
        return f"{timing.count} messages"
    gaps = "1 gap" if timing.gaps == 1 else f"{timing.gaps} gaps"
    return (
        f"{timing.count} messages, one in {timing.period_ns / _MS_NS:.1f} ms; "
        f"{gaps}, {timing.missing} missing, longest interval {timing.max_gap_ns / _MS_NS:.1f} ms"
    )


def _at_least(panel: Axes, height: float) -> None:
    """Do not blow up what is all but constant."""
    low, high = panel.get_ylim()
    if high - low < height:
        middle = (low + high) / 2
        panel.set_ylim(middle - height / 2, middle + height / 2)


def _colour(name: str) -> str:
    return _COLOURS.get(name, _COLOURS["other"])


def _save(figure: Figure, out: Path) -> None:
    part = out.with_name(f".{out.name}.part")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(part, dpi=110, format="png")
        part.rename(out)
    except OSError as error:
        reason = error.strerror
        raise DiskRefusedError(f"{out}: the picture cannot be written: {reason}; choose another --plot") from None
    finally:
        with suppress(OSError):
            part.unlink()
