"""Errors counted by run: intervals of their number, and whether they spread evenly over scenarios.

Errors of one run are not independent: one look of a person, misread again and again, makes a run of many. And runs of
one seed in several scenarios have the person and much else in common. So runs, or seeds with all their runs, are what
is resampled and permuted here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64, Int64

from sdt_tools.statistics import poisson_interval

RESAMPLES: Final = 10_000
_CHUNK: Final = 1000


def count_interval(counts: Sequence[int], confidence: float = 0.95) -> tuple[float, float]:
    """The interval of the mean count of a run (or of a seed, where each count is that of all its runs).

    From the lower of the lower ends to the higher of the upper ends of two intervals, neither of which is enough alone:
    the percentile bootstrap over runs, which sees that errors come in clusters but not what is rare, and Garwood's
    exact one of a Poisson count, the other way round. Without any run nothing is known: (0, infinity).
    """
    if not counts:
        return 0.0, float("inf")
    runs = np.asarray(counts, np.int64)
    rng = np.random.default_rng(0)
    means = runs[rng.integers(0, len(runs), (RESAMPLES, len(runs)))].mean(axis=1)
    tail = (1.0 - confidence) / 2
    low, high = np.quantile(means, [tail, 1.0 - tail]).tolist()
    exact_low, exact_high = poisson_interval(int(runs.sum()), confidence)
    return min(low, exact_low / len(runs)), max(high, exact_high / len(runs))


@dataclass(frozen=True)
class Evenness:
    """Whether ``errors`` spread over scenarios as their exposure does: ``expected`` by scenario if they do.

    ``p_value`` is None where there is no error, or but one scenario. ``decided`` says that there are enough errors, one
    a scenario on average, for an uneven spread to show.
    """

    errors: int
    expected: tuple[float, ...]
    p_value: float | None

    @property
    def decided(self) -> bool:
        """Whether the p-value can mean much."""
        return self.errors >= len(self.expected)


def evenness_of(
    counts: Int64[np.ndarray, "seeds scenarios"], exposure: Float64[np.ndarray, "seeds scenarios"]
) -> Evenness:
    """Test that errors are as frequent in every scenario, for what it is exposed to; each seed is run in all of them.

    If they are, the residuals (count - rate x exposure) / sqrt(exposure) of one seed could as well have come in any
    other order of the scenarios, however errors cluster in runs and whatever the seed brings into all of its runs. So
    scenarios are permuted within each seed; the statistic is the sum over scenarios of their squared sums of residuals.
    The p-value is that of Monte Carlo, (1 + as large) / (1 + permutations), never 0.
    """
    total, exposed = int(counts.sum()), float(exposure.sum())
    rate = total / exposed if exposed > 0 else 0.0
    expected = tuple((rate * exposure.sum(axis=0)).tolist())
    if total == 0 or counts.shape[1] < 2:
        return Evenness(total, expected, None)
    safe = np.maximum(exposure, 1e-12)
    residuals = np.where(exposure > 0, (counts - rate * exposure) / np.sqrt(safe), 0.0)
    observed = _statistic(residuals[None])[0]
    rng = np.random.default_rng(0)
    as_large = 0
    for _ in range(RESAMPLES // _CHUNK):
        shuffled = rng.permuted(np.broadcast_to(residuals, (_CHUNK, *residuals.shape)), axis=2)
        as_large += int((_statistic(shuffled) >= observed * (1 - 1e-9)).sum())
    return Evenness(total, expected, (1 + as_large) / (1 + RESAMPLES))


def _statistic(residuals: Float64[np.ndarray, "tries seeds scenarios"]) -> Float64[np.ndarray, "tries"]:
    squared: Float64[np.ndarray, "tries"] = (residuals.sum(axis=1) ** 2).sum(axis=1)
    return squared
