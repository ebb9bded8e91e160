import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sdt_tools.labeling.agreement import agreement_of
from sdt_tools.labeling.frame_labels import UNSAID, FrameLabels, Speaker, Voice
from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelKind, LabelSource

words = st.lists(st.integers(UNSAID, 3), min_size=12, max_size=12)


def labels(**said: list[int]) -> FrameLabels:
    voices = {
        Speaker(LabelSource.HUMAN, name.replace("_", ":")): Voice(np.array(of, np.int8), np.ones(len(of), np.int64))
        for name, of in said.items()
    }
    return FrameLabels(LabelKind.MOTION, np.arange(12), voices)


def kappa(one: list[int], other: list[int]) -> float:
    """Cohen 1960, equation 1, counted by hand."""
    pairs = [(a, b) for a, b in zip(one, other, strict=True) if a >= 0 and b >= 0]
    seen = sum(a == b for a, b in pairs) / len(pairs)
    chance = sum(sum(a == k for a, _ in pairs) * sum(b == k for _, b in pairs) for k in range(4)) / len(pairs) ** 2
    return (seen - chance) / (1 - chance)


def alpha(said: list[list[int]]) -> float:
    """Krippendorff 2011, nominal: one less observed over expected disagreement, over all pairable values."""
    units = [[value for value in unit if value >= 0] for unit in zip(*said, strict=True)]
    units = [unit for unit in units if len(unit) > 1]
    every = [value for unit in units for value in unit]
    observed = sum(sum(a != b for a in unit for b in unit) / (len(unit) - 1) for unit in units) / len(every)
    expected = sum(a != b for a in every for b in every) / (len(every) * (len(every) - 1))
    return 1 - observed / expected


@settings(deadline=None)  # the first call imports scikit-learn
@given(anna=words, ben=words, carol=words)
def test_the_coefficients_are_those_of_their_definitions(anna: list[int], ben: list[int], carol: list[int]) -> None:
    found = agreement_of(labels(anna=anna, ben=ben, carol=carol))
    for pair in found.pairs:
        one, other = ({"anna": anna, "ben": ben, "carol": carol}[name] for name in (pair.first, pair.second))
        if pair.kappa is not None:
            assert pair.kappa == pytest.approx(kappa(one, other))
        shared = [(a, b) for a, b in zip(one, other, strict=True) if a >= 0 and b >= 0]
        assert (pair.frames, pair.agreed) == (len(shared), sum(a == b for a, b in shared))
    assume(found.alpha is not None)
    assert found.alpha == pytest.approx(alpha([anna, ben, carol]))


def test_one_class_throughout_defines_no_coefficient() -> None:
    found = agreement_of(labels(anna=[1] * 12, ben=[1] * 12))
    assert (found.frames, found.alpha, found.pairs[0].kappa, found.pairs[0].agreed) == (12, None, None, 12)


def test_nobody_and_one_alone_agree_with_no_one() -> None:
    assert agreement_of(labels()).pairs == ()
    assert agreement_of(labels(anna=[1] * 12)).alpha is None


def test_settling_changes_nothing_that_was_said() -> None:
    anna, ben = [0, 1, 2] * 4, [0, 1, 1] * 4
    before = agreement_of(labels(anna=anna, ben=ben))
    after = agreement_of(labels(anna=anna, ben=ben, **{SETTLED_BY.replace(":", "_") + "carol": [1] * 12}))
    assert before == after
    assert not math.isclose(before.pairs[0].kappa or 0.0, 1.0)
