"""One trial of each sort: plant, analyse, compare. What comes out is numbers and words that can be written as JSON."""

import json
from itertools import permutations
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Bool

from sdt_tools.error_analysis.conditions.predicates import Condition, Features, features_of
from sdt_tools.error_analysis.conditions.search import find_conditions
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.explain import explain
from sdt_tools.error_analysis.selftest.chance import NULLS
from sdt_tools.error_analysis.selftest.material import Material, all_right, with_errors
from sdt_tools.error_analysis.selftest.planted_conditions import PlantedCondition, feature_range
from sdt_tools.error_analysis.selftest.planting import (
    EXPECTED_TAG,
    Ground,
    Kind,
    Planted,
    ground_of,
    plant_alone,
    plant_conditional,
    plant_mixed,
)
from sdt_tools.errors import UsageError

OUTCOME: Final = "outcome.json"
BOUND_WITHIN: Final = 0.1
"""A bound is right within this share of the feature's range (its 5th to 95th percentile) from the planted one."""
TWO_CONDITIONS: Final = 0.4
"""Share of the trials with two conditions instead of one."""
MOSTLY: Final = 0.5
"""A reported condition is false unless more than this share of its frames lies inside planted ones."""


def tag_trial(folder: Path, seed: int, trial: int, material: Material, options: ErrorOptions) -> None:
    """Each kind alone, and all together, in one set of drives: how many were planted, tagged so, and both."""
    rng = np.random.default_rng([seed, trial, 0])
    table, scans = material.table_and_scans(rng, options)
    ground = ground_of(all_right(table, options), scans, options)
    alone = {kind: _tag_counts(ground, plant_alone(ground, kind, rng))[kind] for kind in Kind}
    mixed = _tag_counts(ground, plant_mixed(ground, rng))
    del mixed[Kind.SYSTEMATIC]
    _write(folder, {"alone": alone, "mixed": mixed})


def condition_trial(folder: Path, seed: int, trial: int, material: Material, options: ErrorOptions) -> None:
    """One or two conditions, sharp in every second trial, and what was found in their place."""
    rng = np.random.default_rng([seed, trial, 1])
    frames = all_right(material.table(rng), options)
    features = features_of(frames.table, options.conditions.features)
    count = 2 if rng.random() < TWO_CONDITIONS else 1
    planted = plant_conditional(features, frames.recording, count, trial % 2 == 0, rng)
    if not planted.conditions:
        raise UsageError(
            "no condition with 5 to 25 % of the frames in a fifth of the recordings can be planted into these "
            "predictions; use more recordings or frames"
        )
    search = find_conditions(with_errors(frames.table, planted.wrong, options), options)
    found = [verdict.condition for verdict in search.confirmed]
    matches = match(planted.conditions, found, features)
    inside = np.any([condition.inside for condition in planted.conditions], axis=0)
    _write(
        folder,
        {
            "planted": [
                _judged(condition, same, features) for condition, same in zip(planted.conditions, matches, strict=True)
            ],
            "found": [condition.text for condition in found],
            "false": sum(_is_false(condition.mask(features), inside) for condition in found),
            "other": len(found) - sum(same is not None for same in matches),
        },
    )


def null_trial(folder: Path, seed: int, trial: int, kind: str, material: Material, options: ErrorOptions) -> None:
    """Errors without a cause, and the conditions reported all the same."""
    rng = np.random.default_rng([seed, trial, 2, list(NULLS).index(kind)])
    frames = all_right(material.table(rng), options)
    wrong = NULLS[kind](frames.recording, rng)
    search = find_conditions(with_errors(frames.table, wrong, options), options)
    _write(folder, {"kind": kind, "found": [verdict.condition.text for verdict in search.confirmed]})


def match(planted: tuple[PlantedCondition, ...], found: list[Condition], features: Features) -> list[Condition | None]:
    """For each planted condition a found one about the same features, on the same sides, with the same names.

    No found condition is counted twice; of several ways to pair them the one with the closest bounds is taken.
    """
    best: list[Condition | None] = [None] * len(planted)
    least = (len(planted) + 1, 0.0)
    for order in permutations([*range(len(found)), *[-1] * len(planted)], len(planted)):
        pairs = [
            found[at] if at >= 0 and said(found[at]) == said(one.condition) else None
            for one, at in zip(planted, order, strict=True)
        ]
        errors = [bound_error(one.condition, two, features) for one, two in zip(planted, pairs, strict=True) if two]
        if (len(planted) - len(errors), sum(errors)) < least:
            best, least = pairs, (len(planted) - len(errors), sum(errors))
    return best


def said(condition: Condition) -> frozenset[tuple[str, str, tuple[str, ...]]]:
    """What a condition says but for its numbers."""
    return frozenset((predicate.feature, predicate.side, predicate.names) for predicate in condition.predicates)


def bound_error(planted: Condition, found: Condition, features: Features) -> float:
    """How far the worst bound is off, as a share of its feature's range; 0 where there are only names."""
    bounds = {(predicate.feature, predicate.side): predicate for predicate in found.predicates}
    return max(
        (
            abs(bounds[predicate.feature, predicate.side].bound - predicate.bound)
            / feature_range(features.numeric[predicate.feature])
            for predicate in planted.predicates
            if predicate.is_bound
        ),
        default=0.0,
    )


def _judged(planted: PlantedCondition, found: Condition | None, features: Features) -> dict[str, object]:
    error = None if found is None else bound_error(planted.condition, found, features)
    return {
        "text": planted.condition.text,
        "sharp": planted.sharp,
        "support": float(planted.inside.mean()),
        "features_right": found is not None,
        "bounds_right": error is not None and error <= BOUND_WITHIN,
        "bound_error": error,
    }


def _is_false(inside: Bool[np.ndarray, "frames"], planted: Bool[np.ndarray, "frames"]) -> bool:
    return bool(np.count_nonzero(inside & planted) <= MOSTLY * np.count_nonzero(inside))


def _tag_counts(ground: Ground, planted: Planted) -> dict[Kind, dict[str, int]]:
    frames = with_errors(ground.frames.table, planted.wrong, ground.options)
    tags = np.array(explain(frames, ground.space, ground.options).tagged.tag)
    counts = {}
    for kind, tag in EXPECTED_TAG.items():
        meant, said_so = planted.kind == kind, tags == tag
        counts[kind] = {
            "planted": int(meant.sum()),
            "tagged": int(said_so.sum()),
            "both": int((meant & said_so).sum()),
        }
    return counts


def _write(folder: Path, outcome: dict[str, object]) -> None:
    (folder / OUTCOME).write_text(json.dumps(outcome), encoding="utf-8")
