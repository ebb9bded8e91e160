import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sdt_tools.config import parse_config
from sdt_tools.error_analysis.definitions import (
    ErrorOptions,
    is_conditional,
    is_right,
    is_systematic,
    is_transient,
    is_wrong,
)
from sdt_tools.error_analysis.neighbours import build_index, count_neighbours
from sdt_tools.errors import ConfigError

ETA = 0.5
LOSSES = st.sampled_from([0.0, 0.3, 0.5, 0.7, 1.0])


def definition_1(scans: np.ndarray, loss: np.ndarray, epsilon: float) -> list[bool]:
    """The paper's sentence, word for word, with at least one neighbour asked for."""
    answers = []
    for here in range(len(scans)):
        near = []
        for other in range(len(scans)):
            apart = float(np.sqrt(np.mean((scans[here].astype(float) - scans[other].astype(float)) ** 2)))
            if 0 < apart <= epsilon:
                near.append(other)
        answers.append(bool(loss[here] > ETA and near and all(loss[other] < ETA for other in near)))
    return answers


@settings(deadline=None)  # the first call compiles
@given(
    hnp.arrays(np.float32, (12, 3), elements=st.sampled_from([0.0, 0.1, 0.2, 0.9])),
    hnp.arrays(np.float64, 12, elements=LOSSES),
    st.sampled_from([0.05, 0.12, 0.5]),
)
def test_definition_1_is_the_papers(scans: np.ndarray, loss: np.ndarray, epsilon: float) -> None:
    rows = np.arange(12)
    groups = np.array([np.ones(12, bool), is_right(loss, ETA)])
    counts = count_neighbours(build_index(scans), rows, epsilon, groups)
    assert is_transient(is_wrong(loss, ETA), counts[0], counts[1]).tolist() == definition_1(scans, loss, epsilon)


@given(hnp.arrays(np.float64, st.integers(1, 8), elements=LOSSES))
def test_definition_2_asks_for_every_frame(loss: np.ndarray) -> None:
    assert is_systematic(loss, ETA) == all(value > ETA for value in loss)


def test_definition_2_bears_the_share_tau_of_right_frames() -> None:
    loss = np.array([1.0] * 19 + [0.0])
    assert is_systematic(loss, ETA, tau=0.05)
    assert not is_systematic(loss, ETA, tau=0.04)


def test_definition_2_says_nothing_of_no_data() -> None:
    assert not is_systematic(np.empty(0), ETA)


@given(hnp.arrays(np.float64, 6, elements=LOSSES), hnp.arrays(np.bool_, 6))
def test_definition_3_compares_both_means_with_eta(loss: np.ndarray, inside: np.ndarray) -> None:
    within = [value for value, member in zip(loss, inside, strict=True) if member]
    without = [value for value, member in zip(loss, inside, strict=True) if not member]
    expected = bool(within and without) and np.mean(within) > ETA > np.mean(without)
    assert is_conditional(loss, inside, ETA) == expected


def test_a_loss_of_exactly_eta_is_neither_wrong_nor_right() -> None:
    loss = np.array([ETA])
    assert not is_wrong(loss, ETA).any()
    assert not is_right(loss, ETA).any()


def test_cross_entropy_needs_a_chosen_eta() -> None:
    with pytest.raises(ConfigError, match="needs a chosen eta"):
        parse_config(ErrorOptions, {"loss": "cross_entropy"}, "options.toml")
    assert parse_config(ErrorOptions, {"loss": "cross_entropy", "eta": 0.7}, "options.toml").eta == 0.7


def test_an_unknown_option_names_the_nearest() -> None:
    with pytest.raises(ConfigError, match="did you mean 'epsilon_m'"):
        parse_config(ErrorOptions, {"epsilon": 0.2}, "options.toml")
    with pytest.raises(ConfigError, match=r"conditions\.alfa.*did you mean 'alpha'"):
        parse_config(ErrorOptions, {"conditions": {"alfa": 0.2}}, "options.toml")
