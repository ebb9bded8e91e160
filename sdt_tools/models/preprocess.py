"""From the sensor's readings to the tensor that a network sees, in two steps that are kept apart.

1. *Codes are resolved* (here, numpy): a reading that is not a distance is replaced by one, so that every ray of the
   result lies in [0, 20] m. A certificate speaks about this tensor.
2. *Clipping and scaling* (``ClipScale``, torch) are the first layer of the network, so that bounds pass through them.

An LMS1xx reports 0.000 m for a ray without a valid return, and rarely 0.002 or 0.003 m: codes, not distances. What is
done with them is a safety decision. A controller that takes them for an object at 0 m stops for nothing; one that takes
them for free space drives on when the sensor is covered. By default they are interpolated along the scan, and whoever
drives stops when ``invalid_front_share`` is too large.
"""

from enum import IntEnum
from typing import Final, Literal, no_type_check

import numpy as np
import torch
from jaxtyping import Bool, Float, Float64
from numba import njit
from pydantic import Field
from torch import Tensor, nn

from sdt_tools.config import Config
from sdt_tools.frames import MAX_RANGE_M

FIRST_FRONT_RAY: Final = 150
LAST_FRONT_RAY: Final = 389
"""The rays that look ahead, -60° to 59.5°: those watched by the safety domains of the paper's Table II, which writes
150 … 390 and counts 240."""

COVERED_SCAN_M: Final = 0.0
"""What a scan without any valid ray reads under ``interpolate``: a covered sensor counts as an object at 0 m, and the
scan lies in every safety domain."""

CodePolicy = Literal["interpolate", "max_range", "near"]


class _Policy(IntEnum):
    INTERPOLATE = 0
    MAX_RANGE = 1
    NEAR = 2


class PreprocessConfig(Config):
    """What is done with readings before a network's first layer with weights.

    ``code_below_m``: readings below it are codes (the LMS1xx's are 0, 2 and 3 mm), and so are readings that are not
    finite. ``code_policy``: ``interpolate`` linearly between the valid neighbours along the scan (at its ends, the
    nearest valid ray), ``max_range`` (free space) or ``near`` (an object at 0 m). ``clip_m``: ranges beyond it are
    taken for it. ``scale_m``: the range that becomes 1, where 0 becomes -1; without it, ``clip_m``.
    """

    code_below_m: float = Field(default=0.005, ge=0.0, le=0.1)
    code_policy: CodePolicy = "interpolate"
    clip_m: float = Field(default=4.0, gt=0.0, le=MAX_RANGE_M)
    scale_m: float | None = Field(default=None, gt=0.0)


def resolve_codes(
    ranges_m: Float[np.ndarray, "scans rays"], config: PreprocessConfig
) -> Float[np.ndarray, "scans rays"]:
    """Scans without codes, every ray in [0, 20] m, in a new array of the input's precision.

    A scan without a valid ray becomes 0 m everywhere under ``interpolate`` and ``near``, 20 m under ``max_range``.
    """
    policy = _Policy[config.code_policy.upper()]
    resolved = np.empty(ranges_m.shape, ranges_m.dtype)
    _resolve(np.ascontiguousarray(ranges_m), config.code_below_m, int(policy), resolved)
    return resolved


def invalid_rays(ranges_m: Float[np.ndarray, "scans rays"], config: PreprocessConfig) -> Bool[np.ndarray, "scans rays"]:
    """Which readings are codes."""
    valid: Bool[np.ndarray, "scans rays"] = np.isfinite(ranges_m) & (ranges_m >= config.code_below_m)
    return ~valid


def invalid_front_share(
    ranges_m: Float[np.ndarray, "scans rays"], config: PreprocessConfig
) -> Float64[np.ndarray, "scans"]:
    """Share of codes among the 240 front rays of each scan, as the sensor gave it."""
    front = ranges_m[:, FIRST_FRONT_RAY : LAST_FRONT_RAY + 1]
    share: Float64[np.ndarray, "scans"] = invalid_rays(front, config).mean(axis=1, dtype=np.float64)
    return share


class ClipScale(nn.Module):
    """Ranges in metres, clipped to [0, ``clip_m``] and scaled so that 0 becomes -1 and ``scale_m`` becomes 1.

    Monotone, so that bounds pass exactly. ``scale_m`` is ``clip_m`` where it is not given.
    """

    def __init__(self, clip_m: float, scale_m: float | None = None) -> None:
        super().__init__()
        self.clip_m = clip_m
        self.scale_m = clip_m if scale_m is None else scale_m

    def forward(self, ranges_m: Float[Tensor, "batch rays"]) -> Float[Tensor, "batch rays"]:
        """The scaled ranges."""
        return torch.clamp(ranges_m, 0.0, self.clip_m) * (2.0 / self.scale_m) - 1.0


@njit(cache=True)
@no_type_check
def _resolve(ranges_m, code_below_m, policy, out):
    scans, rays = ranges_m.shape
    for scan in range(scans):
        last = -1
        for ray in range(rays):
            reading = ranges_m[scan, ray]
            if np.isfinite(reading) and reading >= code_below_m:
                out[scan, ray] = min(reading, MAX_RANGE_M)
                if policy == 0 and last < ray - 1:
                    _fill(out, scan, last, ray)
                last = ray
            elif policy == 1:
                out[scan, ray] = MAX_RANGE_M
            else:
                out[scan, ray] = COVERED_SCAN_M
        if policy == 0 and 0 <= last < rays - 1:
            for ray in range(last + 1, rays):
                out[scan, ray] = out[scan, last]


@njit(cache=True)
@no_type_check
def _fill(out, scan, before, after):
    """Rays strictly between two valid ones, on the line between them; before the first valid one, equal to it."""
    if before < 0:
        for ray in range(after):
            out[scan, ray] = out[scan, after]
        return
    step = (out[scan, after] - out[scan, before]) / (after - before)
    for ray in range(before + 1, after):
        out[scan, ray] = out[scan, before] + step * (ray - before)
