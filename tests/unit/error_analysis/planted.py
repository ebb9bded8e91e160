"""Synthetic drives with errors planted in them, so that tags can be held against the truth."""

from dataclasses import dataclass

import numpy as np
import polars as pl
from jaxtyping import Bool, Float32

from sdt_tools.error_analysis.definitions import ErrorOptions, Tag
from sdt_tools.error_analysis.distance import estimate_epsilon, follows_closely, situations
from sdt_tools.error_analysis.explain import explain
from sdt_tools.error_analysis.labelled import LabelledFrames, frames_of
from sdt_tools.frames import MotionClass

PERIOD_NS = 100_000_000
OPTIONS = ErrorOptions()


def autoregressive(rng: np.random.Generator, frames: int, rho: float) -> np.ndarray:
    """A standard normal series whose neighbours correlate by ``rho``."""
    steps = rng.normal(size=frames)
    series = np.empty(frames)
    series[0] = steps[0]
    for i in range(1, frames):
        series[i] = rho * series[i - 1] + np.sqrt(1 - rho * rho) * steps[i]
    return series


def drive(rng: np.random.Generator, frames: int, rays: int = 121) -> np.ndarray:
    """A scan series: a smooth room, seen while turning and moving slowly, with the noise of the real sensor."""
    angle = np.linspace(-0.75 * np.pi, 0.75 * np.pi, rays)
    waves = rng.normal(size=(6, 2)) / np.arange(1, 7)[:, None]
    heading = 0.35 * autoregressive(rng, frames, 0.995)
    advance = np.exp(0.25 * autoregressive(rng, frames, 0.995))
    level = rng.uniform(1.0, 3.0)
    seen = angle[None] + heading[:, None]
    room = sum(waves[k, 0] * np.sin((k + 1) * seen) + waves[k, 1] * np.cos((k + 1) * seen) for k in range(6))
    return np.clip(level * advance[:, None] * np.exp(0.5 * room) + rng.normal(0, 0.011, seen.shape), 0.05, 20.0)


def table(rng: np.random.Generator, recordings: int, frames: int) -> pl.DataFrame:
    """Predictions that are all right, with features that wander as in a drive."""
    rows = []
    for number in range(recordings):
        range_m = np.abs(1.25 + 0.35 * autoregressive(rng, frames, 0.97)).clip(0.3, 4.0)
        bearing = 0.45 * autoregressive(rng, frames, 0.97)
        near, far, side = range_m < 0.85, range_m > 1.2, np.where(bearing > 0.3, 1, np.where(bearing < -0.3, 2, 0))
        motion = np.where(far, 1 + side, np.where(near, 4 + side, 0))
        names = [MotionClass(value).label for value in motion]
        speed = np.select([far, near], [0.5, -0.4], 0.0) + 0.05 * autoregressive(rng, frames, 0.9)
        rows.append(
            pl.DataFrame(
                {
                    "recording": f"drive_{number:03d}",
                    "recording_id": f"id-{number:03d}",
                    "stamp_ns": np.arange(frames) * PERIOD_NS,
                    "model": "planted",
                    "label": names,
                    "predicted": names,
                    "loss_01": np.zeros(frames, np.float32),
                    "loss_ce": np.full(frames, 0.1, np.float32),
                    "front_range_m": np.exp(0.3 + 0.6 * autoregressive(rng, frames, 0.97)).clip(0.1, 9.0),
                    "operator_range_m": range_m,
                    "operator_bearing_rad": bearing,
                    "speed_mps": speed,
                    "distance_level_3_m": 0.2 + 0.1 * np.abs(autoregressive(rng, frames, 0.97)),
                    "invalid_share": np.abs(0.01 * autoregressive(rng, frames, 0.9)),
                    "motion": names,
                    "mode": "active",
                    "scenario": ("plain", "around_boxes", "through_gate")[number % 3],
                    "light": ("indoor", "sun")[number % 2],
                    **{f"in_level_{level}": range_m < 0.2 + 0.15 * level for level in (1, 2, 3, 4)},
                }
            )
        )
    return pl.concat(rows)


