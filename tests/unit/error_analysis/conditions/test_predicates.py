import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.error_analysis.conditions.predicates import Condition, Features, Predicate, features_of, simplest_between
from sdt_tools.errors import UsageError

TABLE = pl.DataFrame(
    {
        "front_range_m": [0.3, 0.62, None, 2.0],
        "operator_bearing_rad": [-1.0, 0.2, 0.9, None],
        "motion": ["forward", "stay", None, "forward"],
        "in_level_1": [True, False, False, True],
        "light": [None, None, None, None],
        "mode": ["active", "active", None, "active"],
    },
    schema_overrides={"light": pl.String},
)


def inside(*predicates: Predicate) -> list[bool]:
    features = features_of(TABLE, ("front_range_m", "|operator_bearing_rad|", "motion", "in_level_1"))
    return Condition(predicates).mask(features).tolist()


def test_a_condition_reads_as_a_sentence() -> None:
    condition = Condition((Predicate("front_range_m", "<", 0.62), Predicate("motion", "=", "forward")))
    assert condition.text == "front_range_m < 0.62 and motion = forward"


def test_an_interval_reads_as_one() -> None:
    condition = Condition(
        (Predicate("x", "<", 0.62), Predicate("motion", "in", ("forward", "stay")), Predicate("x", ">=", 0.3))
    )
    assert condition.text == "0.3 <= x < 0.62 and motion in {forward, stay}"


def test_one_of_several_names_is_enough() -> None:
    assert inside(Predicate("motion", "in", ("forward", "stay"))) == [True, True, False, True]
    assert Predicate.among("motion", ("stay",)) == Predicate("motion", "=", "stay")


PREDICATES = st.sampled_from(
    [Predicate("x", side, bound) for side in ("<", ">=") for bound in (-0.7, -0.4, -0.1, 0.0, 0.2, 0.5, 0.6)]
    + [Predicate("|x|", side, bound) for side in ("<", ">=") for bound in (0.2, 0.4, 0.6)]
)


@given(st.lists(PREDICATES, min_size=1, max_size=4))
def test_leaving_out_the_magnitude_keeps_the_frames(predicates: list[Predicate]) -> None:
    condition = Condition(()).joined(tuple(predicates))
    values = np.linspace(-1.0, 1.0, 401) + 1e-4  # none on a bound: |x| < b leaves out -b, x >= -b does not
    features = Features(401, {"x": values, "|x|": np.abs(values)}, {}, {})
    plain = condition.plain()
    assert np.array_equal(plain.mask(features), condition.mask(features))
    sides = {(predicate.feature, predicate.side) for predicate in plain.predicates}
    assert len(sides) == len(plain.predicates)
    assert ("|x|", "<") not in sides or not {("x", "<"), ("x", ">=")} & sides


def test_bounds_and_a_magnitude_read_as_an_interval() -> None:
    condition = Condition((Predicate("x", ">=", -0.19), Predicate("|x|", "<", 0.38)))
    assert condition.plain().text == "-0.19 <= x < 0.38"


def test_a_condition_holds_where_all_its_predicates_do() -> None:
    assert inside(Predicate("front_range_m", "<", 0.62), Predicate("motion", "=", "forward")) == [
        True,
        False,
        False,
        False,
    ]


def test_the_two_sides_of_a_bound_share_out_what_is_known() -> None:
    assert inside(Predicate("front_range_m", "<", 0.62)) == [True, False, False, False]
    assert inside(Predicate("front_range_m", ">=", 0.62)) == [False, True, False, True]


def test_a_magnitude_looks_to_both_sides() -> None:
    assert inside(Predicate("|operator_bearing_rad|", ">=", 0.5)) == [True, False, True, False]


def test_booleans_are_categories() -> None:
    assert inside(Predicate("in_level_1", "=", "true")) == [True, False, False, True]


def test_a_name_that_does_not_occur_holds_nowhere() -> None:
    assert inside(Predicate("motion", "=", "backward")) == [False] * 4


def test_features_without_two_values_are_named_as_unavailable() -> None:
    assert features_of(TABLE, ("light", "mode", "motion")).unavailable == ("light", "mode")


def test_a_feature_that_predictions_lack_is_an_error_that_lists_those_they_have() -> None:
    with pytest.raises(UsageError, match=r"no feature 'wind_mps'; they have front_range_m, operator_bearing_rad"):
        features_of(TABLE, ("wind_mps",))


def test_joining_keeps_the_tighter_bound() -> None:
    wide = Condition((Predicate("front_range_m", "<", 2.0), Predicate("front_range_m", ">=", 0.1)))
    joined = wide.joined((Predicate("front_range_m", "<", 0.9), Predicate("front_range_m", ">=", 0.05)))
    assert joined.text == "0.1 <= front_range_m < 0.9"


@given(st.floats(-50, 50), st.floats(1e-9, 10))
def test_the_simplest_number_lies_between_and_none_is_shorter(low: float, width: float) -> None:
    high = low + width
    value = simplest_between(low, high)
    assert low < value <= high
    decimals = max(0, len(f"{value:.12f}".rstrip("0").split(".")[1]))
    if decimals:
        shorter = 10.0 ** (decimals - 1)
        assert not low < round(np.floor(high * shorter) / shorter, decimals - 1) <= high


def test_the_simplest_number_reads_well() -> None:
    assert simplest_between(0.6181, 0.6203) == 0.62
    assert simplest_between(-0.35, 0.4) == 0.0
    assert simplest_between(0.93, 1.01) == 1.0
