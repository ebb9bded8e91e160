"""Intervals for what was counted."""

import math
from collections.abc import Callable
from statistics import NormalDist


def wilson(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """The score interval of a proportion (Wilson 1927, "Probable inference", eq. 2).

    Without trials nothing is known: (0, 1).
    """
    if not 0 <= successes <= trials:
        raise ValueError(f"{successes} successes in {trials} trials")
    if trials == 0:
        return 0.0, 1.0
    z = NormalDist().inv_cdf(0.5 + confidence / 2)
    share = successes / trials
    centre = (share + z * z / (2 * trials)) / (1 + z * z / trials)
    half = z / (1 + z * z / trials) * math.sqrt(share * (1 - share) / trials + z * z / (4 * trials * trials))
    low = 0.0 if successes == 0 else centre - half
    high = 1.0 if successes == trials else centre + half
    return low, high


def poisson_interval(count: int, confidence: float = 0.95) -> tuple[float, float]:
    """The exact interval of what a Poisson count is expected to be (Garwood 1936, "Fiducial limits", eq. 1 and 2).

    Its ends are the means under which ``count`` or more, and ``count`` or less, have half of what is left of the
    confidence.
    """
    if count < 0:
        raise ValueError(f"a count of {count}")
    tail = (1.0 - confidence) / 2
    low = 0.0 if count == 0 else _mean_where(lambda mean: _at_most(count - 1, mean), 1.0 - tail, count)
    return low, _mean_where(lambda mean: _at_most(count, mean), tail, count)


def _at_most(count: int, mean: float) -> float:
    """The probability that a Poisson variable of ``mean`` is ``count`` or less."""
    return sum(math.exp(k * math.log(mean) - mean - math.lgamma(k + 1)) for k in range(count + 1))


def _mean_where(probability: Callable[[float], float], value: float, count: int) -> float:
    """Where the falling ``probability`` of a mean is ``value``, by bisection."""
    low, high = 1e-12, 2.0 * count + 30.0
    while high - low > 1e-9 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if probability(middle) > value else (low, middle)
    return (low + high) / 2
