"""From frames to confirmed conditions: found on one half of the recordings, confirmed on the other."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int64, Shaped

from sdt_tools.error_analysis.conditions.confirmation import Recordings, Verdict, confirm
from sdt_tools.error_analysis.conditions.discovery import discover
from sdt_tools.error_analysis.conditions.predicates import Features, features_of
from sdt_tools.error_analysis.conditions.scoring import scope_of
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.labelled import LabelledFrames

RANDOM_SPLITS = 64
"""Splits of the recordings among which the most balanced is taken."""


@dataclass(frozen=True, eq=False)
class ConditionSearch:
    """What a search found.

    ``verdicts``: all candidates, as the confirming half judged them. ``inside``: the frames (of both halves) of each
    confirmed one. ``note`` says why nothing can be confirmed, where that is so.
    """

    verdicts: tuple[Verdict, ...]
    inside: Bool[np.ndarray, "conditions frames"]
    features: tuple[str, ...]
    unavailable: tuple[str, ...]
    note: str

    @property
    def confirmed(self) -> tuple[Verdict, ...]:
        """The conditions that hold."""
        return tuple(verdict for verdict in self.verdicts if verdict.confirmed)


def find_conditions(frames: LabelledFrames, options: ErrorOptions) -> ConditionSearch:
    """Conditions under which the frames are wrong. Raises UsageError for a feature that predictions do not have."""
    features = features_of(frames.table, options.conditions.features)
    names = (*features.numeric, *features.codes)
    rng = np.random.default_rng(options.seed)
    note = _nothing_to_confirm(frames, options)
    if note or not names:
        empty = np.zeros((0, features.frames), bool)
        return ConditionSearch((), empty, names, features.unavailable, note or "no feature tells frames apart")
    half = split_recordings(frames, features, rng)[frames.recording]
    scope = scope_of(features.take(half), frames.loss[half], frames.wrong[half], options.eta, options.conditions)
    candidates = discover(scope, frames.recording[half])
    masks = [candidate.mask(features) for candidate in candidates]
    others = Recordings(frames.loss[~half], frames.wrong[~half], frames.recording[~half])
    verdicts = confirm(candidates, [mask[~half] for mask in masks], others, options.eta, options.conditions, rng)
    confirmed = [mask for mask, verdict in zip(masks, verdicts, strict=True) if verdict.confirmed]
    inside = np.array(confirmed, dtype=bool).reshape(len(confirmed), features.frames)
    return ConditionSearch(tuple(verdicts), inside, names, features.unavailable, "")


def split_recordings(
    frames: LabelledFrames, features: Features, rng: np.random.Generator
) -> Bool[np.ndarray, "recordings"]:
    """Which recordings conditions are searched on: half of them.

    A light or scenario that only a few recordings have must occur in both halves. So of many random splits, each of
    which halves every scenario, the one is taken whose halves differ least in all categories. Errors play no part.
    """
    first_rows = np.flatnonzero(np.diff(frames.recording, prepend=-1))
    scenarios = frames.table["scenario"].fill_null("")[first_rows].to_numpy()
    occurs = [
        np.bincount(frames.recording[codes == code], minlength=frames.recordings)
        for name, codes in features.codes.items()
        for code in range(len(features.categories[name]))
    ]
    shares = np.array([counts / max(counts.sum(), 1) for counts in occurs]).reshape(len(occurs), frames.recordings)
    splits = [_random_split(scenarios, rng) for _ in range(RANDOM_SPLITS)]
    return min(splits, key=lambda chosen: float(np.square(shares @ np.where(chosen, 1.0, -1.0)).sum()))


def _random_split(
    scenarios: Shaped[np.ndarray, "recordings"], rng: np.random.Generator
) -> Bool[np.ndarray, "recordings"]:
    """Every second of a random order within each scenario."""
    shuffled = rng.permutation(len(scenarios))
    ordered: Int64[np.ndarray, "recordings"] = shuffled[np.argsort(scenarios[shuffled], kind="stable")]
    chosen = np.zeros(len(scenarios), bool)
    chosen[ordered[::2]] = True
    return chosen


def _nothing_to_confirm(frames: LabelledFrames, options: ErrorOptions) -> str:
    needed = options.conditions.min_recordings_total
    if frames.recordings < needed:
        return (
            f"recordings: {frames.recordings}; no condition can be confirmed with fewer than {needed}, "
            "since those that it is found on cannot confirm it"
        )
    if not frames.wrong.any():
        return "no errors, so no condition"
    if frames.wrong.all():
        return "every frame is wrong, so no condition sets some apart"
    return ""
