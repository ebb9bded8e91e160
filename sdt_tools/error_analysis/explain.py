"""Frames and the space they lie in, in; an explanation of every error out: no files."""

from dataclasses import dataclass

from sdt_tools.error_analysis.conditions.search import ConditionSearch, find_conditions
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.epsilon import Epsilon, estimate_epsilon
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.spaces import Space
from sdt_tools.error_analysis.tagging import Tagged, error_neighbours, tag_errors
from sdt_tools.runs.local import Progress


@dataclass(frozen=True, eq=False)
class Explanation:
    """ε, conditions and tags of the frames of one model."""

    epsilon: Epsilon
    search: ConditionSearch
    tagged: Tagged


def explain(
    frames: LabelledFrames,
    space: Space,
    options: ErrorOptions,
    progress: Progress | None = None,
) -> Explanation:
    """Tag every frame; ``space`` tells which are neighbours, row by row.

    ``progress`` hears of the error frames whose neighbours are counted. Raises UsageError where ε cannot be estimated
    or a feature does not exist.
    """
    epsilon = estimate_epsilon(space, frames.recording, frames.stamp_ns, options)
    search = find_conditions(frames, options)
    neighbours = error_neighbours(space, frames, search.inside, epsilon.value, progress)
    return Explanation(epsilon, search, tag_errors(frames, neighbours, search.inside, options))
