"""Words in the views: the state of the moment beside the scan, and the legend."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import rerun as rr
from jaxtyping import Int64

from sdt_tools.view import entities, palette
from sdt_tools.view.decisions import Labels, ModelTrack
from sdt_tools.view.palette import Rgb
from sdt_tools.view.timeline import Rows, changes, send, when

LINE_HEIGHT: Final = 0.075
"""Height of a line beside the scan, as a share of the reach."""


def send_words(
    stream: rr.RecordingStream,
    labels: Labels,
    models: Sequence[ModelTrack],
    reach_m: float,
    scan_stamps_ns: Int64[np.ndarray, "scans"],
) -> None:
    """The label and each model's answer of the moment, one below the other at the top left of the scan."""
    for number, (entity, stamps_ns, words) in enumerate(lines_of(labels, models)):
        place = [[-0.7 * reach_m, (-0.96 + LINE_HEIGHT * number) * reach_m]]
        told = changes(stamps_ns, words)
        style = rr.Points2D.from_fields(positions=place, radii=-0.1, show_labels=True, draw_order=20.0)
        stream.log(entity, style, static=True, strict=True)
        send_line(stream, entity, when(told.stamps_ns, scan_stamps_ns), told.states)


def lines_of(labels: Labels, models: Sequence[ModelTrack]) -> list[tuple[str, Int64[np.ndarray, "samples"], list[str]]]:
    """The lines: for each its entity, and what it says at which stamps."""
    lines: list[tuple[str, Int64[np.ndarray, "samples"], list[str]]] = []
    if labels.names:
        lines.append((entities.SCAN_LABEL_WORDS, labels.stamps_ns, [f"label: {name}" for name in labels.names]))
    return lines + [(entities.scan_words(track.model), track.stamps_ns, _answers(track)) for track in models]


def send_line(stream: rr.RecordingStream, entity: str, rows: Rows, words: Sequence[str]) -> None:
    """What one line says; nothing where it is empty."""
    colors = palette.packed(_color_of(state) for state in words)
    send(stream, entity, rows, [*rr.Points2D.columns(labels=words), *rr.Points2D.columns(colors=colors)])


def _answers(track: ModelTrack) -> list[str]:
    rows = zip(track.predicted, track.statuses(), strict=True)
    return [
        f"{track.model}: {predicted}" + ("" if status == palette.UNLABELED else f" ({status})")
        for predicted, status in rows
    ]


def _color_of(line: str) -> Rgb:
    status = line.rpartition("(")[2].rstrip(")")
    return palette.STATUSES.get(status, palette.LABEL)


def draw_legend(stream: rr.RecordingStream, entries: Mapping[str, Rgb]) -> None:
    """What the colours stand for: one dot and one line each, a unit apart, from top to bottom."""
    for number, (text, color) in enumerate(entries.items()):
        dot = rr.Points2D([[0.0, number + 0.3]], radii=-6.0, colors=color, labels=text, show_labels=True)
        stream.log(f"{entities.LEGEND}/{number:02d}", dot, static=True, strict=True)
