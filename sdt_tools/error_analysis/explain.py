"""Frames and their scans in, an explanation of every error out: no files."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

from sdt_tools.error_analysis.conditions.search import ConditionSearch, find_conditions
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.distance import Epsilon, estimate_epsilon
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.neighbours import build_index
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
    scans: Float32[np.ndarray, "frames rays"],
    options: ErrorOptions,
    progress: Progress | None = None,
) -> Explanation:
    """Tag every frame; ``scans`` are the frames' situations (``distance.situations``), row by row.

    ``progress`` hears of the error frames whose neighbours are counted. Raises UsageError where ε cannot be estimated
    or a feature does not exist.
    """
    epsilon = estimate_epsilon(scans, frames.recording, frames.stamp_ns, options)
    search = find_conditions(frames, options)
    neighbours = error_neighbours(build_index(scans), frames, search.inside, epsilon.epsilon_m, progress)
    return Explanation(epsilon, search, tag_errors(frames, neighbours, search.inside, options))
