"""One tag for each frame: which definition explains its error.

Precedence: systematic, conditional, transient, isolated, unexplained. An error inside a confirmed condition is called
transient only where its right neighbours make the condition an implausible cause.
"""

from dataclasses import dataclass

import numpy as np
import polars as pl
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.definitions import ErrorOptions, Tag, is_systematic, is_transient
from sdt_tools.error_analysis.distance import follows_closely
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.neighbours import NeighbourIndex, count_neighbours


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

    ``transient_by_definition`` is the literal Definition 1, whatever the tag. ``selection`` names the systematic
    selection that a frame belongs to, empty where there is none.
    """

    tag: tuple[Tag, ...]
    transient_by_definition: Bool[np.ndarray, "frames"]
    neighbours: Int64[np.ndarray, "frames"]
    right_neighbours: Int64[np.ndarray, "frames"]
    selection: tuple[str, ...]

    def count(self, tag: Tag) -> int:
        """Frames with ``tag``."""
        return self.tag.count(tag)


def error_neighbours(
    index: NeighbourIndex,
    frames: LabelledFrames,
    inside: Bool[np.ndarray, "conditions frames"],
    epsilon_m: float,
) -> ErrorNeighbours:
    """Count the neighbours of each error frame among all frames."""
    rows = np.flatnonzero(frames.wrong)
    groups = np.vstack([np.ones(len(frames.loss), bool), frames.right, inside])
    counts = count_neighbours(index, rows, epsilon_m, groups)
    return ErrorNeighbours(rows, counts[0], counts[1], counts[2:])


def tag_errors(
    frames: LabelledFrames,
    neighbours: ErrorNeighbours,
    inside: Bool[np.ndarray, "conditions frames"],
    options: ErrorOptions,
) -> Tagged:
    """Tag every frame; ``inside`` holds the frames of each confirmed condition."""
    wrong = frames.wrong
    selection = systematic_selections(frames, options)
    systematic = np.array([name != "" for name in selection])
    counts = _spread(neighbours.rows, neighbours.all, len(wrong))
    right_counts = _spread(neighbours.rows, neighbours.right, len(wrong))
    literal = is_transient(wrong, counts, right_counts)
    alone = ~beside_an_error(frames, options.max_gap_s)
    transient = literal & alone if options.guard else literal
    conditional = inside.any(axis=0)
    excused = transient & conditional & implausible_cause(frames, neighbours, inside, options)
    named = np.select(
        [~wrong, systematic, conditional & ~excused, transient, (counts == 0) & alone],
        [Tag.CORRECT, Tag.SYSTEMATIC, Tag.CONDITIONAL, Tag.TRANSIENT, Tag.ISOLATED],
        default=Tag.UNEXPLAINED,
    )
    return Tagged(tuple(Tag(name) for name in named.tolist()), literal, counts, right_counts, selection)


def beside_an_error(frames: LabelledFrames, max_gap_s: float) -> Bool[np.ndarray, "frames"]:
    """Frames with a frame just before or after them, in the same recording, that is not right."""
    follows = follows_closely(frames.recording, frames.stamp_ns, max_gap_s)
    beside = np.zeros(len(follows), bool)
    beside[1:] |= follows[1:] & ~frames.right[:-1]
    beside[:-1] |= follows[1:] & ~frames.right[1:]
    return beside


def systematic_selections(frames: LabelledFrames, options: ErrorOptions) -> tuple[str, ...]:
    """For each frame the widest selection that is systematically wrong (Definition 2), or an empty name."""
    names = np.full(len(frames.loss), "", dtype=object)
    for selection in sorted(options.selections, key=("all", "scenario", "recording").index, reverse=True):
        values = np.zeros(len(names)) if selection == "all" else frames.table[selection].fill_null("").to_numpy()
        for value in np.unique(values):
            rows = values == value
            if value == "" or rows.sum() < options.min_selection_frames:
                continue
            if is_systematic(frames.loss[rows], options.eta, options.tau):
                names[rows] = "all" if selection == "all" else f"{selection} = {value}"
    return tuple(names.tolist())


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
            "tag": [str(tag) for tag in tagged.tag],
            "definition1_transient": tagged.transient_by_definition,
            "neighbours": tagged.neighbours,
            "right_neighbours": tagged.right_neighbours,
            "systematic_selection": tagged.selection,
        }
    ).with_columns(
        pl.when(unknown).then(None).otherwise(pl.col("neighbours", "right_neighbours")).name.keep(),
        pl.when(pl.col("systematic_selection") != "").then(pl.col("systematic_selection")),
    )
