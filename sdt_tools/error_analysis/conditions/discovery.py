"""Conditions that errors gather in, found on some recordings; nothing found here is believed before it is confirmed.

All pairs of predicates are scored by the log-likelihood ratio of "errors are more frequent inside" against "the same
everywhere", under the gates of Definition 3. The best are shaped (bounds over all values, names, further predicates),
the very best is freed of predicates that matter little and taken away together with what it covers; then the search
starts again. At the end conditions are fitted again beside each other, and those that overlap are merged.
"""

from collections.abc import Iterator
from itertools import combinations_with_replacement

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.conditions.merging import merge, refit
from sdt_tools.error_analysis.conditions.predicates import Condition, Predicate
from sdt_tools.error_analysis.conditions.scoring import Scope
from sdt_tools.error_analysis.conditions.shaping import Candidates, extend, refine, simplify

BLOCK_FRAMES = 65_536
"""Frames whose predicates are held as numbers at a time; counts up to here are exact in float32."""
SHAPED_PAIRS = 8
"""Pairs of features that are shaped before the best is chosen."""
SHAPED_PAIRS_AT_ALL = 4
"""As many more that gather errors, but do not fulfil Definition 3 as they are."""
NEARLY = 0.01
"""Of conditions that lack at most this share of the best one's worth, the shortest is taken."""


def discover(scope: Scope, recording: Int64[np.ndarray, "frames"]) -> list[Condition]:
    """Candidate conditions, strongest first, each with frames in enough recordings."""
    found: list[Condition] = []
    predicates = tuple(candidate_predicates(scope))
    masks = np.array([predicate.mask(scope.features) for predicate in predicates])
    candidates = Candidates(predicates, masks.reshape(len(predicates), len(scope.loss)))
    left, sums = scope, _pair_sums(scope, masks, scope.active)
    while predicates and len(found) < scope.options.max_conditions:
        condition = _best(left, candidates, sums)
        if condition is None:
            break
        inside = condition.mask(scope.features) & left.active
        if _recordings(recording, inside) >= scope.options.min_recordings:
            found.append(condition)
        left = left.within(left.active & ~inside)
        sums = sums - _pair_sums(scope, masks, inside)
    merged = merge(scope, refit(scope, found))
    inside_each = [condition.mask(scope.features) for condition in merged]
    return [
        condition
        for condition, inside in zip(merged, inside_each, strict=True)
        if _recordings(recording, inside) >= scope.options.min_recordings
    ]


def candidate_predicates(scope: Scope) -> Iterator[Predicate]:
    """Both sides of every quantile cut of each number, and each category's names."""
    for name, values in scope.features.numeric.items():
        ordered = values[scope.orders[name]]
        if ordered.size == 0:
            continue
        ranks = np.linspace(0.0, len(ordered) - 1, scope.options.cuts + 2)[1:-1]
        for cut in np.unique(ordered[np.round(ranks).astype(np.int64)]):
            yield Predicate(name, "<", float(cut))
            yield Predicate(name, ">=", float(cut))
    for name, texts in scope.features.categories.items():
        for text in texts:
            yield Predicate(name, "=", text)


def _best(
    scope: Scope, candidates: Candidates, sums: Float64[np.ndarray, "3 predicates predicates"]
) -> Condition | None:
    """The condition that is worth most, grown from single predicates and pairs; None where none scores enough.

    The cuts are coarse, so a feature that only goes along with the true one can score best at first: several pairs of
    features are shaped before one is chosen.
    """
    seeds = [
        *_seeds(scope.scores(sums), candidates.predicates, scope.options.min_score)[:SHAPED_PAIRS],
        *_seeds(scope.gains(sums), candidates.predicates, scope.options.min_score)[:SHAPED_PAIRS_AT_ALL],
    ]
    refined = dict.fromkeys(refine(scope, condition) for condition in dict.fromkeys(seeds))
    extended = dict.fromkeys(extend(scope, condition, candidates) for condition in refined)
    shaped = dict.fromkeys(simplify(scope, condition) for condition in extended)
    worth = {
        condition: scope.worth(condition) for condition in shaped if scope.score(condition) >= scope.options.min_score
    }
    nearly = [condition for condition in worth if worth[condition] >= (1.0 - NEARLY) * max(worth.values())]
    return min(nearly, key=lambda condition: (scope.cost(condition), -worth[condition]), default=None)


def _seeds(
    scores: Float64[np.ndarray, "predicates predicates"], predicates: tuple[Predicate, ...], least: float
) -> list[Condition]:
    """The best predicate or pair of each two features, from the best of all, as far as they score ``least``."""
    features = np.array([predicate.feature for predicate in predicates])
    found: list[tuple[float, Condition]] = []
    for first, second in combinations_with_replacement(dict.fromkeys(features), 2):
        rows, columns = np.flatnonzero(features == first), np.flatnonzero(features == second)
        block = scores[np.ix_(rows, columns)]
        left, right = np.unravel_index(int(block.argmax()), block.shape)
        pair = Condition((predicates[rows[left]],)).joined((predicates[columns[right]],))
        found.append((float(block.max()), pair))
    found.sort(key=lambda scored: -scored[0])
    return [condition for score, condition in found if score >= least]


def _pair_sums(
    scope: Scope, masks: Bool[np.ndarray, "predicates frames"], among: Bool[np.ndarray, "frames"]
) -> Float64[np.ndarray, "3 predicates predicates"]:
    """Frames, errors and loss in the intersection of each two predicates; on the diagonal, in each one."""
    rows = np.flatnonzero(among)
    sums = np.zeros((3, len(masks), len(masks)))
    for start in range(0, len(rows), BLOCK_FRAMES):
        block = rows[start : start + BLOCK_FRAMES]
        inside = masks[:, block].astype(np.float32)
        sums[0] += inside @ inside.T
        wrong = np.ascontiguousarray(inside[:, scope.wrong[block]])
        sums[1] += wrong @ wrong.T
        loss = scope.loss[block].astype(np.float32)
        lossy = np.flatnonzero(loss)
        with_loss = inside[:, lossy]
        sums[2] += (with_loss * loss[lossy]) @ with_loss.T
    return sums


def _recordings(recording: Int64[np.ndarray, "frames"], inside: Bool[np.ndarray, "frames"]) -> int:
    return int(np.unique(recording[inside]).size)
