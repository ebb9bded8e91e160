"""What is compared between the real sensor and its model: codes a scan, runs of coded rays, noise at rest."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.frames import RAYS
from sdt_tools.scene.sensor import SensorConfig, SensorModel

CODES_BELOW_M: Final = 0.005
"""Every reading below is a code, not a distance."""
NOISE_BINS_M: Final = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0)
_SMOOTH_M: Final = 0.03
"""Noise is measured where neighbouring rays differ by less: an edge moves by metres when the robot trembles."""
_OUTLIER_M: Final = 0.08


def coded(ranges_m: Float64[np.ndarray, "scans rays"]) -> Bool[np.ndarray, "scans rays"]:
    """Which readings are codes."""
    return ranges_m < CODES_BELOW_M


def coded_share(ranges_m: Float64[np.ndarray, "scans rays"]) -> Float64[np.ndarray, "scans"]:
    """The share of coded rays of each scan."""
    share: Float64[np.ndarray, "scans"] = coded(ranges_m).mean(axis=1)
    return share


def run_lengths(codes: Bool[np.ndarray, "scans rays"]) -> Int64[np.ndarray, "runs"]:
    """The lengths, in rays, of all runs of coded rays."""
    padded = np.pad(codes, ((0, 0), (1, 1))).astype(np.int8)
    change = np.diff(padded, axis=1)
    return np.nonzero(change == -1)[1] - np.nonzero(change == 1)[1]


def noise_at_rest(drives_m: Sequence[Float64[np.ndarray, "_ rays"]], scans: int = 3) -> Float64[np.ndarray, "bins"]:
    """Standard deviation (metres) of a ray in each of ``NOISE_BINS_M``; nan where fewer than 50 rays say something.

    From the differences between the first ``scans`` scans of each drive, before the robot has gathered speed.
    """
    spread, place = [], []
    for drive in drives_m:
        first = drive[:scans]
        middle = np.median(first, axis=0)
        usable = ~coded(first).any(axis=0) & (np.abs(np.gradient(middle)) < _SMOOTH_M)
        for change in np.diff(first, axis=0):
            kept = usable & (np.abs(change) < _OUTLIER_M)
            spread.append(change[kept] / np.sqrt(2.0))
            place.append(middle[kept])
    differences, ranges = np.concatenate(spread), np.concatenate(place)
    bins = np.digitize(ranges, NOISE_BINS_M) - 1
    noise = np.full(len(NOISE_BINS_M) - 1, np.nan)
    for i in range(len(noise)):
        inside = differences[bins == i]
        if len(inside) >= 50:
            noise[i] = inside.std()
    return noise


def model_drives(
    truths_m: Sequence[Float64[np.ndarray, "_ rays"]], config: SensorConfig, seed: int, scan_hz: float = 10.0
) -> list[Float64[np.ndarray, "_ rays"]]:
    """What the model reports of each drive's flawless scans; every drive has a sensor of its own."""
    sensors = np.random.SeedSequence(seed).spawn(len(truths_m))
    drives = []
    for truth, numbers in zip(truths_m, sensors, strict=True):
        sensor = SensorModel(config, np.random.Generator(np.random.SFC64(numbers)), scan_hz)
        drives.append(np.stack([sensor.measure(scan) for scan in truth]))
    return drives


def standing_truths(lengths: Sequence[int], rng: np.random.Generator) -> list[Float64[np.ndarray, "_ rays"]]:
    """Flawless scans of robots that stand, each between smooth walls half a metre to eight metres away."""
    rays = np.arange(RAYS)
    truths = []
    for length in lengths:
        waves = rng.uniform(0.0, 2 * np.pi, 2)
        bend = 0.5 + 0.25 * (np.sin(rays / 90.0 + waves[0]) + np.sin(rays / 70.0 + waves[1]))
        truths.append(np.tile(0.5 * 16.0**bend, (length, 1)))
    return truths
