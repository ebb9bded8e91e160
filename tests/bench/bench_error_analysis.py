"""Counting neighbours of few frames, and a small analysis; a million frames are in bench_million_frames.py."""

import numpy as np
import polars as pl
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.explain import explain
from sdt_tools.error_analysis.labelled import frames_of
from sdt_tools.error_analysis.neighbours import build_index, count_neighbours

RAYS = 541
QUERIES = 1500
OPTIONS = ErrorOptions()


def drives(recordings: int, frames: int) -> np.ndarray:
    """Scans as a robot sees them that turns and drives slowly through smooth rooms."""
    rng = np.random.default_rng(0)
    angle = np.linspace(-0.75 * np.pi, 0.75 * np.pi, RAYS)
    scans = []
    for _ in range(recordings):
        waves = rng.normal(size=(6, 2)) / np.arange(1, 7)[:, None]
        heading = np.cumsum(rng.normal(0, 0.03, frames))
        advance = np.exp(np.cumsum(rng.normal(0, 0.02, frames)).clip(-0.8, 0.8))
        seen = angle[None] + heading[:, None]
        room = sum(waves[k, 0] * np.sin((k + 1) * seen) + waves[k, 1] * np.cos((k + 1) * seen) for k in range(6))
        ranges_m = rng.uniform(1, 3) * advance[:, None] * np.exp(0.5 * room)
        scans.append((ranges_m + rng.normal(0, 0.011, seen.shape)).clip(0.05, 2.5).astype(np.float32))
    return np.concatenate(scans)


def successive_m(scans: np.ndarray) -> float:
    return float(np.percentile(np.sqrt(np.mean(np.diff(scans.astype(np.float64), axis=0) ** 2, axis=1)), 90))


def test_search_alone(benchmark: BenchmarkFixture) -> None:
    scans = drives(100, 300)
    rows = np.random.default_rng(1).choice(len(scans), QUERIES, replace=False)
    index, epsilon_m = build_index(scans), successive_m(scans)
    benchmark(count_neighbours, index, rows, epsilon_m, np.ones((1, len(scans)), bool))
    if benchmark.stats:
        benchmark.extra_info["us_per_query"] = round(benchmark.stats.stats.min / QUERIES * 1e6, 1)


def test_explain_15000_frames(benchmark: BenchmarkFixture) -> None:
    """What `sdt errors` does once the scans are read; at most 30 s."""
    recordings, length = 60, 250
    rng = np.random.default_rng(2)
    scans = drives(recordings, length)
    total = len(scans)
    numeric = {
        name: rng.normal(size=total).cumsum() % 3.0
        for name in ("front_range_m", "operator_range_m", "operator_bearing_rad", "speed_mps")
    }
    table = pl.DataFrame(
        {
            "recording": np.repeat([f"drive_{n:03d}" for n in range(recordings)], length),
            "recording_id": np.repeat([str(n) for n in range(recordings)], length),
            "stamp_ns": np.tile(np.arange(length) * 100_000_000, recordings),
            "model": "bench",
            "scenario": np.repeat(["plain", "around_boxes"] * (recordings // 2), length),
            "motion": rng.choice(["stay", "forward", "left_forward", "backward"], total),
            "loss_01": (rng.random(total) < np.where(numeric["front_range_m"] < 0.6, 0.8, 0.05)).astype(np.float32),
            **numeric,
        }
    )
    features = {"features": [*numeric, "motion", "scenario"]}
    options = ErrorOptions(conditions=features)
    frames = frames_of(table, options, "bench")
    explanation = benchmark.pedantic(explain, (frames, scans, options), rounds=2, warmup_rounds=1)
    assert explanation.search.confirmed
