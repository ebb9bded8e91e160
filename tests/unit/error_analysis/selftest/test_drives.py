import numpy as np
import pytest

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.distance import situations
from sdt_tools.error_analysis.epsilon import estimate_epsilon
from sdt_tools.error_analysis.selftest.drives import (
    FRONT_RAD,
    NOISE_M,
    predictions_of,
    scans_of,
    smooth_series,
    wander,
)
from sdt_tools.error_analysis.spaces import scan_space
from sdt_tools.frames import RAYS, ray_angles_rad
from sdt_tools.replay.predictions import SCHEMA


def test_a_smooth_series_is_standard_normal_and_as_correlated_as_its_filters_say() -> None:
    series = smooth_series(np.random.default_rng(0), 400, 300, 10.0)
    assert series.mean() == pytest.approx(0.0, abs=0.03)
    assert series.std() == pytest.approx(1.0, abs=0.03)
    keep = 0.9
    expected = 2 * keep / (1 + keep**2)  # first autocorrelation of an AR(2) with a double root
    assert np.mean(series[:, 1:] * series[:, :-1]) == pytest.approx(expected, abs=0.03)
    assert np.std(series[:, 0]) == pytest.approx(1.0, abs=0.1)  # no start that differs from the rest


def test_predictions_are_those_of_a_model_that_is_always_right() -> None:
    table = predictions_of(wander(np.random.default_rng(0), 12, 50), np.random.default_rng(1))
    assert {name: table.schema[name] for name in table.columns} == {name: SCHEMA[name] for name in table.columns}
    assert (table["label"] == table["predicted"]).all()
    assert table["loss_01"].sum() == 0.0
    assert table["recording"].n_unique() == 12
    assert table.sort("recording", "stamp_ns").equals(table)
    assert table.group_by("recording").agg(table["scenario"].alias("s").n_unique()).height == 12


def test_features_go_along_with_each_other() -> None:
    table = predictions_of(wander(np.random.default_rng(0), 40, 200), np.random.default_rng(1))
    near = table.filter(table["operator_range_m"] < 0.8)["motion"].str.contains("backward")
    assert near.mean() > 0.95
    numbers = table.select("operator_range_m", "speed_mps", "front_range_m").to_numpy().T
    correlation = np.corrcoef(numbers)
    assert correlation[0, 1] > 0.7
    assert correlation[0, 2] > 0.3


def test_scans_agree_with_the_features() -> None:
    wandered = wander(np.random.default_rng(0), 6, 80)
    scans = scans_of(wandered, np.random.default_rng(1))
    assert scans.shape == (len(wandered.recording), RAYS)
    nearest_m = scans[:, np.abs(ray_angles_rad()) <= FRONT_RAD].min(axis=1)
    off_m = nearest_m - wandered.front_range_m
    assert np.abs(off_m).max() < 6 * NOISE_M


def test_successive_scans_are_closer_than_others() -> None:
    wandered = wander(np.random.default_rng(0), 12, 100)
    scans = situations(scans_of(wandered, np.random.default_rng(1)), ErrorOptions())
    stamps_ns = np.arange(len(scans)) * 100_000_000
    epsilon = estimate_epsilon(scan_space(scans), wandered.recording, stamps_ns, ErrorOptions())
    assert 0.05 < epsilon.value < 0.4
    assert np.mean(epsilon.unrelated <= epsilon.value) < 0.05
