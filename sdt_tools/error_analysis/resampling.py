"""Intervals with recordings as the unit: frames of one recording are not independent, so recordings are drawn again.

A statistic is a function of totals, as in ``errors / frames``. What each recording adds to the totals is summed once;
a resample weighs recordings by how often it drew them (Efron 1979; clusters as in Davison and Hinkley 1997, 3.8).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float64, Int64

CONFIDENCE = 0.95

Statistic = Callable[[np.ndarray], np.ndarray]
"""Totals, draws along the last axis, to one value a draw; NaN where it is not defined."""


@dataclass(frozen=True)
class Estimate:
    """A number with its 95 % interval over resampled recordings. NaN where it cannot be known."""

    value: float
    low: float
    high: float

    def document(self) -> dict[str, float | None]:
        """As JSON-ready values; null for what is not known."""
        return {name: (float(value) if np.isfinite(value) else None) for name, value in vars(self).items()}

    def text(self, form: str = ".3f") -> str:
        """As in ``0.120 (0.080 to 0.160)``."""
        if not np.isfinite(self.value):
            return "not known"
        if not np.isfinite(self.low):
            return f"{self.value:{form}} (no interval)"
        return f"{self.value:{form}} ({self.low:{form}} to {self.high:{form}})"


UNKNOWN = Estimate(float("nan"), float("nan"), float("nan"))


def draw_units(units: int, resamples: int, seed: int) -> Int64[np.ndarray, "units draws"]:
    """How often each unit is drawn in each resample; a column sums to ``units``."""
    rng = np.random.default_rng(seed)
    return rng.multinomial(units, np.full(units, 1.0 / units), resamples).T.astype(np.int64)


def sum_by_unit(
    values: Float[np.ndarray, "*kinds items"], unit: Int64[np.ndarray, "items"], units: int
) -> Float64[np.ndarray, "*kinds units"]:
    """What each unit adds to the total of each kind of value; ``unit`` numbers the units from 0."""
    flat = values.reshape(-1, values.shape[-1])
    sums = np.array([np.bincount(unit, weights=row, minlength=units) for row in flat])
    return sums.reshape(*values.shape[:-1], units)


def estimate(
    sums: Float64[np.ndarray, "*kinds units"], statistic: Statistic, draws: Int64[np.ndarray, "units draws"]
) -> Estimate:
    """``statistic`` of the totals of ``sums``, with the percentile interval over ``draws``.

    Without an interval (NaN) where a tenth of the resamples, or more, do not define it: one unit, or a rare group.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        value = float(statistic(sums.sum(axis=-1, keepdims=True))[0])
        resampled = statistic(sums @ draws.astype(np.float64))
    known = resampled[np.isfinite(resampled)]
    if sums.shape[-1] < 2 or known.size <= 0.9 * resampled.size:
        return Estimate(value, float("nan"), float("nan"))
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(known, [tail, 100.0 - tail])
    return Estimate(value, float(low), float(high))


def ratio(totals: np.ndarray) -> np.ndarray:
    """Totals of (part, whole): the share, or the mean."""
    share: np.ndarray = totals[0] / totals[1]
    return share


def difference_of_ratios(totals: np.ndarray) -> np.ndarray:
    """Totals of (part, whole, other part, other whole): the first ratio less the other."""
    difference: np.ndarray = totals[0] / totals[1] - totals[2] / totals[3]
    return difference


def correlation(totals: np.ndarray) -> np.ndarray:
    """Totals of (1, x, y, x², y², xy): Pearson's correlation, and Spearman's where x and y are ranks."""
    count, x, y, xx, yy, xy = totals
    covariance = xy / count - x * y / count**2
    spread = np.sqrt((xx / count - (x / count) ** 2) * (yy / count - (y / count) ** 2))
    result: np.ndarray = covariance / spread
    return result


def moments(x: Float64[np.ndarray, "items"], y: Float64[np.ndarray, "items"]) -> Float64[np.ndarray, "6 items"]:
    """What ``correlation`` takes totals of, centred so that sums of squares stay exact."""
    x, y = x - x.mean(), y - y.mean()
    return np.array([np.ones_like(x), x, y, x * x, y * y, x * y])
