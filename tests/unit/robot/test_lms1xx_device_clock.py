"""The device's clock on the host's time, against the truth that made the telegrams."""

from collections.abc import Callable

import numpy as np
import pytest

from sdt_tools.robot.lms1xx.device_clock import SETTLED_AFTER, DeviceClock

BOOT_NS = 1_700_000_000_000_000_000
TURN_US = 1 << 32
PERIOD_US = 20_000
Delays = Callable[[np.random.Generator, int], np.ndarray]
DELAYS: dict[str, Delays] = {
    "uniform": lambda rng, n: rng.uniform(0, 5e6, n),
    "exponential": lambda rng, n: rng.exponential(5e6, n),
    "half normal": lambda rng, n: np.abs(rng.normal(0, 5e6, n)),
    "rarely awful": lambda rng, n: rng.uniform(0, 5e6, n) + np.where(rng.random(n) < 0.05, 4e8, 0.0),
}


def errors_ms(delays: Delays, ppm: float, scans: int, first_us: int = 0, seed: int = 1000) -> np.ndarray:
    """The errors of all stamps that were trusted, late and early, in telegrams that keep their order."""
    rng = np.random.default_rng(seed)
    device_us = first_us + PERIOD_US * np.arange(scans)
    truth_ns = BOOT_NS + np.rint((device_us - first_us) * 1000 * (1 + ppm * 1e-6)).astype(np.int64)
    received_ns = np.maximum.accumulate(truth_ns + np.rint(delays(rng, scans)).astype(np.int64))
    clock = DeviceClock()
    errors = []
    for us, true_ns, at_ns in zip(device_us.tolist(), truth_ns.tolist(), received_ns.tolist(), strict=True):
        clock.see(us % TURN_US, at_ns)
        if clock.settled:
            errors.append((clock.host_ns(us % TURN_US) - true_ns) / 1e6)
    assert clock.restarts == 0
    return np.array(errors)


@pytest.mark.parametrize("kind", DELAYS)
@pytest.mark.parametrize("ppm", [50.0, -50.0])
def test_stamps_are_within_two_milliseconds_from_the_first_on(kind: str, ppm: float) -> None:
    errors = errors_ms(DELAYS[kind], ppm, scans=10_000)
    assert len(errors) == 10_000 - SETTLED_AFTER + 1
    assert np.abs(errors).max() < 2.0


def test_the_error_shrinks_while_the_window_fills() -> None:
    errors = errors_ms(DELAYS["uniform"], 50.0, scans=10_000)
    assert np.abs(errors[3_000:]).max() < 0.5


def test_a_clock_that_wraps_keeps_its_time() -> None:
    errors = errors_ms(DELAYS["uniform"], 50.0, scans=1_000, first_us=TURN_US - 10 * 1_000_000)
    assert np.abs(errors).max() < 2.0


def test_drift_is_told_with_its_sign_and_only_when_known() -> None:
    clock = DeviceClock()
    for scan in range(3_000):
        if scan == 400:
            assert clock.drift_ppm is None
        clock.see(scan * PERIOD_US, BOOT_NS + round(scan * PERIOD_US * 1000 * (1 + 80e-6)))
    assert clock.drift_ppm == pytest.approx(80.0, abs=0.5)


def test_a_power_cycle_is_noticed_and_learnt_anew() -> None:
    clock = DeviceClock()
    for scan in range(100):
        clock.see(3_600_000_000 + scan * PERIOD_US, BOOT_NS + scan * PERIOD_US * 1000)
    assert clock.settled
    clock.reconnected()
    later_ns = BOOT_NS + 10_000_000_000
    clock.see(5_000, later_ns)
    assert (clock.restarts, clock.settled) == (1, False)
    for scan in range(1, SETTLED_AFTER):
        clock.see(5_000 + scan * PERIOD_US, later_ns + scan * PERIOD_US * 1000)
    assert clock.settled
    assert abs(clock.host_ns(5_000) - later_ns) < 200_000  # while its pace is not known, it may be taken for 200 ppm


def test_a_long_outage_of_the_link_alone_restarts_nothing() -> None:
    clock = DeviceClock()
    for scan in range(3_000):
        clock.see(scan * PERIOD_US, BOOT_NS + scan * PERIOD_US * 1000)
    clock.reconnected()
    two_hours_us = 7_200_000_000
    clock.see(two_hours_us % TURN_US, BOOT_NS + two_hours_us * 1000 + 3_000_000)
    assert clock.restarts == 0
    assert abs(clock.host_ns(two_hours_us % TURN_US) - BOOT_NS - two_hours_us * 1000) < 3_500_000


def test_a_burst_of_late_telegrams_moves_nothing() -> None:
    clock = DeviceClock()
    for scan in range(1_000):
        clock.see(scan * PERIOD_US, BOOT_NS + scan * PERIOD_US * 1000)
    before_ns = clock.host_ns(999 * PERIOD_US)
    for scan in range(1_000, 1_100):  # all come together, two seconds late and less
        clock.see(scan * PERIOD_US, BOOT_NS + 1_100 * PERIOD_US * 1000)
    assert clock.restarts == 0
    assert abs(clock.host_ns(999 * PERIOD_US) - before_ns) < 10_000
