import numpy as np
import pytest

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.selftest.material import Material, all_right, with_errors
from sdt_tools.error_analysis.selftest.planting import (
    BACKGROUND,
    NOTHING,
    Ground,
    Kind,
    Planted,
    ground_of,
    plant_alone,
    plant_conditional,
    plant_mixed,
)

OPTIONS = ErrorOptions()


@pytest.fixture(scope="module")
def ground() -> Ground:
    table, scans = Material(recordings=20, frames=100).table_and_scans(np.random.default_rng(0), OPTIONS)
    return ground_of(all_right(table, OPTIONS), scans, OPTIONS)


@pytest.fixture(scope="module")
def near(ground: Ground) -> np.ndarray:
    """Which frames lie within ε of each other, by brute force over the whole matrix."""
    exact = ground.space.vectors.astype(np.float64)
    lengths = (exact * exact).sum(axis=1)
    squares = (lengths[:, None] + lengths[None] - 2.0 * exact @ exact.T) / exact.shape[1]
    return (squares > 1e-9) & (squares <= ground.epsilon_m**2)


def planted(ground: Ground, kind: Kind | None, seed: int = 1) -> Planted:
    rng = np.random.default_rng(seed)
    return plant_mixed(ground, rng) if kind is None else plant_alone(ground, kind, rng)


def beside(ground: Ground, row: int) -> list[int]:
    recording = ground.frames.recording
    return [at for at in (row - 1, row + 1) if 0 <= at < len(recording) and recording[at] == recording[row]]


@pytest.mark.parametrize("kind", [Kind.TRANSIENT, None])
def test_transient_errors_are_alone_among_right_neighbours(ground: Ground, near: np.ndarray, kind: Kind | None) -> None:
    result = planted(ground, kind)
    rows = np.flatnonzero(result.kind == Kind.TRANSIENT)
    assert len(rows) > 10
    for row in rows.tolist():
        assert near[row].any()
        assert not result.wrong[near[row]].any()
        assert not result.wrong[beside(ground, row)].any()
        assert not any(condition.inside[row] for condition in result.conditions)


@pytest.mark.parametrize("kind", [Kind.ISOLATED, None])
def test_isolated_errors_have_no_neighbour(ground: Ground, near: np.ndarray, kind: Kind | None) -> None:
    result = planted(ground, kind)
    rows = np.flatnonzero(result.kind == Kind.ISOLATED)
    assert len(rows) > 5
    assert not near[rows].any()
    assert not result.wrong[[at for row in rows.tolist() for at in beside(ground, row)]].any()


def test_bursts_last_for_two_frames_or_more_in_one_recording(ground: Ground) -> None:
    wrong = planted(ground, Kind.BURST).wrong
    for row in np.flatnonzero(wrong).tolist():
        assert wrong[beside(ground, row)].any()
    assert 0.01 < wrong.mean() < 0.03


@pytest.mark.parametrize("seed", range(6))
def test_systematic_errors_fill_what_they_are_about(ground: Ground, seed: int) -> None:
    wrong = planted(ground, Kind.SYSTEMATIC, seed).wrong
    rates = [wrong[ground.frames.recording == number].mean() for number in range(ground.frames.recordings)]
    assert set(rates) <= {0.0, 1.0}
    assert sum(rates) in (2, 4, 20)


def test_conditional_errors_come_at_the_rates_planted(ground: Ground) -> None:
    inside, outside = [], []
    for seed in range(20):
        result = plant_conditional(ground.features, ground.frames.recording, 1, True, np.random.default_rng(seed))
        (condition,) = result.conditions
        assert (result.kind[condition.inside] != BACKGROUND).all()
        assert (result.kind[~condition.inside] != Kind.CONDITIONAL).all()
        inside.append(result.wrong[condition.inside].mean())
        outside.append(result.wrong[~condition.inside].mean())
    assert np.mean(inside) == pytest.approx(0.8, abs=0.02)
    assert np.mean(outside) == pytest.approx(0.02, abs=0.005)


def test_all_kinds_but_systematic_are_mixed(ground: Ground) -> None:
    assert set(planted(ground, None).kind) == {NOTHING, *Kind} - {Kind.SYSTEMATIC}


def test_planting_replaces_the_errors_that_predictions_have() -> None:
    table = Material(recordings=10, frames=30).table(np.random.default_rng(0))
    first = np.arange(len(table)) % 3 == 0
    second = np.arange(len(table)) % 5 == 0
    frames = with_errors(with_errors(table, first, OPTIONS).table, second, OPTIONS)
    assert np.array_equal(frames.wrong, second)
    assert np.array_equal((frames.table["label"] != frames.table["predicted"]).to_numpy(), second)
    assert frames.table["label"].equals(table["label"])


def test_planted_losses_lie_on_their_sides_of_any_threshold() -> None:
    table = Material(recordings=10, frames=30).table(np.random.default_rng(0))
    wrong = np.arange(len(table)) % 3 == 0
    for eta in (0.05, 1.0, 7.0):
        frames = with_errors(table, wrong, ErrorOptions(loss="cross_entropy", eta=eta))
        assert np.array_equal(frames.wrong, wrong)
        assert np.array_equal(frames.right, ~wrong)
