"""Recorders killed at random moments: how much of their last second is lost."""

import sys
from pathlib import Path

import numpy as np
from pytest_benchmark.fixture import BenchmarkFixture

sys.path.append(str(Path(__file__).parents[1] / "unit" / "recording"))

from recording_killed import kill_a_recorder

KILLS = 50


def test_fifty_kills(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)

    def kill() -> list[float]:
        lost_s = []
        for number in range(KILLS):
            folder = tmp_path / str(number)
            folder.mkdir()
            lost_s.append(kill_a_recorder(folder, int(rng.integers(10, 150))))
        return lost_s

    lost_s = benchmark.pedantic(kill, rounds=1)
    benchmark.extra_info |= {"kills": KILLS, "lost_s_most": max(lost_s), "lost_s_median": float(np.median(lost_s))}
    assert max(lost_s) <= 1.0
