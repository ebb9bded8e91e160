"""One tag for each frame: which definition explains its error.

Precedence: systematic, conditional, transient, isolated, unexplained. An error inside a confirmed condition is called
transient only where its right neighbours make the condition an implausible cause.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
import polars as pl
from jaxtyping import Bool, Float64, Int64, UInt8, UInt32

from sdt_tools.error_analysis.definitions import ErrorOptions, Tag, is_systematic, is_transient
from sdt_tools.error_analysis.epsilon import follows_closely
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.spaces import Space
from sdt_tools.runs.local import Progress

TAGS: Final = tuple(Tag)


@dataclass(frozen=True, eq=False)
class ErrorNeighbours:
    """Neighbours within ε of each error frame: all, the right ones, and those inside each confirmed condition."""

    rows: Int64[np.ndarray, "errors"]
    all: Int64[np.ndarray, "errors"]
    right: Int64[np.ndarray, "errors"]
    inside: Int64[np.ndarray, "conditions errors"]


@dataclass(frozen=True, eq=False)
class Tagged:
    """What is said of every frame; neighbour counts are known of error frames only (-1 elsewhere).

    ``code`` is the place of the frame's tag in ``TAGS``. ``transient_by_definition`` is the literal Definition 1,
    whatever the tag. ``selection_code`` is the place in ``selections`` of the systematic selection that a frame belongs
    to; the first of them, an empty name, says that there is none.
    """

    code: UInt8[np.ndarray, "frames"]
    transient_by_definition: Bool[np.ndarray, "frames"]
    neighbours: Int64[np.ndarray, "frames"]
    right_neighbours: Int64[np.ndarray, "frames"]
    selection_code: UInt32[np.ndarray, "frames"]
    selections: tuple[str, ...]

    @property
    def tag(self) -> npt.NDArray[np.object_]:
        """The tag of each frame."""
        tags: npt.NDArray[np.object_] = np.array(TAGS, dtype=object)[self.code]
        return tags

    @property
    def selection(self) -> npt.NDArray[np.object_]:
        """The name of each frame's systematic selection, empty where there is none."""
        names: npt.NDArray[np.object_] = np.array(self.selections, dtype=object)[self.selection_code]
        return names

    def count(self, tag: Tag) -> int:
        """Frames with ``tag``."""
        return int(np.count_nonzero(self.code == TAGS.index(tag)))


def error_neighbours(
    space: Space,
    frames: LabelledFrames,
    inside: Bool[np.ndarray, "conditions frames"],
    epsilon: float,
    progress: Progress | None = None,
) -> ErrorNeighbours:
    """Count the neighbours of each error frame among all frames; ``progress`` hears of the error frames done."""
    rows = np.flatnonzero(frames.wrong)
    groups = np.vstack([np.ones(len(frames.loss), bool), frames.right, inside])
    counts = space.count(rows, epsilon, groups, progress)
    return ErrorNeighbours(rows, counts[0], counts[1], counts[2:])


def tag_errors(
    frames: LabelledFrames,
    neighbours: ErrorNeighbours,
    inside: Bool[np.ndarray, "conditions frames"],
    options: ErrorOptions,
) -> Tagged:
    """Tag every frame; ``inside`` holds the frames of each confirmed condition."""
    wrong = frames.wrong
    selection_code, selections = systematic_selections(frames, options)
    counts = _spread(neighbours.rows, neighbours.all, len(wrong))
    right_counts = _spread(neighbours.rows, neighbours.right, len(wrong))
    literal = is_transient(wrong, counts, right_counts)
    alone = ~beside_an_error(frames, options.max_gap_s)
    transient = literal & alone if options.guard else literal
    conditional = inside.any(axis=0)
    excused = transient & conditional & implausible_cause(frames, neighbours, inside, options)
    code = np.full(len(wrong), TAGS.index(Tag.UNEXPLAINED), np.uint8)
    for tag, rows in (  # the later ones go first
        (Tag.ISOLATED, (counts == 0) & alone),
        (Tag.TRANSIENT, transient),
        (Tag.CONDITIONAL, conditional & ~excused),
        (Tag.SYSTEMATIC, selection_code > 0),
        (Tag.CORRECT, ~wrong),
    ):
        code[rows] = TAGS.index(tag)
    return Tagged(code, literal, counts, right_counts, selection_code, selections)


def beside_an_error(frames: LabelledFrames, max_gap_s: float) -> Bool[np.ndarray, "frames"]:
    """Frames with a frame just before or after them, in the same recording, that is not right."""
    follows = follows_closely(frames.recording, frames.stamp_ns, max_gap_s)
    beside = np.zeros(len(follows), bool)
    beside[1:] |= follows[1:] & ~frames.right[:-1]
    beside[:-1] |= follows[1:] & ~frames.right[1:]
    return beside


