"""Other LiDARs' rays as our 541: which ray of a sensor_msgs/LaserScan becomes which of ours.

Both count angles counter-clockwise from straight ahead, so rays come over in their order; a scanner that turns the
other way (a negative increment) has them reversed. 541 rays at 0.5° over 270° are taken as they are, of 1,081 at 0.25°
every second one. Whatever else there is can be resampled, if asked for: each of our rays takes the nearest one in
angle, and those outside of the sensor's field of view have no distance.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64

from sdt_tools.errors import RecordingError
from sdt_tools.frames import FIRST_RAY_RAD, RAY_STEP_RAD, RAYS, ray_angles_rad

NO_DISTANCE_M: Final = 0.0
"""The code of a ray that has no distance: infinite, not a number, beyond the sensor's limits, out of its view."""
CODE_BELOW_M: Final = 0.01
"""Ranges under this are codes of the LMS1xx (0.002, 0.003), and are kept."""
_TOLERANCE_RAD: Final = RAY_STEP_RAD / 10
_HALF_A_RAY: Final = 0.5 + 1e-3  # the angles are float32


@dataclass(frozen=True, eq=False)
class RayChoice:
    """For each of our rays the number of theirs that it takes, and whether theirs reach that far."""

    how: str
    rays: Int64[np.ndarray, "rays"]
    in_view: Bool[np.ndarray, "rays"]


@lru_cache(maxsize=16)
def choose_rays(count: int, first_rad: float, step_rad: float, resample: bool) -> RayChoice:
    """How ``count`` rays from ``first_rad`` on, ``step_rad`` apart (negative: clockwise), become ours.

    Raises RecordingError, saying what the geometry is and what would be needed, where that takes resampling and it was
    not asked for, or where the numbers describe no scan.
    """
    if count < 2 or not math.isfinite(first_rad) or not math.isfinite(step_rad) or step_rad == 0:
        raise RecordingError(
            f"a scan of {count} rays from {first_rad:g} rad, {step_rad:g} rad apart, has no geometry; "
            "choose another --scan-topic"
        )
    order = np.arange(count)
    if step_rad < 0:
        order, first_rad, step_rad = order[::-1], first_rad + (count - 1) * step_rad, -step_rad
    everywhere = np.ones(RAYS, np.bool_)
    for step, how in ((1, "as they are"), (2, "every second ray")):
        if count == step * (RAYS - 1) + 1 and _is_ours(first_rad, step_rad * step):
            return RayChoice(how, order[::step].astype(np.int64), everywhere)
    if not resample:
        last_rad = first_rad + (count - 1) * step_rad
        raise RecordingError(
            f"scans of {count} rays from {math.degrees(first_rad):.2f}° to {math.degrees(last_rad):.2f}°, "
            f"{math.degrees(step_rad):.4f}° apart; {RAYS} rays at 0.5° or {2 * RAYS - 1} at 0.25° from -135° to 135° "
            "are taken as they are, --resample takes the nearest ray for each of ours"
        )
    return _nearest(order, first_rad, step_rad)


def our_ranges(
    ranges_m: Float32[np.ndarray, "theirs"], choice: RayChoice, least_m: float, most_m: float
) -> Float64[np.ndarray, "rays"]:
    """Our 541 ranges in metres from theirs, which count where they are in ``[least_m, most_m]`` or are codes of ours.

    A float32 that stands for a whole millimetre becomes that millimetre, any other keeps its value.
    """
    chosen: Float64[np.ndarray, "rays"] = ranges_m[choice.rays].astype(np.float64)
    with np.errstate(invalid="ignore"):
        limited = (ranges_m >= np.float32(least_m)) & (ranges_m <= np.float32(most_m))
        counts = (limited | (ranges_m < CODE_BELOW_M)) & (ranges_m >= 0) & np.isfinite(ranges_m)
    chosen[~(counts[choice.rays] & choice.in_view)] = NO_DISTANCE_M
    whole_m = np.rint(chosen * 1000) / 1000
    exact = whole_m.astype(np.float32) == chosen.astype(np.float32)
    chosen[exact] = whole_m[exact]
    return chosen


def _is_ours(first_rad: float, step_rad: float) -> bool:
    """Whether every ray is within a tenth of a step of ours."""
    last_rad = first_rad + (RAYS - 1) * step_rad
    return abs(first_rad - FIRST_RAY_RAD) < _TOLERANCE_RAD and abs(last_rad + FIRST_RAY_RAD) < _TOLERANCE_RAD


def _nearest(order: Int64[np.ndarray, "theirs"], first_rad: float, step_rad: float) -> RayChoice:
    """Angles are the same modulo a turn: a scanner from 0° to 360° sees ahead at both ends."""
    steps = (ray_angles_rad() - first_rad) / step_rad
    turn = 2 * math.pi / step_rad
    last = len(order) - 1
    steps -= np.ceil((steps - last - _HALF_A_RAY) / turn) * turn  # the turn in which they are at most the last
    in_view = steps >= -_HALF_A_RAY
    rays = order[np.clip(np.rint(steps), 0, last).astype(np.int64)]
    return RayChoice("the nearest ray", rays.astype(np.int64), in_view)
