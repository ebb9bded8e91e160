"""Simulated robot-seconds per second, at the standard rates, noise and codes included, on two processes."""

from pathlib import Path

from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.evaluation.closed_loop import ClosedLoopConfig
from sdt_tools.evaluation.evaluate import evaluate_follow


def test_closed_loop_two_processes(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    rounds = iter(range(100))

    def evaluate() -> float:
        out = tmp_path / str(next(rounds))
        return evaluate_follow(["expert"], ["plain"], range(40), ClosedLoopConfig(), out, workers=2).real_time_factor

    benchmark.extra_info["real_time_factor"] = benchmark.pedantic(evaluate, rounds=3)
