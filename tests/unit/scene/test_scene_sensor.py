"""The sensor model: what it promises by itself, and beside the real drives."""

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from sdt_tools.frames import MAX_RANGE_M, RAYS
from sdt_tools.scene.sensor import SensorConfig, SensorModel
from sdt_tools.scene.sensor_figure import sensor_figure
from sdt_tools.scene.sensor_fit import (
    coded,
    coded_share,
    model_drives,
    noise_at_rest,
    run_lengths,
    standing_truths,
)

TRUTH = np.full(RAYS, 3.0)


def sensor(seed: int, config: SensorConfig | None = None, scan_hz: float = 50.0) -> SensorModel:
    rng = np.random.Generator(np.random.SFC64(seed))
    return SensorModel(SensorConfig() if config is None else config, rng, scan_hz)


def scans(model: SensorModel, count: int, truth: np.ndarray = TRUTH) -> np.ndarray:
    return np.stack([model.measure(truth) for _ in range(count)])


def test_ranges_are_whole_millimetres() -> None:
    ranges = scans(sensor(1), 50)

    np.testing.assert_array_equal(ranges, np.round(ranges, 3))


def test_noise_at_three_metres_is_eight_millimetres() -> None:
    ranges = scans(sensor(1, SensorConfig(codes=0.0)), 200)

    assert abs(ranges.mean() - 3.0) < 2e-4
    assert abs(ranges.std() - 0.00815) < 2e-4


def test_noise_is_normal() -> None:
    deviation = (scans(sensor(1, SensorConfig(codes=0.0, noise_m=0.1)), 200) - 3.0).ravel() / 0.10075

    for z, share in ((-2.0, 0.02275), (-1.0, 0.15866), (0.0, 0.5), (1.0, 0.84134), (3.0, 0.99865)):
        assert abs((deviation < z).mean() - share) < 0.004


def test_noise_of_neighbouring_rays_and_scans_is_independent() -> None:
    deviation = scans(sensor(1, SensorConfig(codes=0.0)), 200) - 3.0

    assert abs(np.corrcoef(deviation[:, 1:].ravel(), deviation[:, :-1].ravel())[0, 1]) < 0.01
    assert abs(np.corrcoef(deviation[1:].ravel(), deviation[:-1].ravel())[0, 1]) < 0.01


def test_what_is_out_of_reach_reads_zero() -> None:
    truth = np.where(np.arange(RAYS) < 100, MAX_RANGE_M, 3.0)

    ranges = sensor(1, SensorConfig(codes=0.0)).measure(truth)

    assert (ranges[:100] == 0.0).all()
    assert (ranges[100:] > 2.9).all()


def test_a_touched_surface_is_not_mistaken_for_a_code() -> None:
    ranges = scans(sensor(1, SensorConfig(codes=0.0)), 20, np.full(RAYS, 0.004))

    assert ranges.min() >= 0.01


def test_codes_are_the_sensors_own() -> None:
    ranges = np.concatenate([scans(sensor(seed, scan_hz=10.0), 270) for seed in range(20)])

    values, counts = np.unique(ranges[coded(ranges)], return_counts=True)
    assert values.tolist() == [0.0, 0.002, 0.003]
    assert 0.0005 < counts[1:].sum() / counts.sum() < 0.01


def test_same_seed_same_scans() -> None:
    np.testing.assert_array_equal(scans(sensor(3), 40), scans(sensor(3), 40))
    assert not np.array_equal(scans(sensor(3), 40), scans(sensor(4), 40))


def test_a_sensor_does_not_depend_on_those_beside_it() -> None:
    truths = np.random.default_rng(0).uniform(0.3, 8.0, (40, 5, RAYS))
    together = [sensor(seed) for seed in range(5)]

    batches = np.array([[one.measure(ranges) for one, ranges in zip(together, truth, strict=True)] for truth in truths])

    for seed in range(5):
        alone = sensor(seed)
        np.testing.assert_array_equal(batches[:, seed], np.stack([alone.measure(truth) for truth in truths[:, seed]]))


def test_the_truth_is_left_alone() -> None:
    truth = TRUTH.copy()

    sensor(1).measure(truth)

    np.testing.assert_array_equal(truth, TRUTH)


def test_codes_come_in_episodes_at_any_scan_rate() -> None:
    """A coded ray stays coded 0.1 s later and the share 1 s later, at 10 and at 50 scans a second."""
    for scan_hz, lag in ((10.0, 1), (50.0, 5)):
        codes = [coded(scans(sensor(seed, scan_hz=scan_hz), round(20 * scan_hz))) for seed in range(10)]
        again = sum((code[lag:] & code[:-lag]).sum() for code in codes) / sum(code[:-lag].sum() for code in codes)
        assert 0.7 < again < 0.92
        shares, second = [coded_share(np.where(code, 0.0, 1.0)) for code in codes], round(scan_hz)
        now, later = (np.concatenate(part) for part in zip(*((s[:-second], s[second:]) for s in shares), strict=True))
        assert np.corrcoef(now, later)[0, 1] > 0.7


def real_drives() -> list[np.ndarray]:
    folder = Path(os.environ.get("SDT_DATA", "/nowhere")) / "p3at_lms1xx"
    if not folder.is_dir():
        pytest.skip("SDT_DATA names no folder with p3at_lms1xx, the drives of a real robot")
    drives = []
    for path in sorted(folder.glob("*.csv.gz")):
        with gzip.open(path, "rt") as lines:
            drives.append(np.loadtxt(lines, delimiter=",", usecols=range(3, 3 + RAYS)))
    return drives


def test_the_model_reports_codes_and_noise_like_the_real_drives() -> None:
    real = real_drives()
    lengths = [len(drive) for drive in real] * 4
    model = model_drives(standing_truths(lengths, np.random.default_rng(0)), SensorConfig(), seed=0)
    real_share, model_share = (np.concatenate([coded_share(drive) for drive in drives]) for drives in (real, model))

    levels = np.unique(real_share)
    below = [np.searchsorted(np.sort(share), levels, side="right") / len(share) for share in (real_share, model_share)]
    assert np.abs(below[0] - below[1]).max() < 0.05  # Kolmogorov-Smirnov
    assert abs(model_share.mean() - real_share.mean()) < 0.003
    assert abs(model_share.max() - real_share.max()) < 0.005
    means = [np.std([coded_share(drive).mean() for drive in drives]) for drives in (real, model)]
    assert 0.6 < means[1] / means[0] < 1.7  # all real drives follow one course, so their means are alike
    long_runs = []
    for drives in (real, model):
        runs = np.concatenate([run_lengths(coded(drive)) for drive in drives])
        long_runs.append(runs[runs >= 10].sum() / runs.sum())
    assert abs(long_runs[0] - long_runs[1]) < 0.08
    np.testing.assert_allclose(noise_at_rest(model), noise_at_rest(real), rtol=0, atol=0.002)


def test_the_figure_is_drawn(tmp_path: Path) -> None:
    pretended = model_drives(standing_truths([60, 80], np.random.default_rng(1)), SensorConfig(), seed=5)

    sensor_figure(pretended, tmp_path / "sensor.png")

    assert (tmp_path / "sensor.png").stat().st_size > 20_000


def test_run_lengths_of_a_known_pattern() -> None:
    codes = np.array([[1, 0, 1, 1, 0, 1], [0, 0, 1, 1, 1, 0]], dtype=bool)

    assert sorted(run_lengths(codes).tolist()) == [1, 1, 2, 3]
