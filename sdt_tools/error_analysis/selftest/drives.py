"""Synthetic drives: features that hang together as in real ones, and scans that agree with them.

A robot follows an operator through rooms at 10 Hz. Range and bearing of the operator wander smoothly; the right motion
follows from them, the speed from the motion, and the front range from the operator and the nearest wall, so that one
feature goes along with another and may be mistaken for it. Scenario and light belong to a whole recording.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Bool, Float32, Float64, Int64

from sdt_tools.frames import MAX_RANGE_M, RAYS, Mode, MotionClass, ray_angles_rad
from sdt_tools.replay.predictions import SCHEMA

PERIOD_NS: Final = 100_000_000
MODEL: Final = "planted"
SCENARIOS: Final = ("plain", "around_boxes", "corridor", "through_gate", "crowd")
LIGHTS: Final = ("indoor", "sun", "dusk")
FRONT_RAD: Final = float(np.deg2rad(60.0))
NEAR_M: Final = 0.45
"""A ray nearer than this puts a scan into a safety domain: more than the paper's 0.2 m, so that scans often do."""
OPERATOR_RADIUS_M: Final = 0.2
NOISE_M: Final = 0.011
"""Standard deviation of a range, as measured on a LMS1xx."""
FASTEST_TURN_RAD: Final = 0.16
"""Turn from one frame to the next that few frames exceed."""


@dataclass(frozen=True, eq=False)
class Wander:
    """What robot, operator and room do in each frame, one recording after the other.

    ``far_m``: how far rays exceed what the safety domains allow, root mean square per ray.
    """

    recording: Int64[np.ndarray, "frames"]
    operator_range_m: Float64[np.ndarray, "frames"]
    operator_bearing_rad: Float64[np.ndarray, "frames"]
    wall_range_m: Float64[np.ndarray, "frames"]
    heading_rad: Float64[np.ndarray, "frames"]
    far_m: Float64[np.ndarray, "frames"]
    motion: Int64[np.ndarray, "frames"]
    speed_mps: Float64[np.ndarray, "frames"]
    invalid_share: Float64[np.ndarray, "frames"]
    idle: Bool[np.ndarray, "frames"]

    @property
    def front_range_m(self) -> Float64[np.ndarray, "frames"]:
        """The nearest thing ahead: the wall, or the operator within 60°."""
        seen = np.abs(self.operator_bearing_rad) < FRONT_RAD
        nearest_m: Float64[np.ndarray, "frames"] = np.minimum(
            self.wall_range_m, np.where(seen, self.operator_range_m, np.inf)
        )
        return nearest_m


def wander(rng: np.random.Generator, recordings: int, frames: int) -> Wander:
    """Drives of ``frames`` frames on average, each between 0.7 and 1.3 times that."""
    lengths = np.round(frames * rng.uniform(0.7, 1.3, recordings)).astype(np.int64)
    longest = int(lengths.max())
    kept = np.arange(longest) < lengths[:, None]

    def series(smooth_frames: float) -> Float64[np.ndarray, "recordings steps"]:
        return smooth_series(rng, recordings, longest, smooth_frames)

    def own(spread: float) -> Float64[np.ndarray, "recordings one"]:
        return rng.normal(0.0, spread, (recordings, 1))

    range_m = np.abs(1.25 + own(0.1) + 0.4 * series(12.0)).clip(0.25, 4.0)
    bearing_rad = (own(0.1) + 0.45 * series(10.0)).clip(-2.0, 2.0)
    motion = right_motion(range_m + rng.normal(0, 0.02, range_m.shape), bearing_rad)
    forward, backward = np.isin(motion, (1, 2, 3)), motion >= 4
    return Wander(
        recording=np.repeat(np.arange(recordings), lengths),
        operator_range_m=range_m[kept],
        operator_bearing_rad=bearing_rad[kept],
        wall_range_m=np.exp(0.05 + own(0.25) + 0.6 * series(12.0)).clip(0.1, 9.0)[kept],
        heading_rad=np.cumsum(FASTEST_TURN_RAD / 4.0 * series(6.0) ** 3, axis=1)[kept],
        far_m=np.abs(own(0.05) + 0.08 * series(15.0))[kept],
        motion=motion[kept],
        speed_mps=(lagging(np.select([forward, backward], [0.5, -0.3], 0.0)) + 0.04 * series(3.0))[kept],
        invalid_share=np.abs(0.02 + own(0.01) + 0.015 * series(5.0))[kept],
        idle=(series(20.0) + own(0.3) > 1.5)[kept],
    )


