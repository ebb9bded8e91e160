"""Simulated robot-seconds per second, at the standard rates, noise and codes included, on two processes."""

from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.evaluation.closed_loop import ClosedLoopConfig
from sdt_tools.evaluation.evaluate import evaluate_follow
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.scene.scenario import STANDARD_FOLLOW


@pytest.mark.parametrize("driver", ["expert", "network"])
def test_closed_loop_on_two_processes(benchmark: BenchmarkFixture, tmp_path: Path, driver: str) -> None:
    """The network is untrained: it costs what a trained one costs, and its runs last until it is found stuck."""
    rounds = iter(range(100))
    model = "expert" if driver == "expert" else str(_untrained(tmp_path / "model"))
    factors = []

    def evaluate() -> None:
        out = tmp_path / str(next(rounds))
        summary = evaluate_follow([model], ["plain"], range(1000, 1040), ClosedLoopConfig(), out, workers=2)
        factors.append(summary.real_time_factor)

    benchmark.pedantic(evaluate, rounds=3)
    benchmark.extra_info["real_time_factor"] = [round(factor) for factor in factors]


def test_seven_scenarios_by_twenty_seeds(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    """140 runs of one driver on two processes, at most 90 s; the expert, so that they last as they should."""
    rounds = iter(range(100))

    def evaluate() -> None:
        out = tmp_path / str(next(rounds))
        evaluate_follow(["expert"], STANDARD_FOLLOW, range(1000, 1020), ClosedLoopConfig(), out, workers=2)

    benchmark.pedantic(evaluate, rounds=1)


def _untrained(folder: Path) -> Path:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 0)
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    save_checkpoint(folder, network, card)
    return folder
