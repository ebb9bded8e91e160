"""Example frames of each tag, drawn by lot, with the frames nearest to them and their scans."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64

from sdt_tools.clock import SECOND_NS
from sdt_tools.error_analysis.definitions import ERROR_TAGS, ErrorOptions, Tag
from sdt_tools.error_analysis.explain import Explanation
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.report.nearest import nearest_frames
from sdt_tools.recording.messages.topics import LIDAR_SCAN
from sdt_tools.recording.reader import Recording

EXAMPLES: Final = 4
"""Of each tag, and of each condition."""
NEIGHBOURS: Final = 3
DELIVERY_NS: Final = 2 * SECOND_NS
"""A scan is looked for among what was received at most this long before and after its stamp; else in the whole file."""


@dataclass(frozen=True, eq=False)
class Neighbour:
    """A frame within ε of an example."""

    recording: str
    stamp_ns: int
    distance_m: float
    label: str
    predicted: str
    right: bool
    ranges_m: Float64[np.ndarray, "rays"]


@dataclass(frozen=True, eq=False)
class Example:
    """A wrong frame as people look at it: scans as the sensor gave them.

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
    ranges_m: Float64[np.ndarray, "rays"]


def draw_examples(
    frames: LabelledFrames,
    explanation: Explanation,
    scans: Float32[np.ndarray, "frames rays"],
    paths: Sequence[Path],
    options: ErrorOptions,
) -> dict[Tag, list[Example]]:
    """Up to ``EXAMPLES`` frames of each error tag (of each condition, where conditional), by the seed in ``options``.

    ``scans`` are the situations of ``frames``, ``paths`` their recordings in order. Frames of different recordings go
    first. Raises RecordingError where a recording cannot be read any more.
    """
    chosen = _choose(frames, explanation, np.random.default_rng(options.seed))
    rows = np.array([row for group in chosen.values() for row in group], np.int64)
    near = nearest_frames(scans, rows, explanation.epsilon.epsilon_m, NEIGHBOURS)
    nearest = dict(zip(rows.tolist(), near, strict=True))
    wanted = sorted({row for row, others in nearest.items() for row in (row, *(other.row for other in others))})
    ranges_m = _ranges(frames, np.array(wanted, np.int64), paths)

    def neighbour(row: int, distance_m: float) -> Neighbour:
        values = frames.table.row(row, named=True)
        return Neighbour(
            recording=values["recording"],
            stamp_ns=values["stamp_ns"],
            distance_m=distance_m,
            label=values["label"],
            predicted=values["predicted"],
            right=bool(frames.right[row]),
            ranges_m=ranges_m[row],
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
            nearest=tuple(neighbour(other.row, other.distance_m) for other in nearest[row]),
            ranges_m=ranges_m[row],
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


def _ranges(
    frames: LabelledFrames, rows: Int64[np.ndarray, "wanted"], paths: Sequence[Path]
) -> Mapping[int, Float64[np.ndarray, "rays"]]:
    """The scans of some rows, as the sensor gave them."""
    found: dict[int, Float64[np.ndarray, "rays"]] = {}
    for number in np.unique(frames.recording[rows]).tolist():
        own = rows[frames.recording[rows] == number]
        with Recording.open(paths[number]) as recording:
            missing = {}
            for row in own.tolist():
                stamp_ns = int(frames.stamp_ns[row])
                around = recording.messages((LIDAR_SCAN,), stamp_ns - DELIVERY_NS, stamp_ns + DELIVERY_NS)
                scan = next((m.message for m in around if m.message.stamp_ns == stamp_ns), None)
                if scan is None:
                    missing[stamp_ns] = row
                else:
                    found[row] = scan.ranges_m  # type: ignore[union-attr]
            for batch in recording.scan_batches() if missing else ():
                for place in np.flatnonzero(np.isin(batch.stamps_ns, list(missing))).tolist():
                    found[missing[int(batch.stamps_ns[place])]] = batch.ranges_m[place].copy()
    return found
