import json
from pathlib import Path

import numpy as np
import pytest

from sdt_tools.error_analysis.conditions.predicates import Condition, Features, Predicate
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.selftest.material import Material
from sdt_tools.error_analysis.selftest.planted_conditions import PlantedCondition
from sdt_tools.error_analysis.selftest.trials import OUTCOME, bound_error, condition_trial, match, tag_trial
from sdt_tools.errors import UsageError

OPTIONS = ErrorOptions()
VALUES = np.linspace(0.0, 10.0, 1001)  # the 5th to the 95th percentile are 9 apart
FEATURES = Features(1001, {"x": VALUES, "y": VALUES[::-1]}, {"c": np.arange(1001) % 2}, {"c": ("a", "b")})


def condition(*predicates: tuple[str, str, object]) -> Condition:
    return Condition(tuple(Predicate(*predicate) for predicate in predicates))  # type: ignore[arg-type]


def planted(*predicates: tuple[str, str, object]) -> PlantedCondition:
    one = condition(*predicates)
    inside = one.mask(FEATURES)
    return PlantedCondition(one, inside, inside.astype(float), True)


def test_bounds_are_measured_in_the_range_of_their_feature() -> None:
    truth = condition(("x", ">=", 2.0), ("x", "<", 5.0), ("c", "=", "a"))
    found = condition(("c", "=", "a"), ("x", "<", 5.09), ("x", ">=", 1.55))
    assert bound_error(truth, found, FEATURES) == pytest.approx(0.45 / 9.0)


def test_other_features_sides_and_names_are_other_conditions() -> None:
    truth = (planted(("x", "<", 2.0), ("c", "=", "a")),)
    for other in (
        condition(("x", "<", 2.0)),
        condition(("x", ">=", 2.0), ("c", "=", "a")),
        condition(("x", "<", 2.0), ("c", "=", "b")),
        condition(("x", "<", 2.0), ("c", "in", ("a", "b"))),
        condition(("y", "<", 2.0), ("c", "=", "a")),
    ):
        assert match(truth, [other], FEATURES) == [None]
    same = condition(("c", "=", "a"), ("x", "<", 9.0))
    assert match(truth, [same], FEATURES) == [same]


def test_no_condition_is_counted_twice_and_the_closest_is_taken() -> None:
    near, far = condition(("x", "<", 2.1)), condition(("x", "<", 4.0))
    assert match((planted(("x", "<", 2.0)),), [far, near], FEATURES) == [near]
    truths = (planted(("x", "<", 2.0)), planted(("x", "<", 4.1)))
    assert match(truths, [far, near], FEATURES) == [near, far]
    assert match(truths, [near], FEATURES) == [near, None]


def test_tags_find_what_was_planted(tmp_path: Path) -> None:
    tag_trial(tmp_path, 0, 0, Material(recordings=40, frames=150), OPTIONS)
    outcome = json.loads((tmp_path / OUTCOME).read_text())
    assert set(outcome["alone"]) == {"conditional", "transient", "burst", "isolated", "systematic"}
    assert set(outcome["mixed"]) == set(outcome["alone"]) - {"systematic"}
    for counts in (*outcome["alone"].values(), *outcome["mixed"].values()):
        assert counts["planted"] > 5
        assert counts["both"] >= 0.9 * counts["tagged"]
        assert counts["both"] >= 0.9 * counts["planted"]


def test_a_planted_condition_is_found_as_it_was_planted(tmp_path: Path) -> None:
    condition_trial(tmp_path, 0, 0, Material(), OPTIONS)
    outcome = json.loads((tmp_path / OUTCOME).read_text())
    assert [one["features_right"] and one["bounds_right"] for one in outcome["planted"]] == [True, True]
    assert outcome["false"] == outcome["other"] == 0


def test_material_without_room_for_a_condition_is_refused(tmp_path: Path) -> None:
    options = ErrorOptions(conditions={"features": ["in_level_1"]})
    with pytest.raises(UsageError, match="no condition with 5 to 25 % of the frames"):
        condition_trial(tmp_path, 0, 0, Material(recordings=10, frames=40), options)