@dataclass(frozen=True, eq=False)
class Planted:
    """Frames with planted errors; ``truth`` says for each what its tag should be."""

    frames: LabelledFrames
    scans: Float32[np.ndarray, "frames rays"]
    truth: np.ndarray

    def scores(self, options: ErrorOptions = OPTIONS) -> dict[Tag, tuple[float, float]]:
        """Precision and recall of each tag that occurs among the planted errors."""
        found = np.array(explain(self.frames, self.scans, options).tagged.tag)
        scores = {}
        for tag in set(self.truth) - {Tag.CORRECT}:
            hits = np.sum((found == tag) & (self.truth == tag))
            scores[Tag(tag)] = (hits / max(1, np.sum(found == tag)), hits / np.sum(self.truth == tag))
        return scores


def with_errors(rows: pl.DataFrame, wrong: Bool[np.ndarray, "frames"]) -> LabelledFrames:
    """``rows`` with the given frames wrong."""
    loss = wrong.astype(np.float32)
    return frames_of(rows.with_columns(loss_01=loss, loss_ce=0.1 + 2 * loss), OPTIONS, "planted")


def drives(seed: int, recordings: int = 20, frames: int = 100) -> tuple[pl.DataFrame, np.ndarray]:
    """A table without errors and its situations."""
    rng = np.random.default_rng(seed)
    scans = np.concatenate([situations(drive(rng, frames), OPTIONS) for _ in range(recordings)])
    return table(rng, recordings, frames), scans


def neighbour_matrix(scans: np.ndarray, epsilon_m: float) -> np.ndarray:
    """Which frames lie within ε of each other and are not copies."""
    exact = scans.astype(np.float64)
    lengths = (exact * exact).sum(axis=1)
    squares = (lengths[:, None] + lengths[None] - 2.0 * exact @ exact.T) / scans.shape[1]
    return (squares > 1e-9) & (squares <= epsilon_m**2)


def beside(frames: LabelledFrames, marked: np.ndarray) -> np.ndarray:
    """Frames just before or after a marked one."""
    follows = follows_closely(frames.recording, frames.stamp_ns, OPTIONS.max_gap_s)
    result = np.zeros(len(marked), bool)
    result[1:] |= follows[1:] & marked[:-1]
    result[:-1] |= follows[1:] & marked[1:]
    return result


def epsilon_of(frames: LabelledFrames, scans: np.ndarray) -> float:
    """ε as the analysis estimates it."""
    return estimate_epsilon(scans, frames.recording, frames.stamp_ns, OPTIONS).epsilon_m


def plant(
    seed: int,
    *,
    conditional: bool = False,
    bursts: int = 0,
    isolated: int = 0,
    transient: int = 0,
    recordings: int = 20,
    frames: int = 120,
) -> Planted:
    """Drives with errors of the kinds asked for, none of which could be taken for another.

    Conditional: four in five frames with ``operator_range_m < 1.0`` in the light ``sun``. Bursts: 4 to 11 frames in a
    row. Isolated: lone frames with a scan like no other. Transient: lone frames with neighbours, all right.
    """
    rng = np.random.default_rng(seed)
    rows, scans = drives(seed, recordings, frames)
    order = with_errors(rows, np.zeros(len(rows), bool))
    odd = rng.choice(len(rows), 3 * isolated, replace=False)
    scans[odd] = situations(np.concatenate([drive(rng, 1) for _ in odd]), OPTIONS) if isolated else scans[odd]
    near = neighbour_matrix(scans, epsilon_of(order, scans))
    truth = np.full(len(rows), Tag.CORRECT, dtype=object)
    inside = ((rows["operator_range_m"] < 1.0) & (rows["light"] == "sun")).to_numpy()
    if conditional:
        truth[inside & (rng.random(len(rows)) < 0.8)] = Tag.CONDITIONAL
    taken = inside & conditional
    for start in rng.choice(len(rows) - 12, bursts, replace=False):
        run = np.arange(start, start + rng.integers(4, 12))
        run = run[(order.recording[run] == order.recording[start]) & ~taken[run]]
        if len(run) >= 3 and np.all(np.diff(run) == 1):
            truth[run] = Tag.UNEXPLAINED
    for kind, candidates, wanted in (
        (Tag.ISOLATED, odd, isolated),
        (Tag.TRANSIENT, rng.permutation(len(rows)), transient),
    ):
        for frame in candidates:
            wrong = truth != Tag.CORRECT
            alone = not wrong[frame] and not beside(order, wrong)[frame] and not wrong[near[frame]].any()
            if alone and not taken[frame] and near[frame].any() == (kind == Tag.TRANSIENT) and wanted > 0:
                truth[frame] = kind
                wanted -= 1
    return Planted(with_errors(rows, truth != Tag.CORRECT), scans, truth)
