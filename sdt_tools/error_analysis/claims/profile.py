"""What errors of certified networks are like: conditional, and made during forward motion.

The rules, fixed before data were looked at; units of resampling are recordings, errors of a level's networks pooled.

- *Forward*: the number that decides is the share of errors on frames whose right motion is a forward one, less the
  share of all frames that are such. Supported where its interval lies above 0, contradicted where it lies below.
  Whether all errors are such, as the paper saw, is among the numbers.
- *Conditional*: the number that decides is the share of errors that are conditional: by their tags where tags are
  given, else those inside a confirmed condition. Supported where its interval lies above ``most``, contradicted where
  it lies below. Undecided where no condition can be confirmed (few recordings).

Both are undecided with fewer than ``min_recordings`` recordings.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import polars as pl
from jaxtyping import Bool

from sdt_tools.error_analysis.claims.material import Material
from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, at_least, reason_of, undecided
from sdt_tools.error_analysis.conditions.search import find_conditions
from sdt_tools.error_analysis.definitions import Tag
from sdt_tools.error_analysis.resampling import Estimate, difference_of_ratios, estimate, ratio
from sdt_tools.error_analysis.side_by_side import KEYS
from sdt_tools.frames import FORWARD_CLASSES
from sdt_tools.runs.local import Progress

FORWARD: Final = "forward"
CONDITIONAL: Final = "conditional"
STATEMENTS: Final = {
    FORWARD: "Errors of certified networks occur during forward motion.",
    CONDITIONAL: "Errors of certified networks are conditional.",
}
PICTURE: Final = "profile.png"
_FORWARD_NAMES: Final = [motion.label for motion in FORWARD_CLASSES]


def judge_forward(material: Material, options: ClaimOptions) -> list[ClaimVerdict]:
    """A verdict for each certified level."""
    if not material.certified_levels:
        return [undecided(FORWARD, "", STATEMENTS[FORWARD], "no network that was held to safety domains was given")]
    return [_judge_forward(material, level, options) for level in material.certified_levels]


def _judge_forward(material: Material, level: int, options: ClaimOptions) -> ClaimVerdict:
    forward = np.isin(material.frames.column("motion").astype(str), _FORWARD_NAMES)
    errors = material.mean_loss(level, "zero_one")
    count = int(material.frames.wrong[material.places(level)].sum())
    about = f"level {level}"
    if material.frames.recordings < options.min_recordings or count == 0:
        reason = f"{count} errors in {material.frames.recordings} recordings"
        return undecided(FORWARD, about, STATEMENTS[FORWARD], reason, frames=count)
    beyond = _beyond_base(material, errors, forward)
    share = _share(material, errors, forward)
    finding = at_least(beyond, 0.0)
    numbers: dict[str, Any] = {
        "errors": count,
        "share": share.document(),
        "base": _share(material, np.ones_like(errors), forward).document(),
        "error_rate_forward": _share(material, forward.astype(float), errors).document(),
        "error_rate_elsewhere": _share(material, (~forward).astype(float), errors).document(),
        "only_forward": bool(share.low >= 1.0 - options.nested_tolerance),
        "rates_by_motion": _rates(material, level),
    }
    if material.places(0):
        standard = material.mean_loss(0, "zero_one")
        added = errors * (1.0 - standard)
        numbers |= {
            "share_standard": _share(material, standard, forward).document(),
            "share_of_added": _share(material, added, forward).document(),
            "added_beyond_base": _beyond_base(material, added, forward).document(),
            "rates_by_motion_standard": _rates(material, 0),
        }
    return ClaimVerdict(
        claim=FORWARD,
        about=about,
        statement=STATEMENTS[FORWARD],
        finding=finding,
        reason=f"{share.value:.0%} of errors, {numbers['base']['value']:.0%} of frames; "
        + reason_of(finding, "more than their share", "less than their share"),
        measure="share of forward frames among errors, less that among all frames",
        estimate=beyond,
        frames=count,
        recordings=material.frames_with(errors > 0)[1],
        picture=PICTURE,
        numbers=numbers,
    )


@dataclass(frozen=True, eq=False)
class _Explained:
    """The conditional errors of each of a level's networks, its conditions in words, and why there can be none."""

    conditional: Bool[np.ndarray, "networks frames"]
    wrong: Bool[np.ndarray, "networks frames"]
    conditions: tuple[str, ...]
    note: str

    def share(self, material: Material, which: slice = slice(None)) -> Estimate:
        """Share of the errors of some networks that are conditional."""
        parts = [values[which].sum(axis=0, dtype=np.float64) for values in (self.conditional, self.wrong)]
        return estimate(material.sums(np.array(parts)), ratio, material.draws)


