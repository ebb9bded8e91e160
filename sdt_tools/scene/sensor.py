"""What the real LiDAR makes of the distances: noise, millimetres, and codes in the place of ranges.

Every constant is fitted to 20 drives of a Pioneer P3-AT with a SICK LMS1xx (5,385 scans; public data of an ICRA 2020
paper), whose scans are taken to be 0.1 s apart, since that makes the 2.5 cm between two of them a usual speed of
the base. ``sensor_figure`` draws model and drives together.

*Noise.* While the robot stands at the start of a drive, a ray spreads by 7.5 mm at 1 m, 8 mm at 3 m and 9 mm at 6 m.
(The difference of two successive scans, which holds the noise twice, spreads by 11 mm at 3 m.)

*Codes.* 0.000 means that no valid echo came back; a few codes in a thousand are 0.002 or 0.003. Codes come in
episodes of some seconds, each in one or two places of the scan that widen, drift and narrow again: something dark or
shiny passes by. The number of coded rays is a slowly varying Gaussian process, put through the quantiles of the drives'
numbers, so the share a scan is that of the drives by construction; how long episodes last and how recordings differ are
fitted.

*No return.* The drives never left a room. A ray that meets nothing within range reads 0.000, the sensor's code for it.
"""

import math
from bisect import bisect_left
from statistics import NormalDist
from typing import Final, no_type_check

import numpy as np
from jaxtyping import Float64, Int64
from numba import njit
from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.frames import MAX_RANGE_M, RAYS

_QUANTILES: Final = (
    # standard normal, rays: the quantiles .598, .65, .70 … .97, .985, .995 and 1 of the drives' coded rays a scan
    (0.25, 0.0),
    (0.39, 2.0),
    (0.52, 3.0),
    (0.67, 6.0),
    (0.84, 10.0),
    (0.93, 13.0),
    (1.04, 18.0),
    (1.15, 26.0),
    (1.28, 32.0),
    (1.44, 36.0),
    (1.64, 40.0),
    (1.88, 44.0),
    (2.17, 48.0),
    (2.58, 52.0),
    (3.50, 60.0),
)
_EPISODE_S: Final = 2.0
"""Time constant of the process. The share now and 1, 2, 3 s later correlate by .9, .6, .5; in the drives .9, .7, .5."""
_RECORDING_VARIANCE: Final = 0.1
"""Part of the variance that lasts throughout a recording. Recordings' means spread by 1.3 %; the drives' by 0.9 %."""
_FUZZ_RAYS: Final = (-0.5, 0.8)
"""How ragged an episode's places are: mean and spread of the logarithm of a scale in rays. Sets the lengths of runs."""
_SECOND_PLACE: Final = 0.5
"""Share of the episodes that have a second place."""
_DRIFT_RAYS_PER_S: Final = 16.0
"""Spread of the drift: a coded ray is coded 0.1 s later in 80 % of the cases, like the drives'."""
_PLACES: Final = np.array([0.219, 0.143, 0.094, 0.049, 0.007, 0.008, 0.134, 0.156, 0.190])
"""Where the drives' codes are, in nine equal parts of the scan: mostly at the sides, where the walls pass by."""
_ODD_CODE: Final = 0.0021
"""Share of the codes that are 0.002 or 0.003."""
_LEAST_M: Final = 0.01
"""What noise makes of a touched surface stays above the codes."""
_LOTS: Final = RAYS + 3
"""Random 16-bit numbers a scan: one a ray, one for the process, one for an odd code, one to fill words of 64 bits."""
_BLOCK: Final = 16
"""Scans for which random numbers are drawn at once."""
_NORMALS: Final = np.array([NormalDist().inv_cdf((i + 0.5) / 8192) for i in range(8192)])
"""Standard normal deviates for 13 random bits: finer than millimetres, and a seventh of the time of drawing them."""


class SensorConfig(Config):
    """The sensor model; the defaults are the real sensor's."""

    noise_m: float = Field(default=0.0074, ge=0)
    """Standard deviation of a range close by."""
    noise_m_per_m: float = Field(default=0.00025, ge=0)
    """What each metre adds to it."""
    codes: float = Field(default=1.0, ge=0)
    """Codes a scan, as a multiple of the real sensor's; 0 for none."""


