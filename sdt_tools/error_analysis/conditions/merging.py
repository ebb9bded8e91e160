"""Conditions that overlap, merged into the simplest that explains as much."""

from itertools import combinations, product

import numpy as np

from sdt_tools.error_analysis.conditions.predicates import Condition
from sdt_tools.error_analysis.conditions.scoring import Scope
from sdt_tools.error_analysis.conditions.shaping import refine, simplify

MOSTLY = 0.5
"""A condition lies in others when they hold in more than this share of its frames."""


def merge(scope: Scope, conditions: list[Condition]) -> list[Condition]:
    """Fewer conditions that explain the errors of all active frames nearly as well, in the order given.

    Two that one wider condition stands for are replaced by it; one that lies mostly in the others, and adds little to
    what they explain, goes. Nearly: at most the share ``simplify`` of the score of all together is lost.
    """
    while len(conditions) > 1:
        shorter = _joined_once(scope, conditions) or _dropped_once(scope, conditions)
        if shorter is None:
            break
        conditions = shorter
    return conditions


def refit(scope: Scope, conditions: list[Condition]) -> list[Condition]:
    """Each condition shaped again on the frames that the others leave: the first was found among the errors of all."""
    fitted = list(conditions)
    for position in range(len(fitted) if len(fitted) > 1 else 0):
        others = [condition.mask(scope.features) for at, condition in enumerate(fitted) if at != position]
        left = scope.within(scope.active & ~np.any(others, axis=0))
        again = simplify(left, refine(left, fitted[position]))
        if left.score(again) >= 0.0:
            fitted[position] = again
    return fitted


def _joined_once(scope: Scope, conditions: list[Condition]) -> list[Condition] | None:
    whole = _score_together(scope, conditions)
    for first, second in combinations(range(len(conditions)), 2):
        wider = _wider(conditions[first], conditions[second])
        if wider is None:
            continue
        one = simplify(scope, refine(scope, wider))
        rest = [condition for at, condition in enumerate(conditions) if at not in (first, second)]
        merged = [*rest[:first], one, *rest[first:]]
        if _score_together(scope, merged) >= (1.0 - scope.options.simplify) * whole:
            return merged
    return None


def _dropped_once(scope: Scope, conditions: list[Condition]) -> list[Condition] | None:
    whole = _score_together(scope, conditions)
    masks = [condition.mask(scope.features) & scope.active for condition in conditions]
    for position in reversed(range(len(conditions))):
        others = np.any([mask for at, mask in enumerate(masks) if at != position], axis=0)
        inside = masks[position]
        if np.count_nonzero(inside & others) <= MOSTLY * np.count_nonzero(inside):
            continue
        if scope.score_of(others) >= (1.0 - scope.options.simplify) * whole:
            return [condition for at, condition in enumerate(conditions) if at != position]
    return None


def _score_together(scope: Scope, conditions: list[Condition]) -> float:
    return scope.score_of(np.any([condition.mask(scope.features) for condition in conditions], axis=0))


def _wider(first: Condition, second: Condition) -> Condition | None:
    """What both say: the looser of two bounds on one side, the names of either; None where they share nothing."""
    shared = tuple(
        one.widened(other)
        for one, other in product(first.predicates, second.predicates)
        if one.feature == other.feature and one.side == other.side
    )
    return Condition(shared) if shared else None
