"""The features of frames: what conditions are later made from."""

from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Bool, Float64, Int64

from sdt_tools.models.preprocess import (
    FIRST_FRONT_RAY,
    LAST_FRONT_RAY,
    PreprocessConfig,
    invalid_rays,
    resolve_codes,
)
from sdt_tools.replay.tracks import Tracks
from sdt_tools.robustness.domains import SafetyLevel, distance_rms_m, membership

_CODES: Final = PreprocessConfig()
"""Features speak of the scan, not of a model: codes are interpolated, whatever the model does with them."""
_LEVELS: Final = tuple(level for level in SafetyLevel if level is not SafetyLevel.NONE)


def scan_features(ranges_m: Float64[np.ndarray, "frames rays"]) -> pl.DataFrame:
    """What the scans alone tell: membership of the safety levels, distances to them, front_range_m, invalid_share.

    ``domain_distance_m`` is the distance to the nearest domain of any level. The levels are nested, so it is that of
    the widest. ``front_range_m`` is null where no ray from -60° to 60° is valid.
    """
    resolved = resolve_codes(ranges_m, _CODES)
    invalid = invalid_rays(ranges_m, _CODES)
    front = slice(FIRST_FRONT_RAY, LAST_FRONT_RAY + 1)
    nearest_m = np.where(invalid[:, front], np.inf, ranges_m[:, front]).min(axis=1)
    distances_m = {level: distance_rms_m(resolved, level) for level in _LEVELS}
    return pl.DataFrame(
        {
            **{f"in_level_{int(level)}": _inside(resolved, level, distances_m[level]) for level in _LEVELS},
            **{f"distance_level_{int(level)}_m": distances_m[level] for level in _LEVELS[:-1]},
            "domain_distance_m": distances_m[_LEVELS[-1]],
            "front_range_m": known(np.where(np.isfinite(nearest_m), nearest_m, np.nan)),
            "invalid_share": invalid.mean(axis=1),
        }
    )


def _inside(
    resolved_m: Float64[np.ndarray, "frames rays"], level: SafetyLevel, distance_m: Float64[np.ndarray, "frames"]
) -> Bool[np.ndarray, "frames"]:
    """Membership of ``level``, asked only where the distance does not already rule it out."""
    inside: Bool[np.ndarray, "frames"] = distance_m == 0.0
    inside[inside] = membership(resolved_m[inside], level)
    return inside


def track_features(tracks: Tracks, stamps_ns: Int64[np.ndarray, "frames"]) -> pl.DataFrame:
    """What else the recording knows: operator_range_m, operator_bearing_rad, speed_mps, command, mode, expert."""
    range_m, bearing_rad = tracks.operator_from_lidar(stamps_ns)
    commands = tracks.commands_at(stamps_ns)
    experts = [None if command is None else command.expert for command in commands]
    return pl.DataFrame(
        {
            "operator_range_m": known(range_m),
            "operator_bearing_rad": known(bearing_rad),
            "speed_mps": known(tracks.robot.speed_mps(stamps_ns)),
            "command": [None if command is None else command.motion.label for command in commands],
            "mode": [None if command is None else command.mode.label for command in commands],
            "expert": [None if expert is None else expert.label for expert in experts],
        },
        schema_overrides={"command": pl.String, "mode": pl.String, "expert": pl.String},
    )


def known(values: Float64[np.ndarray, "frames"]) -> pl.Series:
    """Values with NaN as null."""
    return pl.Series(values, dtype=pl.Float64, nan_to_null=True)
