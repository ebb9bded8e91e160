"""Fifty recordings killed at random moments: what is lost of each."""

from pathlib import Path
from statistics import median

from killed_recordings import check_that_it_is_saved, kill_a_recording
from pytest_benchmark.fixture import BenchmarkFixture

KILLS = 50


def test_kills(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    numbers = iter(range(1000, 2000))
    lost_s: list[float] = []
    messages: list[int] = []

    def kill_and_repair() -> None:
        seed = next(numbers)
        killed = kill_a_recording(tmp_path / f"{seed}.mcap", seed)
        messages.append(check_that_it_is_saved(killed))
        lost_s.append(killed.lost_s)

    benchmark.pedantic(kill_and_repair, rounds=KILLS if benchmark.enabled else 1)
    assert max(lost_s) <= 1.0
    benchmark.extra_info |= {
        "kills": len(lost_s),
        "worst_loss_s": round(max(lost_s), 3),
        "median_loss_s": round(median(lost_s), 3),
        "messages_saved_each": round(median(messages)),
    }
