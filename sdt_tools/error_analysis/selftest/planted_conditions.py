"""Conditions to plant: conjunctions of one or two features that are worth finding, with sharp or blurred ends."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.conditions.predicates import Condition, Features, Predicate

RATE_INSIDE: Final = 0.8
RATE_OUTSIDE: Final = 0.02
MIN_SUPPORT: Final = 0.05
MAX_SUPPORT: Final = 0.25
MIN_RECORDINGS: Final = 0.2
"""Share of the recordings that have frames inside: 8 of 40."""
FEWEST_FRAMES: Final = 5
"""Frames inside that a recording must have to count among those."""
LARGEST_SHARE: Final = 0.7
"""Each of two features must matter: the condition is at most this share of either alone."""
LARGEST_OVERLAP: Final = 0.2
"""Two planted conditions are about different features, and share at most this part of the smaller one."""
BLUR: Final = 0.1
"""From this share of the feature's range before a blurred end to as much behind it, errors fall from 90 to 10 % of
their rate inside; in a narrow condition from where a fifth of its frames (over all its ends) lies beyond."""
NARROW: Final = 0.2
TRIES: Final = 2000


@dataclass(frozen=True, eq=False)
class PlantedCondition:
    """A condition, the frames inside, and how much of its error rate each frame bears (1 inside, where it is sharp)."""

    condition: Condition
    inside: Bool[np.ndarray, "frames"]
    weight: Float64[np.ndarray, "frames"]
    sharp: bool


def choose_conditions(
    features: Features, recording: Int64[np.ndarray, "frames"], count: int, sharp: bool, rng: np.random.Generator
) -> tuple[PlantedCondition, ...]:
    """Up to ``count`` random conditions that hardly overlap; fewer where the features allow no more."""
    chosen: list[PlantedCondition] = []
    for _ in range(TRIES):
        if len(chosen) == count:
            break
        condition = _random_condition(features, rng)
        inside = condition.mask(features)
        apart = not _names(condition) & {name for other in chosen for name in _names(other.condition)} and all(
            (inside & other.inside).sum() <= LARGEST_OVERLAP * min(inside.sum(), other.inside.sum()) for other in chosen
        )
        if apart and _worth_finding(condition, inside, features, recording):
            weight = inside.astype(np.float64) if sharp else _blurred(condition, features)
            chosen.append(PlantedCondition(condition, inside, weight, sharp))
    return tuple(chosen)


def _names(condition: Condition) -> set[str]:
    """The features it is about."""
    return {predicate.feature.strip("|") for predicate in condition.predicates}


def error_rate(planted: tuple[PlantedCondition, ...], frames: int) -> Float64[np.ndarray, "frames"]:
    """Probability of an error at each frame."""
    weight = np.max([condition.weight for condition in planted], axis=0, initial=0.0) if planted else np.zeros(frames)
    return RATE_OUTSIDE + (RATE_INSIDE - RATE_OUTSIDE) * weight


def feature_range(values: Float64[np.ndarray, "frames"]) -> float:
    """From the 5th to the 95th percentile of what is known."""
    low, high = np.nanpercentile(values, [5.0, 95.0])
    return float(high - low)


def _random_condition(features: Features, rng: np.random.Generator) -> Condition:
    names = [*features.numeric, *features.codes]
    count = int(rng.integers(1, min(2, len(names)) + 1))
    chosen = [names[i] for i in rng.choice(len(names), count, replace=False)]
    if len({name.strip("|") for name in chosen}) < count:
        chosen = chosen[:1]  # a number and its magnitude are one feature
    # One feature alone holds in fewer frames than one of two that must meet.
    smallest, largest = (0.05, 0.25) if count == 1 else (0.2, 0.5)
    return Condition(
        tuple(
            part for name in chosen for part in _random_predicates(features, name, rng.uniform(smallest, largest), rng)
        )
    )


def _random_predicates(features: Features, name: str, share: float, rng: np.random.Generator) -> tuple[Predicate, ...]:
    """A bound, or in one of five an interval, on a number, with ``share`` of the frames inside; else a category."""
    if name in features.codes:
        return (Predicate(name, "=", str(rng.choice(features.categories[name]))),)
    values = features.numeric[name]
    kind = rng.random()
    if kind < 0.4:
        return (Predicate(name, "<", float(np.nanquantile(values, share))),)
    if kind < 0.8:
        return (Predicate(name, ">=", float(np.nanquantile(values, 1.0 - share))),)
    start = rng.uniform(0.1, 0.9 - share) if share < 0.8 else 0.1
    low, high = np.nanquantile(values, [start, start + share])
    return Predicate(name, ">=", float(low)), Predicate(name, "<", float(high))


def _worth_finding(
    condition: Condition,
    inside: Bool[np.ndarray, "frames"],
    features: Features,
    recording: Int64[np.ndarray, "frames"],
) -> bool:
    """Whether it holds in enough frames of enough recordings, and for each of its features."""
    recordings = int(recording[-1]) + 1
    if not MIN_SUPPORT <= inside.mean() <= MAX_SUPPORT:
        return False
    if np.sum(np.bincount(recording[inside], minlength=recordings) >= FEWEST_FRAMES) < MIN_RECORDINGS * recordings:
        return False
    names = dict.fromkeys(predicate.feature for predicate in condition.predicates)
    alone = [
        Condition(tuple(predicate for predicate in condition.predicates if predicate.feature == name)) for name in names
    ]
    return len(alone) == 1 or all(inside.sum() <= LARGEST_SHARE * one.mask(features).sum() for one in alone)


def _blurred(condition: Condition, features: Features) -> Float64[np.ndarray, "frames"]:
    """The product of one logistic slope at each bound."""
    weight = np.ones(features.frames)
    inside = condition.mask(features)
    bounds = sum(predicate.is_bound for predicate in condition.predicates)
    for predicate in condition.predicates:
        if not predicate.is_bound:
            weight *= predicate.mask(features)
            continue
        values = features.numeric[predicate.feature]
        inward = (values - predicate.bound) * (1.0 if predicate.operator == ">=" else -1.0)
        reach = min(BLUR * feature_range(values), float(np.quantile(inward[inside], NARROW / bounds)))
        width = max(reach, 1e-9) / np.log(9.0)
        weight *= np.nan_to_num(1.0 / (1.0 + np.exp(np.clip(-inward / width, -50.0, 50.0))))
    return weight
