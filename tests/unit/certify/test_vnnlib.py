from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.certify.vnnlib import read_vnnlib, vnnlib_text
from sdt_tools.errors import ConfigError
from sdt_tools.frames import MotionClass
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import NOT_FORWARD, SafetyLevel, domains

THREE = domains(SafetyLevel.THREE)
SOME_BUT_NOT_ALL = st.frozensets(st.sampled_from(MotionClass), min_size=1, max_size=6)
RANGES_M = st.floats(min_value=0.0, max_value=20.0)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "domain.vnnlib"
    path.write_text(vnnlib_text(THREE, 100), encoding="utf-8")
    return path


def test_a_file_says_its_polarity_first(file: Path) -> None:
    head = file.read_text().splitlines()[:6]
    assert all(line.startswith(";") for line in head)
    assert "COUNTEREXAMPLE" in head[1]
    assert "unsat: nowhere (certified)" in head[2]
    assert "forbidden: Y_1 forward, Y_2 left_forward, Y_3 right_forward" in head[5]


@pytest.mark.parametrize("level", list(SafetyLevel)[1:])
@pytest.mark.parametrize("domain", [0, 120, 239])
def test_bounds_read_back_are_the_domains(level: SafetyLevel, domain: int, tmp_path: Path) -> None:
    boxes = domains(level)
    (tmp_path / "x.vnnlib").write_text(vnnlib_text(boxes, domain), encoding="utf-8")
    query = read_vnnlib(tmp_path / "x.vnnlib")
    assert np.array_equal(query.lower_m, boxes.lower_m[domain])
    assert np.array_equal(query.upper_m, boxes.upper_m[domain])


@settings(max_examples=25, deadline=None)
@given(
    ends=st.lists(st.tuples(RANGES_M, RANGES_M), min_size=1, max_size=5),
    rays=st.permutations(range(541)),
    allowed=SOME_BUT_NOT_ALL,
)
def test_every_box_and_every_set_of_classes_reads_back_exactly(
    ends: list[tuple[float, float]],
    rays: list[int],
    allowed: frozenset[MotionClass],
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    lower, upper = np.zeros((1, 541)), np.full((1, 541), 20.0)
    for ray, pair in zip(rays, ends, strict=False):
        lower[0, ray], upper[0, ray] = min(pair), max(pair)
    path = tmp_path_factory.mktemp("round") / "x.vnnlib"
    path.write_text(vnnlib_text(DomainSet("any", lower, upper, np.array([3]), allowed), 0), encoding="utf-8")
    query = read_vnnlib(path)
    assert np.array_equal(query.lower_m, lower[0])
    assert np.array_equal(query.upper_m, upper[0])
    forbidden = [int(motion) for motion in MotionClass if motion not in allowed]
    assert query.cases == tuple(tuple((wrong, right) for right in sorted(allowed)) for wrong in forbidden)


@pytest.mark.parametrize("winner", MotionClass)
def test_exactly_the_forbidden_answers_are_what_a_file_asks_for(file: Path, winner: MotionClass) -> None:
    logits = np.zeros(7)
    logits[winner] = 1.0
    assert read_vnnlib(file).asks_for(THREE.lower_m[100], logits) == (winner not in NOT_FORWARD)


def test_a_tie_with_the_best_allowed_class_counts_as_a_counterexample(file: Path) -> None:
    assert read_vnnlib(file).asks_for(THREE.lower_m[100], np.zeros(7))


def test_beating_some_allowed_classes_is_not_enough(file: Path) -> None:
    """Forward beats stay, but backward beats forward."""
    assert not read_vnnlib(file).asks_for(THREE.lower_m[100], np.array([0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]))


def test_a_scan_outside_the_box_is_no_counterexample(file: Path) -> None:
    scan_m = THREE.upper_m[100].copy()
    scan_m[250] = 0.21
    assert not read_vnnlib(file).asks_for(scan_m, np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("(assert (<= X_7 4.0))\n", "", "X_7 has no bound '<='"),
        ("(assert (<= X_7 4.0))", "(assert (<= X_7 4.0))\n(assert (<= X_7 3.0))", "line 570: X_7 has two bounds"),
        ("(declare-const X_7 Real)\n", "", "'X_7' is no declared X"),
        ("(declare-const X_7 Real)", "(declare-const X_6 Real)", "line 14: neither a new declaration"),
        ("(declare-const X_7 Real)", "(declare-const X_7 Int)", "line 14: neither a new declaration"),
        ("(declare-const X_7 Real)", "(declare-const X_7 Real)\n(declare-const X_541 Real)", "one variable too many"),
        ("(assert (<= X_7 4.0))", "(assert (<= X_7 4e0))", "'4e0' is no decimal number"),
        ("(assert (<= X_7 4.0))", "(assert (<= X_7 nan))", "'nan' is no decimal number"),
        ("(assert (<= X_7 4.0))", "(assert (<= Y_0 4.0))", "'Y_0' is no declared X"),
        ("(assert (<= X_7 4.0))", "(assert (<= X_7 4.0)", "is never closed"),
        ("(assert (<= X_7 4.0))", "(assert (<= X_7 4.0)))", "closes nothing"),
        ("(assert (<= X_7 4.0))", "(check-sat)", "neither a new declaration nor an assertion"),
        ("(>= Y_1 Y_0)", "(<= Y_1 Y_0)", "no '(>= Y_a Y_b)'"),
        ("(>= Y_1 Y_0)", "(>= Y_1 Y_9)", "'Y_9' is no declared Y"),
        ("(and (>= Y_1", "(or (>= Y_1", "no '(and …)'"),
        ("(assert (or", "(assert (and", "neither a new declaration nor an assertion"),
    ],
)
def test_a_file_of_another_kind_is_refused_and_the_place_is_named(file: Path, old: str, new: str, said: str) -> None:
    text = file.read_text()
    assert text.count(old) == 1
    file.write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as refused:
        read_vnnlib(file)
    assert said in str(refused.value)
    assert str(file) in str(refused.value)


def test_a_file_without_outputs_is_refused(file: Path) -> None:
    text = file.read_text()
    file.write_text(text[: text.index("(assert (or")])
    with pytest.raises(ConfigError, match="no assertion speaks of the outputs"):
        read_vnnlib(file)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.vnnlib: cannot be read"):
        read_vnnlib(tmp_path / "none.vnnlib")
