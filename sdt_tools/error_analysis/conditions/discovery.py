"""Conditions that errors gather in, found on some recordings; nothing found here is believed before it is confirmed.

All pairs of predicates are scored by the log-likelihood ratio of "errors are more frequent inside" against "the same
everywhere", under the gates of Definition 3. The best are refined over all values, the very best is freed of predicates
that matter little and taken away together with what it covers; then the search starts again.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.conditions.predicates import Condition, Features, Predicate, simplest_between
from sdt_tools.error_analysis.definitions import ConditionOptions

BLOCK_FRAMES = 65_536
"""Frames whose predicates are held in memory at a time."""
REFINED_PAIRS = 5
"""Pairs of features whose bounds are refined before the best is chosen."""
REFINEMENTS = 2
"""Rounds over a condition's bounds; each bound depends on the others."""
EQUAL_SCORE = 0.5
"""Bounds whose scores differ by less (in nats) are as good as each other: of these the simplest number is taken."""


@dataclass(frozen=True, eq=False)
class Scope:
    """The frames that a search sees, with those already explained taken out of ``active``."""

    features: Features
    loss: Float64[np.ndarray, "frames"]
    wrong: Bool[np.ndarray, "frames"]
    active: Bool[np.ndarray, "frames"]
    eta: float
    options: ConditionOptions

    def score(self, condition: Condition) -> float:
        """Log-likelihood ratio of ``condition`` over the active frames; -1 where a gate is closed."""
        inside = condition.mask(self.features) & self.active
        sums = np.array([[values[inside].sum()] for values in self._weights()])
        return float(self.scores(sums, self.totals())[0])

    def totals(self) -> Float64[np.ndarray, "3"]:
        """Frames, errors and loss of all active frames."""
        return np.array([values[self.active].sum() for values in self._weights()], dtype=np.float64)

    def scores(
        self, inside: Float64[np.ndarray, "3 *candidates"], totals: Float64[np.ndarray, "3"]
    ) -> Float64[np.ndarray, "*candidates"]:
        """Scores of candidates from the frames, errors and loss inside them; -1 where a gate is closed."""
        frames, errors, loss = inside
        outside_frames = totals[0] - frames
        supported = (frames >= self.options.min_support * totals[0]) & (outside_frames > 0)
        mean_inside = loss / np.maximum(frames, 1.0)
        mean_outside = (totals[2] - loss) / np.maximum(outside_frames, 1.0)
        passes = supported & (mean_inside > self.eta) & (mean_outside < self.eta)
        return np.where(passes, log_likelihood_ratio(frames, errors, totals[0], totals[1]), -1.0)

    def within(self, rows: Bool[np.ndarray, "frames"]) -> "Scope":
        """The same search over fewer active frames."""
        return Scope(self.features, self.loss, self.wrong, rows, self.eta, self.options)

    def _weights(self) -> tuple[Float64[np.ndarray, "frames"], ...]:
        return np.ones(len(self.loss)), self.wrong.astype(np.float64), self.loss


def discover(scope: Scope, recording: Int64[np.ndarray, "frames"]) -> list[Condition]:
    """Candidate conditions, strongest first, each with frames in enough recordings."""
    found: list[Condition] = []
    predicates = list(candidate_predicates(scope))
    masks = [predicate.mask(scope.features) for predicate in predicates]
    while len(found) < scope.options.max_conditions:
        condition = _best_pair(scope, predicates, masks)
        if condition is None:
            break
        condition = _simplify(scope, condition)
        inside = condition.mask(scope.features) & scope.active
        if np.unique(recording[inside]).size >= scope.options.min_recordings:
            found.append(condition)
        scope = scope.within(scope.active & ~inside)
    return found


def candidate_predicates(scope: Scope) -> Iterator[Predicate]:
    """Both sides of every quantile cut of each number, and each category's names."""
    for name, values in scope.features.numeric.items():
        known = values[~np.isnan(values)]
        if known.size == 0:
            continue
        cuts = np.quantile(known, np.linspace(0.0, 1.0, scope.options.cuts + 2)[1:-1])
        for cut in np.unique(cuts):
            yield Predicate(name, "<", float(cut))
            yield Predicate(name, ">=", float(cut))
    for name, texts in scope.features.categories.items():
        for text in texts:
            yield Predicate(name, "=", text)


def log_likelihood_ratio(
    frames: Float64[np.ndarray, "*candidates"],
    errors: Float64[np.ndarray, "*candidates"],
    all_frames: float,
    all_errors: float,
) -> Float64[np.ndarray, "*candidates"]:
    """Of two error rates, inside and outside, against one: half of the G statistic of the 2 × 2 table."""
    rate = all_errors / max(all_frames, 1.0)
    outside_frames, outside_errors = all_frames - frames, all_errors - errors
    observed = (errors, frames - errors, outside_errors, outside_frames - outside_errors)
    expected = (frames * rate, frames * (1 - rate), outside_frames * rate, outside_frames * (1 - rate))
    return sum((_entropy_term(count, mean) for count, mean in zip(observed, expected, strict=True)), np.zeros(()))


