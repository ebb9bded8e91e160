"""A condition made as good, and as short, as it can be: bounds moved, names added, predicates added and dropped."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.conditions.predicates import Condition, Predicate, simplest_between
from sdt_tools.error_analysis.conditions.scoring import Scope

REFINEMENTS = 2
"""Rounds over a condition's predicates; each depends on the others."""
MOST_PREDICATES = 4
"""Two intervals, or three other predicates, and one to spare: longer sentences say little to a reader."""
EQUAL_SCORE = 0.5
"""Bounds whose scores differ by less (in nats) are as good as each other: of these the simplest number is taken."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Predicates that a condition may be extended by, and the frames that fulfil each."""

    predicates: tuple[Predicate, ...]
    masks: Bool[np.ndarray, "predicates frames"]


def refine(scope: Scope, condition: Condition) -> Condition:
    """The condition with each bound moved to where it scores best, over all values, and each set of names likewise."""
    for _ in range(REFINEMENTS):
        before = condition
        for position, predicate in enumerate(condition.predicates):
            rest = condition.without(position).mask(scope.features) & scope.active
            better = _best_bound(scope, rest, predicate) if predicate.is_bound else _best_names(scope, rest, predicate)
            condition = condition.replaced(position, better)
        if condition == before:
            break
    return condition


def extend(scope: Scope, condition: Condition, candidates: Candidates) -> Condition:
    """The condition with further predicates, as long as each adds more to its score than dropping one may cost."""
    while len(condition.predicates) < MOST_PREDICATES:
        rows = np.flatnonzero(condition.mask(scope.features) & scope.active)
        best = int(scope.gains(_sums(scope, candidates.masks, rows)).argmax())
        longer = refine(scope, condition.joined((candidates.predicates[best],)))
        if len(longer.predicates) <= len(condition.predicates) or not _worth_saying(scope, longer, condition):
            break
        condition = longer.plain()
    return condition


def simplify(scope: Scope, condition: Condition) -> Condition:
    """The condition without predicates whose loss costs at most the share ``simplify`` of the score."""
    while len(condition.predicates) > 1:
        shorter = [refine(scope, condition.without(position)) for position in range(len(condition.predicates))]
        best = max(shorter, key=scope.worth)
        lost = scope.score(condition) >= 0.0 > scope.score(best)
        if lost or _worth_saying(scope, condition, best):
            break
        condition = best
    return condition.plain()


def _worth_saying(scope: Scope, longer: Condition, shorter: Condition) -> bool:
    """Whether ``longer`` explains enough more than ``shorter`` for what it says more."""
    gained = scope.worth(longer) - scope.worth(shorter)
    return gained > 0.0 and scope.gain(shorter) < (1.0 - scope.options.simplify) * scope.gain(longer)


def _best_bound(scope: Scope, rest: Bool[np.ndarray, "frames"], predicate: Predicate) -> Predicate:
    """The bound that scores best among the frames ``rest``, as simple a number as says nearly the same."""
    values = scope.features.numeric[predicate.feature]
    order = scope.orders[predicate.feature]
    rows = order[rest[order]]
    ordered = values[rows]
    parts = np.flatnonzero(ordered[1:] > ordered[:-1])  # a bound fits after these; equal values stay together
    below = np.array([np.arange(1, len(rows) + 1), np.cumsum(scope.wrong[rows]), np.cumsum(scope.loss[rows])], float)
    inside = below[:, parts] if predicate.operator == "<" else below[:, -1:] - below[:, parts]
    scores = scope.scores(inside)
    if scores.max(initial=-1.0) < 0.0:
        scores = scope.gains(inside)
    if scores.max(initial=-1.0) < 0.0:
        return predicate
    best = int(scores.argmax())
    worse = np.flatnonzero(scores < scores[best] - EQUAL_SCORE)
    first = int(worse[worse < best].max(initial=-1)) + 1
    last = int(worse[worse > best].min(initial=len(scores))) - 1
    bound = simplest_between(float(ordered[parts[first]]), float(ordered[parts[last] + 1]))
    return Predicate(predicate.feature, predicate.operator, bound)


def _best_names(scope: Scope, rest: Bool[np.ndarray, "frames"], predicate: Predicate) -> Predicate:
    """The names under which, among the frames ``rest``, the mean loss exceeds η, as far as each is worth its cost."""
    names = scope.features.categories[predicate.feature]
    codes = scope.features.codes[predicate.feature]
    sums = np.array([scope.sums_of(rest & (codes == code)) for code in range(len(names))])
    means = sums[:, 2] / np.maximum(sums[:, 0], 1.0)
    chosen: list[int] = []
    score = 0.0
    for code in np.argsort(-means, kind="stable").tolist():
        wider = float(scope.gains(sums[[*chosen, code]].sum(axis=0)[:, None])[0])
        enough = max(scope.bound_cost, scope.options.simplify * max(score, 0.0)) if chosen else 0.0
        if (means[code] > scope.eta or not chosen) and wider > score + enough:
            chosen, score = [*chosen, code], wider
    if not chosen:
        return predicate
    return Predicate.among(predicate.feature, tuple(names[code] for code in sorted(chosen)))


def _sums(
    scope: Scope, masks: Bool[np.ndarray, "predicates frames"], rows: Int64[np.ndarray, "rows"]
) -> Float64[np.ndarray, "3 predicates"]:
    """Frames, errors and loss of those of ``rows`` that each predicate holds in."""
    wrong = rows[scope.wrong[rows]]
    lossy = rows[scope.loss[rows] != 0.0]
    loss = masks[:, lossy] @ scope.loss[lossy]
    return np.array([np.count_nonzero(masks[:, rows], axis=1), np.count_nonzero(masks[:, wrong], axis=1), loss])
