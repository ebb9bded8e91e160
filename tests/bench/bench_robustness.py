"""Bounds and attacks of the paper's network in the domains of level 3, on one thread."""

import pytest
import torch
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.attacks import AttackConfig, attack
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import SafetyLevel, domains
from sdt_tools.robustness.intervals import difference_bounds, domain_differences, worst_case_loss

BOXES = domains(SafetyLevel.THREE)


@pytest.fixture
def network() -> FollowNet:
    return new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=0).eval()


def test_bounds_of_240_domains_in_float32(benchmark: BenchmarkFixture, network: FollowNet) -> None:
    """At most 40 ms; beside it, the network's own answers to 240 scans."""
    lower, upper = torch.tensor(BOXES.lower_m).float(), torch.tensor(BOXES.upper_m).float()
    with one_torch_thread(), torch.inference_mode():
        benchmark(difference_bounds, network.layers, lower, upper, BOXES.allowed)
        if benchmark.stats:
            benchmark.extra_info["times_as_long_as_the_answers"] = benchmark.stats.stats.median / _answer_seconds(
                network, upper
            )


def test_bounds_of_240_domains_in_float64(benchmark: BenchmarkFixture, network: FollowNet) -> None:
    """As certificates need them, the network's conversion included."""
    benchmark(domain_differences, network, BOXES)


def test_training_on_the_bounds_of_32_domains(benchmark: BenchmarkFixture, network: FollowNet) -> None:
    """Loss and gradients of one step."""
    lower, upper = torch.tensor(BOXES.lower_m[:32]).float(), torch.tensor(BOXES.upper_m[:32]).float()

    def step() -> None:
        network.zero_grad()
        worst_case_loss(difference_bounds(network.layers, lower, upper, BOXES.allowed)).mean().backward()

    with one_torch_thread():
        benchmark(step)


def test_attack_on_16_domains(benchmark: BenchmarkFixture, network: FollowNet) -> None:
    part = slice(0, 240, 15)
    boxes = DomainSet("every 15th", BOXES.lower_m[part], BOXES.upper_m[part], BOXES.rays[part], BOXES.allowed)
    config = AttackConfig(restarts=8, steps=50)
    benchmark.pedantic(attack, (network, boxes, config), rounds=3, warmup_rounds=1)
    if benchmark.stats:
        ascents = len(boxes) * config.restarts
        benchmark.extra_info["ms_per_ascent"] = benchmark.stats.stats.median / ascents * 1e3


def _answer_seconds(network: FollowNet, scans_m: torch.Tensor) -> float:
    from time import perf_counter

    seconds = []
    for _ in range(20):
        started = perf_counter()
        network(scans_m)
        seconds.append(perf_counter() - started)
    return sorted(seconds)[10]
