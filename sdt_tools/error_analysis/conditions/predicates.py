"""Features of frames, and what can be said of them: predicates and their conjunctions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import polars as pl
from jaxtyping import Bool, Float64, Int64

from sdt_tools.errors import UsageError

Operator = Literal["<", ">=", "=", "in"]


@dataclass(frozen=True, eq=False)
class Features:
    """Columns that conditions are made of.

    Unknown numbers are NaN, unknown categories have the code -1: neither fulfils any predicate. ``unavailable`` names
    features asked for that no frame has, or that are the same in all.
    """

    frames: int
    numeric: Mapping[str, Float64[np.ndarray, "frames"]]
    codes: Mapping[str, Int64[np.ndarray, "frames"]]
    categories: Mapping[str, tuple[str, ...]]
    unavailable: tuple[str, ...] = ()

    def take(self, rows: Bool[np.ndarray, "frames"]) -> "Features":
        """The features of some frames."""
        return Features(
            int(rows.sum()),
            {name: values[rows] for name, values in self.numeric.items()},
            {name: values[rows] for name, values in self.codes.items()},
            self.categories,
            self.unavailable,
        )


@dataclass(frozen=True)
class Predicate:
    """One feature against one value: a bound for a number; for a category a name, or several of which one holds."""

    feature: str
    operator: Operator
    value: float | str | tuple[str, ...]

    @classmethod
    def among(cls, feature: str, names: tuple[str, ...]) -> "Predicate":
        """That a category is one of ``names``."""
        return cls(feature, "=", names[0]) if len(names) == 1 else cls(feature, "in", names)

    @property
    def names(self) -> tuple[str, ...]:
        """The names that fulfil it; none for a bound."""
        if isinstance(self.value, tuple):
            return self.value
        return (self.value,) if isinstance(self.value, str) else ()

    @property
    def bound(self) -> float:
        """The number of a bound."""
        assert isinstance(self.value, float | int)
        return float(self.value)

    @property
    def is_bound(self) -> bool:
        """Whether it is about a number."""
        return self.operator in ("<", ">=")

    @property
    def side(self) -> str:
        """``<`` or ``>=`` for bounds, ``=`` for names, however many."""
        return self.operator if self.is_bound else "="

    @property
    def text(self) -> str:
        """As in ``front_range_m < 0.62`` and ``motion in {forward, left_forward}``."""
        if self.operator == "in":
            return f"{self.feature} in {{{', '.join(self.names)}}}"
        return f"{self.feature} {self.operator} {self.value_text}"

    @property
    def value_text(self) -> str:
        """The bound or the name alone."""
        return f"{self.bound:.12g}" if self.is_bound else ", ".join(self.names)

    def mask(self, features: Features) -> Bool[np.ndarray, "frames"]:
        """The frames that fulfil it."""
        inside: Bool[np.ndarray, "frames"]
        if self.is_bound:
            values = features.numeric[self.feature]
            inside = values < self.bound if self.operator == "<" else values >= self.bound
            return inside
        known = features.categories[self.feature]
        codes = features.codes[self.feature]
        inside = np.zeros(features.frames, bool)
        for name in self.names:
            if name in known:
                inside |= codes == known.index(name)
        return inside

    def widened(self, other: "Predicate") -> "Predicate":
        """What holds where either does, given that both are about the same side of the same feature."""
        if not self.is_bound:
            return Predicate.among(self.feature, tuple(sorted({*self.names, *other.names})))
        looser = max if self.operator == "<" else min
        return Predicate(self.feature, self.operator, looser(self.bound, other.bound))

    def narrowed(self, other: "Predicate") -> "Predicate":
        """What holds where both do, given the same."""
        if not self.is_bound:
            both = tuple(name for name in self.names if name in other.names)
            return Predicate.among(self.feature, both) if both else self
        tighter = min if self.operator == "<" else max
        return Predicate(self.feature, self.operator, tighter(self.bound, other.bound))


@dataclass(frozen=True)
class Condition:
    """A conjunction of predicates."""

    predicates: tuple[Predicate, ...]

    @property
    def text(self) -> str:
        """As in ``0.3 <= front_range_m < 0.62 and motion = forward``."""
        by_feature: dict[str, list[Predicate]] = {}
        for predicate in self.predicates:
            by_feature.setdefault(predicate.feature, []).append(predicate)
        return " and ".join(_phrase(about) for about in by_feature.values())

    def mask(self, features: Features) -> Bool[np.ndarray, "frames"]:
        """The frames inside."""
        inside = np.ones(features.frames, bool)
        for predicate in self.predicates:
            inside &= predicate.mask(features)
        return inside

    def without(self, position: int) -> "Condition":
        """The condition with one predicate dropped."""
        return Condition(self.predicates[:position] + self.predicates[position + 1 :])

    def replaced(self, position: int, predicate: Predicate) -> "Condition":
        """The condition with one predicate exchanged."""
        return Condition((*self.predicates[:position], predicate, *self.predicates[position + 1 :]))

    def joined(self, more: tuple[Predicate, ...]) -> "Condition":
        """Both conjunctions in one, two on the same side of one feature merged into the tighter."""
        tightest: dict[tuple[str, str], Predicate] = {}
        for predicate in (*self.predicates, *more):
            key = (predicate.feature, predicate.side)
            tightest[key] = tightest[key].narrowed(predicate) if key in tightest else predicate
        return Condition(tuple(tightest.values()))

    def plain(self) -> "Condition":
        """The same frames, with the magnitude of a number left out where bounds on the number itself say it.

        As in ``x >= 0.2 and |x| < 0.5``, which is ``0.2 <= x < 0.5``.
        """
        bounds = {(predicate.feature, predicate.side): predicate for predicate in self.predicates}
        for (feature, side), magnitude in list(bounds.items()):
            name = feature.strip("|")
            low, high = bounds.get((name, ">=")), bounds.get((name, "<"))
            if name == feature or (low is None and high is None):
                continue
            replaced = _without_magnitude(name, side, magnitude.bound, low, high)
            if replaced:
                del bounds[feature, side]
                bounds |= {(name, predicate.side): predicate for predicate in replaced}
        return Condition(tuple(bounds.values()))


def _without_magnitude(
    name: str, side: str, bound: float, low: Predicate | None, high: Predicate | None
) -> tuple[Predicate, ...]:
    """Bounds on a number, given those it has, in place of one on its magnitude; none where they cannot say it."""
    at_least = low.bound if low else -np.inf
    below = high.bound if high else np.inf
    if side == "<":  # -bound < x < bound
        return Predicate(name, ">=", max(at_least, -bound)), Predicate(name, "<", min(below, bound))
    if at_least > -bound:  # only the positive side is left of |x| >= bound
        positive = Predicate(name, ">=", max(at_least, bound))
        return (positive, high) if high else (positive,)
    if below <= bound:  # only the negative side
        negative = Predicate(name, "<", min(below, -bound))
        return (low, negative) if low else (negative,)
    return ()


def _phrase(about: list[Predicate]) -> str:
    """Predicates on one feature: two bounds read as an interval."""
    sides = {predicate.operator: predicate for predicate in about}
    if len(about) == 2 and set(sides) == {"<", ">="}:
        return f"{sides['>='].value_text} <= {about[0].feature} < {sides['<'].value_text}"
    return " and ".join(predicate.text for predicate in about)


def features_of(table: pl.DataFrame, names: tuple[str, ...]) -> Features:
    """The named columns of ``table`` as features; ``|x|`` is the magnitude of the number ``x``.

    Numbers are numeric; names and booleans are categories. Raises UsageError for a column that does not exist.
    """
    numeric: dict[str, Float64[np.ndarray, "frames"]] = {}
    codes: dict[str, Int64[np.ndarray, "frames"]] = {}
    categories: dict[str, tuple[str, ...]] = {}
    unavailable: list[str] = []
    for name in names:
        column = name.strip("|")
        if column not in table.columns:
            raise UsageError(f"predictions have no feature '{column}'; they have {', '.join(table.columns)}")
        values = table[column]
        if values.n_unique() - int(values.null_count() > 0) < 2:
            unavailable.append(name)
        elif values.dtype.is_numeric():
            numbers = values.cast(pl.Float64).fill_null(float("nan")).to_numpy()
            numeric[name] = np.abs(numbers) if name != column else numbers
        else:
            texts = values.cast(pl.String)
            categories[name] = tuple(sorted(texts.drop_nulls().unique().to_list()))
            lookup = {text: code for code, text in enumerate(categories[name])}
            codes[name] = texts.replace_strict(lookup, default=-1, return_dtype=pl.Int64).to_numpy()
    return Features(table.height, numeric, codes, categories, tuple(unavailable))


def simplest_between(low: float, high: float) -> float:
    """The number with the fewest decimals in (low, high]: a bound that reads well and parts the same frames."""
    for decimals in range(13):
        scale = 10.0**decimals
        value = round(np.floor(high * scale) / scale, decimals)
        if low < value <= high:
            return float(value)
    return high