def _entropy_term(
    count: Float64[np.ndarray, "*candidates"], expected: Float64[np.ndarray, "*candidates"]
) -> Float64[np.ndarray, "*candidates"]:
    safe = (count > 0) & (expected > 0)
    return np.where(safe, count * np.log(np.where(safe, count, 1.0) / np.where(safe, expected, 1.0)), 0.0)


def _best_pair(scope: Scope, predicates: list[Predicate], masks: list[Bool[np.ndarray, "frames"]]) -> Condition | None:
    """The best single predicate or pair, bounds refined; None where none scores enough.

    The cuts are coarse, so a feature that only goes along with the true one can score best at first: several pairs of
    features are refined before one is chosen.
    """
    if not predicates:
        return None
    scores = scope.scores(_pair_sums(scope, masks), scope.totals())
    features = np.array([predicate.feature for predicate in predicates])
    found: list[tuple[float, Condition]] = []
    for first, second in combinations_with_replacement(dict.fromkeys(features), 2):
        rows, columns = np.flatnonzero(features == first), np.flatnonzero(features == second)
        block = scores[np.ix_(rows, columns)]
        if block.max() >= scope.options.min_score:
            left, right = np.unravel_index(int(block.argmax()), block.shape)
            pair = Condition((predicates[rows[left]],)).joined((predicates[columns[right]],))
            found.append((float(block.max()), pair))
    found.sort(key=lambda scored: -scored[0])
    refined = [_refine(scope, condition) for _, condition in found[:REFINED_PAIRS]]
    return max(refined, key=scope.score, default=None)


def _pair_sums(scope: Scope, masks: list[Bool[np.ndarray, "frames"]]) -> Float64[np.ndarray, "3 predicates predicates"]:
    """Frames, errors and loss in the intersection of each two predicates; on the diagonal, in each one."""
    rows = np.flatnonzero(scope.active)
    sums = np.zeros((3, len(masks), len(masks)))
    for start in range(0, len(rows), BLOCK_FRAMES):
        block = rows[start : start + BLOCK_FRAMES]
        inside = np.array([mask[block] for mask in masks], dtype=np.float32)
        sums[0] += inside @ inside.T
        sums[1] += (inside * scope.wrong[block]) @ inside.T
        sums[2] += (inside * scope.loss[block].astype(np.float32)) @ inside.T
    return sums


def _refine(scope: Scope, condition: Condition) -> Condition:
    """The condition with each bound moved to where it scores best, over all values that occur."""
    for _ in range(REFINEMENTS):
        for position, predicate in enumerate(condition.predicates):
            if predicate.operator != "=":
                moved = Predicate(
                    predicate.feature,
                    predicate.operator,
                    _best_bound(scope, condition.without(position), predicate),
                )
                condition = condition.replaced(position, moved)
    return condition


def _best_bound(scope: Scope, rest: Condition, predicate: Predicate) -> float:
    """The bound of ``predicate`` that scores best given ``rest``, as simple a number as says nearly the same."""
    values = scope.features.numeric[predicate.feature]
    rows = np.flatnonzero(rest.mask(scope.features) & scope.active & ~np.isnan(values))
    rows = rows[np.argsort(values[rows], kind="stable")]
    ordered = values[rows]
    parts = np.flatnonzero(ordered[1:] > ordered[:-1])  # a bound fits after these; equal values stay together
    below = np.array([np.arange(1, len(rows) + 1), np.cumsum(scope.wrong[rows]), np.cumsum(scope.loss[rows])], float)
    inside = below[:, parts] if predicate.operator == "<" else below[:, -1:] - below[:, parts]
    scores = scope.scores(inside, scope.totals())
    if scores.max(initial=-1.0) < 0.0:
        return float(predicate.value)
    best = int(scores.argmax())
    worse = np.flatnonzero(scores < scores[best] - EQUAL_SCORE)
    first = int(worse[worse < best].max(initial=-1)) + 1
    last = int(worse[worse > best].min(initial=len(scores))) - 1
    return simplest_between(ordered[parts[first]], ordered[parts[last] + 1])


def _simplify(scope: Scope, condition: Condition) -> Condition:
    """The condition without predicates whose loss costs at most the share ``simplify`` of the score."""
    while len(condition.predicates) > 1:
        shorter = [_refine(scope, condition.without(position)) for position in range(len(condition.predicates))]
        scores = [scope.score(candidate) for candidate in shorter]
        if max(scores) < (1.0 - scope.options.simplify) * scope.score(condition):
            break
        condition = shorter[int(np.argmax(scores))]
    return condition