def predictions_of(wandered: Wander, rng: np.random.Generator) -> pl.DataFrame:
    """Predictions of a model that is always right, as ``sdt replay`` writes them."""
    recordings = int(wandered.recording[-1]) + 1
    scenarios = rng.permutation(np.resize(SCENARIOS, recordings))
    lights = rng.choice(LIGHTS, recordings)
    motion = np.array([motion.label for motion in MotionClass])[wandered.motion]
    number = wandered.recording
    first = np.searchsorted(number, np.arange(recordings))
    front_m = wandered.front_range_m
    beyond_m = np.maximum(front_m - NEAR_M, 0.0) / np.sqrt(RAYS)
    allowed_m = {1: 0.02, 2: 0.05, 3: 0.1, 4: np.inf}
    distances_m = {level: np.hypot(beyond_m, np.maximum(wandered.far_m - allowed_m[level], 0.0)) for level in allowed_m}
    columns = {
        "recording": np.char.add("drive_", np.char.zfill(number.astype(str), 3)),
        "recording_id": np.char.add("id-", number.astype(str)),
        "stamp_ns": (np.arange(len(number)) - first[number]) * PERIOD_NS,
        "model": np.full(len(number), MODEL),
        "label": motion,
        "predicted": motion,
        "loss_01": np.zeros(len(number)),
        "loss_ce": np.full(len(number), 0.1),
        **{f"in_level_{level}": distance_m == 0.0 for level, distance_m in distances_m.items()},
        **{f"distance_level_{level}_m": distances_m[level] for level in (1, 2, 3)},
        "domain_distance_m": distances_m[4],
        "front_range_m": front_m,
        "operator_range_m": wandered.operator_range_m,
        "operator_bearing_rad": wandered.operator_bearing_rad,
        "motion": motion,
        "mode": np.where(wandered.idle, Mode.IDLE.label, Mode.ACTIVE.label),
        "speed_mps": wandered.speed_mps,
        "scenario": scenarios[number],
        "light": lights[number],
        "invalid_share": wandered.invalid_share,
    }
    return pl.DataFrame({name: pl.Series(values).cast(SCHEMA[name]) for name, values in columns.items()})


def scans_of(wandered: Wander, rng: np.random.Generator) -> Float32[np.ndarray, "frames rays"]:
    """The scans, 541 rays: a smooth room, its nearest wall ahead where ``wandered`` says, and the operator in it."""
    angle = ray_angles_rad()
    front = np.abs(angle) <= FRONT_RAD
    scans = np.empty((len(wandered.recording), RAYS), np.float32)
    for number in range(int(wandered.recording[-1]) + 1):
        rows = np.flatnonzero(wandered.recording == number)
        outline = room_outline(rng)
        seen = np.round((angle + wandered.heading_rad[rows, None]) * (len(outline) / (2 * np.pi))).astype(np.int64)
        room = outline[seen % len(outline)]
        room *= (wandered.wall_range_m[rows] / room[:, front].min(axis=1))[:, None]
        operator_m = wandered.operator_range_m[rows, None]
        covered = np.abs(angle - wandered.operator_bearing_rad[rows, None]) < np.arctan(OPERATOR_RADIUS_M / operator_m)
        room = np.where(covered, np.minimum(room, operator_m), room)
        noise_m = NOISE_M * rng.standard_normal(room.shape, dtype=np.float32)
        scans[rows] = (room + noise_m).clip(0.05, MAX_RANGE_M)
    return scans


def room_outline(rng: np.random.Generator) -> Float64[np.ndarray, "directions"]:
    """How far the walls of a room are, all around, in no unit: six waves."""
    direction = np.linspace(0.0, 2 * np.pi, 4320, endpoint=False)
    waves = np.arange(1, 7)[:, None]
    phases, heights = rng.uniform(0, 2 * np.pi, (6, 1)), rng.normal(size=(6, 1)) / np.sqrt(waves)
    outline: Float64[np.ndarray, "directions"] = np.exp(
        0.35 * (heights * np.sin(waves * direction + phases)).sum(axis=0)
    )
    return outline


def right_motion(
    range_m: Float64[np.ndarray, "*shape"], bearing_rad: Float64[np.ndarray, "*shape"]
) -> Int64[np.ndarray, "*shape"]:
    """The motion class that keeps the operator ahead at about a metre."""
    side = np.select([bearing_rad > 0.3, bearing_rad < -0.3], [1, 2], 0)
    return np.select([range_m > 1.2, range_m < 0.85], [MotionClass.FORWARD + side, MotionClass.BACKWARD + side], 0)


def smooth_series(
    rng: np.random.Generator, rows: int, steps: int, smooth_frames: float
) -> Float64[np.ndarray, "rows steps"]:
    """Independent standard normal series without jumps: noise through two first-order filters in turn."""
    keep = 1.0 - 1.0 / smooth_frames
    noise = rng.normal(size=(int(10 * smooth_frames) + steps, rows))
    first = second = np.zeros(rows)
    out = np.empty((steps, rows))
    for step, shock in enumerate(noise):
        first = keep * first + shock
        second = keep * second + first
        if step >= len(noise) - steps:
            out[step - len(noise) + steps] = second
    # The variance of noise through (1 - keep·B)^-2 is (1 + keep²) / (1 - keep²)³.
    series: Float64[np.ndarray, "rows steps"] = (out * np.sqrt((1 - keep**2) ** 3 / (1 + keep**2))).T
    return series


def lagging(target: Float64[np.ndarray, "recordings steps"]) -> Float64[np.ndarray, "recordings steps"]:
    """What follows ``target`` with a time constant of two frames."""
    out = np.empty_like(target)
    value = target[:, 0]
    for step in range(target.shape[1]):
        value = value + 0.4 * (target[:, step] - value)
        out[:, step] = value
    return out