def systematic_selections(
    frames: LabelledFrames, options: ErrorOptions
) -> tuple[UInt32[np.ndarray, "frames"], tuple[str, ...]]:
    """The widest selection that each frame belongs to and that is systematically wrong (Definition 2), and their names.

    The first name is empty: no such selection.
    """
    codes, names = np.zeros(len(frames.loss), np.uint32), [""]
    for selection in sorted(options.selections, key=("all", "scenario", "recording").index, reverse=True):
        values = pl.repeat("all", len(codes), eager=True) if selection == "all" else frames.table[selection]
        found = _systematic_values(values, frames.loss, options)
        places = {value: place for place, value in enumerate(found, start=len(names))}
        names += found if selection == "all" else [f"{selection} = {value}" for value in found]
        if found:
            here = values.replace_strict(places, default=0, return_dtype=pl.UInt32).to_numpy()
            codes = np.where(here > 0, here, codes)
    return codes, tuple(names)


def _systematic_values(values: pl.Series, loss: Float64[np.ndarray, "frames"], options: ErrorOptions) -> list[str]:
    """The values whose frames, enough of them, are systematically wrong."""
    groups = pl.DataFrame({"value": values, "loss": loss}).drop_nulls("value").filter(pl.col("value") != "")
    losses = groups.group_by("value").agg(pl.col("loss")).sort("value")
    return [
        value
        for value, one in losses.iter_rows()
        if len(one) >= options.min_selection_frames and is_systematic(np.array(one), options.eta, options.tau)
    ]


def implausible_cause(
    frames: LabelledFrames,
    neighbours: ErrorNeighbours,
    inside: Bool[np.ndarray, "conditions frames"],
    options: ErrorOptions,
) -> Bool[np.ndarray, "frames"]:
    """Frames whose neighbours inside each of their conditions would, under its error rate, hardly all be right.

    Successive frames of a condition are wrong together, so its neighbours count as fewer independent ones:
    (1 - ρ) / (1 + ρ) of them, ρ being the correlation of successive errors inside.
    """
    implausible = np.ones(len(frames.loss), bool)
    for members, counts in zip(inside, neighbours.inside, strict=True):
        rate = float(frames.wrong[members].mean())
        correlation = _successive_correlation(frames, members, rate)
        known = np.maximum(_spread(neighbours.rows, counts, len(members)), 0)
        independent = known * (1.0 - correlation) / (1.0 + correlation)
        implausible &= ~members | ((1.0 - rate) ** independent <= options.conditions.implausible)
    return implausible


def _successive_correlation(frames: LabelledFrames, members: Bool[np.ndarray, "frames"], rate: float) -> float:
    """Correlation of errors of successive frames that both lie inside, within [0, 0.98]."""
    both = members[1:] & members[:-1] & (np.diff(frames.recording) == 0)
    spread = rate * (1.0 - rate)
    if spread == 0.0 or not both.any():
        return 0.0
    deviation: Float64[np.ndarray, "frames"] = frames.wrong - rate
    return float(np.clip(np.mean((deviation[1:] * deviation[:-1])[both]) / spread, 0.0, 0.98))


def _spread(
    rows: Int64[np.ndarray, "errors"], counts: Int64[np.ndarray, "errors"], frames: int
) -> Int64[np.ndarray, "frames"]:
    """Counts of some rows over all frames, -1 elsewhere."""
    spread = np.full(frames, -1, np.int64)
    spread[rows] = counts
    return spread


def tag_columns(tagged: Tagged, errors: Bool[np.ndarray, "frames"]) -> pl.DataFrame:
    """The tags as columns; neighbour counts are null for frames that are not wrong."""
    unknown = pl.Series(~errors)
    return pl.DataFrame(
        {
            "tag": _named(tagged.code, tuple(map(str, TAGS))),
            "definition1_transient": tagged.transient_by_definition,
            "neighbours": tagged.neighbours,
            "right_neighbours": tagged.right_neighbours,
            "systematic_selection": _named(tagged.selection_code, (None, *tagged.selections[1:])),
        }
    ).with_columns(pl.when(unknown).then(None).otherwise(pl.col("neighbours", "right_neighbours")).name.keep())


def _named(
    codes: UInt8[np.ndarray, "frames"] | UInt32[np.ndarray, "frames"], names: tuple[str | None, ...]
) -> pl.Series:
    return pl.Series(names, dtype=pl.String).gather(pl.Series(codes, dtype=pl.UInt32))
