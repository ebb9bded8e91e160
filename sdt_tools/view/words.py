"""Words in the views: the state of the moment beside the scan and in the picture, and the legend."""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr
from jaxtyping import Int64

from sdt_tools.view import entities, palette
from sdt_tools.view.decisions import Labels, ModelTrack
from sdt_tools.view.palette import Rgb
from sdt_tools.view.timeline import Rows, changes, send, when

Line = tuple[str, Int64[np.ndarray, "_"], list[str]]
"""A line of words: its entity, and what it says at which stamps."""


def send_words(
    stream: rr.RecordingStream,
    lines: Sequence[Line],
    place: tuple[float, float],
    height: float,
    scan_stamps_ns: Int64[np.ndarray, "scans"],
) -> None:
    """Lines over time, one ``height`` below the other, the first at ``place``."""
    for number, (entity, stamps_ns, words) in enumerate(lines):
        told = changes(stamps_ns, words)
        at = [[place[0], place[1] + height * number]]
        style = rr.Points2D.from_fields(positions=at, radii=-0.1, show_labels=True, draw_order=20.0)
        stream.log(entity, style, static=True, strict=True)
        send_line(stream, entity, when(told.stamps_ns, scan_stamps_ns), told.states)


def scan_lines(labels: Labels, models: Sequence[ModelTrack]) -> list[Line]:
    """The label of scans and each follow network's answer of the moment."""
    told = [(entities.scan_words(track.model), track) for track in models if not track.of_pictures]
    return _lines(entities.SCAN_LABEL_WORDS, labels, told)


def picture_lines(labels: Labels, models: Sequence[ModelTrack]) -> list[Line]:
    """The label of pictures and each vision network's answer of the moment."""
    told = [(entities.camera_words(track.model), track) for track in models if track.of_pictures]
    return _lines(entities.CAMERA_LABEL_WORDS, labels, told)


def _lines(label_entity: str, labels: Labels, models: Sequence[tuple[str, ModelTrack]]) -> list[Line]:
    lines: list[Line] = []
    if labels.names:
        lines.append((label_entity, labels.stamps_ns, [f"label: {name}" for name in labels.names]))
    return lines + [(entity, track.stamps_ns, _answers(track)) for entity, track in models]


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