class SensorModel:
    """The LiDAR of one recording. It has its own random numbers: what it reports never depends on other sensors."""

    def __init__(self, config: SensorConfig, rng: np.random.Generator, scan_hz: float = 50.0) -> None:
        self._config = config
        self._rng = rng
        self._dt_s = 1.0 / scan_hz
        self._keep = math.exp(-self._dt_s / _EPISODE_S)
        a2 = self._keep**2
        # two leaky integrators in a row, as smooth as the drives' episodes, started in their stationary state
        self._scale = math.sqrt((1.0 - _RECORDING_VARIANCE) * (1.0 - a2) ** 3 / (1.0 + a2))
        first, second, always = rng.standard_normal(3).tolist()
        self._level = math.sqrt(_RECORDING_VARIANCE) * always
        self._push = first / math.sqrt(1.0 - a2)
        self._state = self._push / (1.0 - a2) + second * self._keep / (1.0 - a2) ** 1.5
        self._order: Int64[np.ndarray, "rays"] = np.arange(RAYS)
        self._active = False
        self._shift = 0.0
        self._drift = 0.0
        self._block = np.empty((0, _LOTS), np.uint16)
        self._used = 0

    def measure(self, true_ranges_m: Float64[np.ndarray, "rays"]) -> Float64[np.ndarray, "rays"]:
        """The scan that the sensor reports for what is truly there; call it once a scan, in their order."""
        out = np.empty(RAYS)
        self.measure_into(true_ranges_m, out)
        return out

    def measure_into(self, true_ranges_m: Float64[np.ndarray, "rays"], out: Float64[np.ndarray, "rays"]) -> None:
        """``measure``, written into ``out``, which may be ``true_ranges_m`` itself."""
        if self._used == len(self._block):
            words = self._rng.bit_generator.random_raw(_BLOCK * _LOTS // 4)
            self._block = words.view(np.uint16).reshape(_BLOCK, _LOTS)
            self._used = 0
        lots = self._block[self._used]
        self._used += 1
        count = self._coded_rays(float(_NORMALS[lots[RAYS] >> 3]))
        config = self._config
        _report(
            true_ranges_m,
            lots,
            config.noise_m,
            config.noise_m_per_m,
            self._order,
            count,
            round(self._shift) % RAYS,
            out,
        )

    def _coded_rays(self, draw: float) -> int:
        """Move the process on by a scan and say how many rays are coded now."""
        self._push = self._keep * self._push + draw
        self._state = self._keep * self._state + self._push
        normal = self._level + self._scale * self._state
        if normal <= _QUANTILES[0][0] or not self._config.codes:
            self._active = False
            return 0
        if not self._active:
            self._begin_episode()
        self._shift += self._drift * self._dt_s
        return min(RAYS, round(self._config.codes * _rays_at(normal)))

    def _begin_episode(self) -> None:
        """Choose where codes will be: the order in which rays lose their echo as their number grows."""
        rng = self._rng
        rays = np.arange(RAYS)
        parts = (rng.choice(len(_PLACES), 2, p=_PLACES / _PLACES.sum()) + rng.random(2)) / len(_PLACES)
        places = np.abs(rays[:, None] - parts * RAYS)
        distance = places.min(axis=1) if rng.random() < _SECOND_PLACE else places[:, 0]
        fuzz = math.exp(rng.normal(*_FUZZ_RAYS))
        self._order = np.argsort(distance + fuzz * rng.exponential(size=RAYS), kind="stable")
        self._shift, self._drift = 0.0, _DRIFT_RAYS_PER_S * float(rng.standard_normal())
        self._active = True


def _rays_at(normal: float) -> float:
    """Coded rays a scan at a standard normal quantile, linear between the fitted ones."""
    above = bisect_left(_QUANTILES, (normal,))
    if above == len(_QUANTILES):
        return _QUANTILES[-1][1]
    (z0, rays0), (z1, rays1) = _QUANTILES[above - 1], _QUANTILES[above]
    return rays0 + (normal - z0) / (z1 - z0) * (rays1 - rays0)


@njit(cache=True)
@no_type_check
def _report(truth, lots, noise, noise_per_m, order, count, shift, out):
    for k in range(RAYS):
        true_m = truth[k]
        noisy_m = true_m + (noise + noise_per_m * true_m) * _NORMALS[lots[k] >> 3]
        reported_m = max(np.floor(1000.0 * noisy_m + 0.5) / 1000.0, _LEAST_M)
        out[k] = reported_m if true_m < MAX_RANGE_M else 0.0
    for i in range(count):
        out[(order[i] + shift) % RAYS] = 0.0
    lot = lots[RAYS + 1] / 65536.0 / _ODD_CODE
    if lot < count:
        out[(order[int(lot)] + shift) % RAYS] = 0.002 if lot % 1.0 < 0.5 else 0.003