def judge_conditional(
    material: Material, tags: Mapping[str, pl.DataFrame], options: ClaimOptions, progress: Progress | None = None
) -> list[ClaimVerdict]:
    """A verdict for each certified level; ``tags`` are tag tables by model, for those that were tagged."""
    if not material.certified_levels:
        reason = "no network that was held to safety domains was given"
        return [undecided(CONDITIONAL, "", STATEMENTS[CONDITIONAL], reason)]
    explained = {}
    for done, level in enumerate(material.levels):
        if progress:
            progress(done, len(material.levels))
        explained[level] = _explain(material, level, tags, options)
    if progress:
        progress(len(material.levels), len(material.levels))
    return [_judge_conditional(material, level, explained, options) for level in material.certified_levels]


def _explain(material: Material, level: int, tags: Mapping[str, pl.DataFrame], options: ClaimOptions) -> _Explained:
    """By tags where all networks of the level have them, else by conditions of what they have in common."""
    places = material.places(level)
    names = [material.networks[place].name for place in places]
    wrong = material.frames.wrong[places]
    if all(name in tags for name in names):
        keys = material.frames.table.select(KEYS)
        rows = [keys.join(tags[name], on=KEYS, how="left", maintain_order="left")["tag"] for name in names]
        tagged = np.array([(row == Tag.CONDITIONAL.value).fill_null(value=False).to_numpy() for row in rows])
        return _Explained(tagged & wrong, wrong, (), "")
    search = find_conditions(material.labelled_level(level, options), options.errors)
    inside = search.inside.any(axis=0)
    return _Explained(wrong & inside, wrong, tuple(one.condition.text for one in search.confirmed), search.note)


def _judge_conditional(
    material: Material, level: int, explained: Mapping[int, _Explained], options: ClaimOptions
) -> ClaimVerdict:
    mine = explained[level]
    about, count = f"level {level}", int(mine.wrong.sum())
    if mine.note or material.frames.recordings < options.min_recordings:
        reason = mine.note or f"{material.frames.recordings} recordings"
        return undecided(CONDITIONAL, about, STATEMENTS[CONDITIONAL], reason, frames=count)
    share = mine.share(material)
    finding = at_least(share, options.most)
    numbers: dict[str, Any] = {
        "errors": count,
        "share": share.document(),
        "conditions": list(mine.conditions),
        "shares_of_networks": {
            material.networks[place].name: mine.share(material, slice(number, number + 1)).document()
            for number, place in enumerate(material.places(level))
        },
    }
    if 0 in explained:
        numbers["share_standard"] = explained[0].share(material).document()
        numbers["conditions_standard"] = list(explained[0].conditions)
    return ClaimVerdict(
        claim=CONDITIONAL,
        about=about,
        statement=STATEMENTS[CONDITIONAL],
        finding=finding,
        reason=f"{share.value:.0%} of errors; "
        + reason_of(finding, f"more than {options.most:.0%}", f"less than {options.most:.0%}"),
        measure="share of errors that are conditional",
        estimate=share,
        frames=count,
        recordings=material.frames_with(np.asarray(mine.wrong.any(axis=0)))[1],
        picture=PICTURE,
        numbers=numbers,
    )


def _share(material: Material, weights: np.ndarray, where: np.ndarray) -> Estimate:
    """The part of the weight of all frames that lies on frames ``where``."""
    return estimate(material.sums(np.array([weights * where, weights])), ratio, material.draws)


def _beyond_base(material: Material, errors: np.ndarray, where: Bool[np.ndarray, "frames"]) -> Estimate:
    """Share of errors on frames ``where``, less the share of frames that are such."""
    sums = material.sums(np.array([errors * where, errors, where * 1.0, np.ones(len(where))]))
    return estimate(sums, difference_of_ratios, material.draws)


def _rates(material: Material, level: int) -> dict[str, dict[str, float | None]]:
    """Error rate of each right motion."""
    motion = material.frames.column("motion").astype(str)
    errors = material.mean_loss(level, "zero_one")
    names = [name for name in np.unique(motion) if name != "None"]
    return {name: _share(material, (motion == name).astype(float), errors).document() for name in names}
