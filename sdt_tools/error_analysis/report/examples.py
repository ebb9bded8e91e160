"""Example frames of each tag, drawn by lot, with the frames nearest to them, and their scans or pictures."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Bool, Int64

from sdt_tools.error_analysis.definitions import ERROR_TAGS, ErrorOptions, Tag
from sdt_tools.error_analysis.explain import Explanation
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.report.seen import Seen, seen_at
from sdt_tools.error_analysis.spaces import Space

EXAMPLES: Final = 4
"""Of each tag, and of each condition."""
NEIGHBOURS: Final = 3


@dataclass(frozen=True, eq=False)
class Neighbour:
    """A frame within ε of an example; ``distance`` is told with its unit."""

    recording: str
    stamp_ns: int
    distance: str
    label: str
    predicted: str
    right: bool
    seen: Seen


@dataclass(frozen=True, eq=False)
class Example:
    """A wrong frame as people look at it: a scan as the sensor gave it, or a picture.

    ``conditions`` numbers the confirmed conditions that it lies in, from 1; ``neighbours`` and ``right_neighbours``
    count all that are within ε, of which ``nearest`` are some.
    """

    tag: Tag
    path: Path
    recording: str
    stamp_ns: int
    label: str
    predicted: str
    loss: float
    operator_range_m: float | None
    operator_bearing_rad: float | None
    conditions: tuple[int, ...]
    neighbours: int
    right_neighbours: int
    nearest: tuple[Neighbour, ...]
    seen: Seen


def draw_examples(
    frames: LabelledFrames,
    explanation: Explanation,
    space: Space,
    paths: Sequence[Path],
    options: ErrorOptions,
) -> dict[Tag, list[Example]]:
    """Up to ``EXAMPLES`` frames of each error tag (of each condition, where conditional), by the seed in ``options``.

    ``space`` is what ``frames`` lie in, ``paths`` are their recordings in order. Frames of different recordings go
    first. Raises RecordingError where a recording cannot be read any more.
    """
    chosen = _choose(frames, explanation, np.random.default_rng(options.seed))
    rows = np.array([row for group in chosen.values() for row in group], np.int64)
    near = space.nearest(rows, explanation.epsilon.value, NEIGHBOURS)
    nearest = dict(zip(rows.tolist(), near, strict=True))
    wanted = sorted({row for row, others in nearest.items() for row in (row, *(other.row for other in others))})
    seen = seen_at(frames, np.array(wanted, np.int64), paths)

    def neighbour(row: int, distance: float) -> Neighbour:
        values = frames.table.row(row, named=True)
        return Neighbour(
            recording=values["recording"],
            stamp_ns=values["stamp_ns"],
            distance=space.measure.text(distance),
            label=values["label"],
            predicted=values["predicted"],
            right=bool(frames.right[row]),
            seen=seen[row],
        )

    def example(tag: Tag, row: int) -> Example:
        values = frames.table.row(row, named=True)
        return Example(
            tag=tag,
            path=paths[int(frames.recording[row])],
            recording=values["recording"],
            stamp_ns=values["stamp_ns"],
            label=values["label"],
            predicted=values["predicted"],
            loss=float(frames.loss[row]),
            operator_range_m=values["operator_range_m"],
            operator_bearing_rad=values["operator_bearing_rad"],
            conditions=tuple(int(n) for n in 1 + np.flatnonzero(explanation.search.inside[:, row])),
            neighbours=int(explanation.tagged.neighbours[row]),
            right_neighbours=int(explanation.tagged.right_neighbours[row]),
            nearest=tuple(neighbour(other.row, other.distance) for other in nearest[row]),
            seen=seen[row],
        )

    return {tag: [example(tag, row) for row in group] for tag, group in chosen.items()}


def _choose(frames: LabelledFrames, explanation: Explanation, rng: np.random.Generator) -> dict[Tag, list[int]]:
    """Rows of each error tag that occurs."""
    tags = np.array(explanation.tagged.tag, dtype=object)
    chosen: dict[Tag, list[int]] = {}
    for tag in ERROR_TAGS:
        tagged = tags == tag
        if not tagged.any():
            continue
        parts = [tagged & inside for inside in explanation.search.inside] if tag is Tag.CONDITIONAL else [tagged]
        rows = [row for part in parts for row in _some(part, frames.recording, rng)]
        chosen[tag] = list(dict.fromkeys(rows))
    return chosen


def _some(
    part: Bool[np.ndarray, "frames"], recording: Int64[np.ndarray, "frames"], rng: np.random.Generator
) -> list[int]:
    """A few of the frames, no two of one recording as long as there are others."""
    shuffled = rng.permutation(np.flatnonzero(part))
    _, first = np.unique(recording[shuffled], return_index=True)
    alone = np.sort(first)
    order = np.concatenate([alone, np.setdiff1d(np.arange(len(shuffled)), alone)])
    rows: list[int] = shuffled[order][:EXAMPLES].tolist()
    return rows
