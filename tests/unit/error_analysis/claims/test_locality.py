import numpy as np
import pytest

from sdt_tools.error_analysis.claims.locality import correlogram
from sdt_tools.error_analysis.resampling import draw_units

RNG = np.random.default_rng(5)


def test_a_smooth_loss_reaches_as_far_as_its_waves() -> None:
    """Scans on a line of 20 m, the loss a cosine of 4 m: it has its first zero a metre away."""
    place_m = RNG.uniform(0.0, 20.0, 600)
    scans = np.repeat(place_m[:, None], 4, axis=1).astype(np.float32)
    recording = np.repeat(np.arange(30), 20)
    found = correlogram(scans, np.cos(np.pi * place_m / 2.0), recording, draw_units(30, 100, 0))
    assert found.correlation[0] > 0.9
    crossing = int(np.argmax(found.correlation < 0.0))
    assert found.upper_m[crossing - 1] <= 1.3 <= found.upper_m[crossing] + 1.0


def test_the_value_of_a_bin_is_the_mean_product_of_its_pairs() -> None:
    scans = RNG.normal(size=(60, 3)).astype(np.float32)
    loss = RNG.normal(size=60)
    recording = np.repeat(np.arange(6), 10)
    found = correlogram(scans, loss, recording, draw_units(6, 50, 0))
    products: list[float] = []
    for i in range(60):
        for j in range(i):
            apart_m = float(np.sqrt(np.mean((scans[i].astype(float) - scans[j]) ** 2)))
            if recording[i] != recording[j] and found.upper_m[-2] < apart_m <= found.upper_m[-1] + 1e-9:
                products.append(float((loss[i] - loss.mean()) * (loss[j] - loss.mean())))
    assert found.pairs[-1] == pytest.approx(len(products), abs=1)
    assert found.correlation[-1] == pytest.approx(np.mean(products) / loss.var(), rel=0.05, abs=0.01)


def test_noise_reaches_nowhere() -> None:
    scans = RNG.normal(size=(400, 3)).astype(np.float32)
    found = correlogram(scans, RNG.normal(size=400), np.repeat(np.arange(20), 20), draw_units(20, 100, 0))
    assert found.reach_m(0.2) == 0.0
