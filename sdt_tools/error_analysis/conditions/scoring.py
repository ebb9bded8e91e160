"""How well a condition tells wrong frames from right ones, and what saying it costs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.error_analysis.conditions.predicates import Condition, Features
from sdt_tools.error_analysis.definitions import ConditionOptions

NAME_COST = 1.0
"""What a category's name costs, in nats; a bound, of which there are many to choose from, costs half the logarithm of
the number of frames (Schwarz 1978). So of conditions that say the same the one with fewer bounds is taken."""


@dataclass(frozen=True, eq=False)
class Scope:
    """The frames that a search sees, with those already explained taken out of ``active``.

    ``orders``: for each number, the rows where it is known, from its smallest value to its largest.
    """

    features: Features
    loss: Float64[np.ndarray, "frames"]
    wrong: Bool[np.ndarray, "frames"]
    active: Bool[np.ndarray, "frames"]
    eta: float
    options: ConditionOptions
    orders: Mapping[str, Int64[np.ndarray, "known"]]

    def score(self, condition: Condition) -> float:
        """Log-likelihood ratio of ``condition`` over the active frames; -1 where a gate is closed."""
        return self.score_of(condition.mask(self.features))

    def score_of(self, inside: Bool[np.ndarray, "frames"]) -> float:
        """The same of any set of frames."""
        return float(self.scores(self.sums_of(inside & self.active)[:, None])[0])

    def gain(self, condition: Condition) -> float:
        """Its log-likelihood ratio, whether the gates are open or not."""
        return float(self.gains(self.sums_of(condition.mask(self.features) & self.active)[:, None])[0])

    def worth(self, condition: Condition) -> float:
        """Its gain less what it costs to say."""
        return self.gain(condition) - self.cost(condition)

    def cost(self, condition: Condition) -> float:
        """What it costs to say, in nats."""
        bounds = sum(predicate.is_bound for predicate in condition.predicates)
        names = sum(len(predicate.names) for predicate in condition.predicates)
        return bounds * self.bound_cost + names * NAME_COST

    @property
    def bound_cost(self) -> float:
        """Of one bound, in nats."""
        return 0.5 * math.log(max(self.totals[0], 1.0))

    @cached_property
    def totals(self) -> Float64[np.ndarray, "3"]:
        """Frames, errors and loss of all active frames."""
        return self.sums_of(self.active)

    def sums_of(self, rows: Bool[np.ndarray, "frames"]) -> Float64[np.ndarray, "3"]:
        """Frames, errors and loss of some frames."""
        loss = self.loss.sum(where=rows)
        return np.array([np.count_nonzero(rows), np.count_nonzero(rows & self.wrong), loss], dtype=np.float64)

    def scores(self, inside: Float64[np.ndarray, "3 *candidates"]) -> Float64[np.ndarray, "*candidates"]:
        """Scores of candidates from the frames, errors and loss inside them; -1 where a gate is closed.

        The gates: enough frames inside, and Definition 3 (mean loss above η inside and below it outside).
        """
        frames, _, loss = inside
        all_frames, _, all_loss = self.totals
        mean_inside = loss / np.maximum(frames, 1.0)
        mean_outside = (all_loss - loss) / np.maximum(all_frames - frames, 1.0)
        return self._ratios(inside, (mean_inside > self.eta) & (mean_outside < self.eta))

    def gains(self, inside: Float64[np.ndarray, "3 *candidates"]) -> Float64[np.ndarray, "*candidates"]:
        """The same without Definition 3: -1 only where support lacks or errors are no more frequent inside.

        A condition of three predicates often fulfils Definition 3 while no two of them do: on the way to it counts
        this.
        """
        return self._ratios(inside, np.ones(inside.shape[1:], bool))

    def _ratios(
        self, inside: Float64[np.ndarray, "3 *candidates"], passes: Bool[np.ndarray, "*candidates"]
    ) -> Float64[np.ndarray, "*candidates"]:
        """Log-likelihood ratios of candidates that pass and gather errors in enough frames; else -1."""
        frames, errors, _ = inside
        all_frames, all_errors, _ = self.totals
        supported = (frames >= self.options.min_support * all_frames) & (frames < all_frames)
        passes = passes & supported & (errors * all_frames > all_errors * frames)
        ratios = np.full(passes.shape, -1.0)
        ratios[passes] = log_likelihood_ratio(frames[passes], errors[passes], all_frames, all_errors)
        return ratios

    def within(self, rows: Bool[np.ndarray, "frames"]) -> "Scope":
        """The same search over other active frames."""
        return replace(self, active=rows)


def scope_of(
    features: Features,
    loss: Float64[np.ndarray, "frames"],
    wrong: Bool[np.ndarray, "frames"],
    eta: float,
    options: ConditionOptions,
) -> Scope:
    """A search over all frames."""
    orders = {}
    for name, values in features.numeric.items():
        order = np.argsort(values, kind="stable")  # unknown values come last
        orders[name] = order[: len(order) - int(np.isnan(values).sum())]
    return Scope(features, loss, wrong, np.ones(len(loss), bool), eta, options, orders)


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
    safe = np.where((count > 0) & (expected > 0), count / np.maximum(expected, 1e-300), 1.0)
    return count * np.log(safe)
