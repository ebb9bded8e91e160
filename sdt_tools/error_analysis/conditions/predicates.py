"""Features of frames, and what can be said of them: predicates and their conjunctions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import polars as pl
from jaxtyping import Bool, Float64, Int64

from sdt_tools.errors import UsageError

Operator = Literal["<", ">=", "="]


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
    """One feature against one value: a bound for a number, a name for a category."""

    feature: str
    operator: Operator
    value: float | str

    @property
    def text(self) -> str:
        """As in ``front_range_m < 0.62``."""
        value = self.value if isinstance(self.value, str) else f"{self.value:.12g}"
        return f"{self.feature} {self.operator} {value}"

    def mask(self, features: Features) -> Bool[np.ndarray, "frames"]:
        """The frames that fulfil it."""
        if isinstance(self.value, str):
            names = features.categories[self.feature]
            code = names.index(self.value) if self.value in names else -2
            named: Bool[np.ndarray, "frames"] = features.codes[self.feature] == code
            return named
        values = features.numeric[self.feature]
        inside: Bool[np.ndarray, "frames"] = values < self.value if self.operator == "<" else values >= self.value
        return inside


@dataclass(frozen=True)
class Condition:
    """A conjunction of predicates."""

    predicates: tuple[Predicate, ...]

    @property
    def text(self) -> str:
        """As in ``front_range_m < 0.62 and motion = forward``."""
        return " and ".join(predicate.text for predicate in self.predicates)

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
        """Both conjunctions in one, bounds on the same side of one feature merged into the tighter."""
        tightest: dict[tuple[str, Operator], Predicate] = {}
        for predicate in (*self.predicates, *more):
            key = (predicate.feature, predicate.operator)
            known = tightest.get(key)
            if known is None or isinstance(known.value, str) or isinstance(predicate.value, str):
                tightest.setdefault(key, predicate)
            elif (predicate.value < known.value) == (predicate.operator == "<"):
                tightest[key] = predicate
        return Condition(tuple(tightest.values()))


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
