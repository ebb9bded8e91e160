"""A million scans with the geometry of real ones, made by seed from twenty drives of a P3-AT with a SICK LMS1xx."""

import gzip
import os
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes

RAYS = 541
STEPS = 6
"""Frames interpolated between two successive scans of a drive: those lie as far apart as at a few hertz."""
PERIOD_NS = 20_000_000
NOISE_M = 0.011
"""Noise of a ray of the standing robot (one standard deviation)."""


def real_drives() -> list[np.ndarray]:
    """The ranges of each drive in SDT_DATA, codes filled by interpolation; skips where there are none."""
    paths = sorted(Path(os.environ.get("SDT_DATA", "")).glob("p3at_lms1xx/*.csv.gz"))
    if "SDT_DATA" not in os.environ or not paths:
        pytest.skip("needs SDT_DATA, the folder of external data, with p3at_lms1xx in it")
    fill = PreprocessConfig(code_policy="interpolate")
    drives = []
    for path in paths:
        with gzip.open(path, "rt") as lines:
            ranges_m = np.array([line.split(",")[3 : 3 + RAYS] for line in lines], dtype=np.float64)
        drives.append(resolve_codes(ranges_m, fill))
    return drives


def many_scans(frames: int, seed: int, clip_m: float = 2.5) -> tuple[np.ndarray, np.ndarray]:
    """Situations (float32, clipped) of ``frames`` frames, and the number of the recording of each.

    Every recording is a drive, interpolated, perhaps mirrored, reversed, and seen past something else that stands in
    the way; its ranges are scaled and warped, its heading wanders, every ray has its own noise.
    """
    rng = np.random.default_rng(seed)
    drives = real_drives()
    scans, recording = np.empty((frames, RAYS), np.float32), np.empty(frames, np.int64)
    made = number = 0
    while made < frames:
        one = _varied(drives[number % len(drives)], drives, rng)[: frames - made]
        scans[made : made + len(one)] = one.clip(0.05, clip_m)
        recording[made : made + len(one)] = number
        made, number = made + len(one), number + 1
    return scans, recording


def _varied(drive: np.ndarray, drives: list[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    drive = drive[:, ::-1] if rng.random() < 0.5 else drive
    drive = (drive[::-1] if rng.random() < 0.3 else drive).astype(np.float32)
    rays = np.arange(RAYS)
    warp = 1.0 + 0.06 * np.interp(rays, np.linspace(0, RAYS - 1, 12), rng.normal(size=12))
    drive = drive * (rng.uniform(0.85, 1.15) * warp).astype(np.float32)
    if rng.random() < 0.3:
        other = drives[rng.integers(len(drives))]
        drive = np.minimum(drive, other[rng.integers(len(other))] * rng.uniform(0.9, 1.2))
    at = np.arange((len(drive) - 1) * STEPS)
    part = (at % STEPS / STEPS)[:, None].astype(np.float32)
    between = drive[at // STEPS] * (1 - part) + drive[at // STEPS + 1] * part
    turn = np.cumsum(rng.normal(0.0, 0.5, len(at)))
    turn = np.clip(turn - np.linspace(0.0, turn[-1], len(at)) + rng.uniform(-40, 40), -80, 80)
    turned = np.take_along_axis(between, np.clip(rays + np.round(turn).astype(int)[:, None], 0, RAYS - 1), axis=1)
    return turned + np.float32(NOISE_M) * rng.standard_normal(turned.shape, dtype=np.float32)


def many_predictions(scans: np.ndarray, recording: np.ndarray, seed: int) -> pl.DataFrame:
    """Predictions over them, 5 % wrong: more than half under one condition, a quarter alone, the rest in bursts."""
    rng = np.random.default_rng(seed)
    total = len(scans)
    front_m = scans[:, 150:390].min(axis=1)
    bearing, distance, speed = (_wandering(total, rng) for _ in range(3))
    kinds = np.array(["stay", "forward", "left_forward", "right_forward", "backward", "left_backward"])
    motion = kinds[np.digitize(_wandering(total, rng), [-1.2, -0.5, 0.0, 0.5, 1.2])]
    near = (front_m < np.quantile(front_m, 0.19)) & (motion == "forward")
    wrong = (near & (rng.random(total) < 0.8)) | (rng.random(total) < 0.0125)
    for start in rng.choice(total - 12, total // 1000, replace=False):
        wrong[start : start + rng.integers(4, 12)] = True
    named = np.array([f"drive_{number:04d}" for number in range(recording[-1] + 1)])
    scenarios = np.array(["plain", "around_boxes", "through_gate", "around_table"])
    first = np.searchsorted(recording, recording)
    return pl.DataFrame(
        {
            "recording": named[recording],
            "recording_id": named[recording],
            "stamp_ns": (np.arange(total) - first) * PERIOD_NS,
            "model": "many",
            "label": motion,
            "predicted": np.where(wrong, "right_backward", motion),
            "loss_01": wrong.astype(np.float32),
            "loss_ce": 0.1 + 2.0 * wrong.astype(np.float32),
            **{f"in_level_{level}": front_m < 0.1 * level for level in (1, 2, 3, 4)},
            **{f"distance_level_{level}_m": front_m.astype(np.float32) for level in (1, 2, 3)},
            "domain_distance_m": front_m.astype(np.float32),
            "front_range_m": front_m.astype(np.float32),
            "operator_range_m": np.abs(1.2 + 0.4 * distance),
            "operator_bearing_rad": 0.4 * bearing,
            "motion": motion,
            "command": motion,
            "mode": np.where(_wandering(total, rng) > -1.5, "active", "idle"),
            "speed_mps": 0.3 * speed,
            "scenario": scenarios[recording % 4],
            "light": np.array(["indoor", "sun"])[recording % 2],
            "invalid_share": np.abs(0.01 * _wandering(total, rng)),
        }
    ).with_columns(pl.col("operator_range_m", "operator_bearing_rad", "speed_mps", "invalid_share").cast(pl.Float32))


def _wandering(frames: int, rng: np.random.Generator, window: int = 100) -> np.ndarray:
    """A standard normal series that changes over ``window`` frames."""
    steps = np.cumsum(rng.normal(size=frames + window))
    return (steps[window:] - steps[:-window]) / np.sqrt(window)
