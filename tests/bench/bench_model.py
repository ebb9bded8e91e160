"""The follow network and what stands around it, on one thread."""

from time import perf_counter

import numpy as np
import pytest
import torch
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.gated_net import GatedNetConfig, new_gated_net
from sdt_tools.models.loaded import LoadedModel, one_torch_thread
from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes
from sdt_tools.robustness.domains import SafetyLevel, distance_rms_m, domains
from sdt_tools.training.augment import AugmentConfig, VariedBatches
from sdt_tools.training.loop import Batch, LoopConfig, run_loop
from sdt_tools.training.recipes import recipe_for
from sdt_tools.training.record import EpochRecord
from sdt_tools.training.safety import SafetyDomains
from sdt_tools.training.specification import SpecificationConfig

SCANS = 4096


@pytest.fixture
def scans() -> np.ndarray:
    """Scans with the real sensor's worst share of codes."""
    rng = np.random.default_rng(0)
    ranges_m = rng.uniform(0.1, 20.0, (SCANS, 541))
    ranges_m[rng.random(ranges_m.shape) < 0.11] = 0.0
    return ranges_m


@pytest.fixture
def model() -> LoadedModel:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=0).eval()
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    return LoadedModel("bench", network, card)


def note_rate(benchmark: BenchmarkFixture, count: int) -> None:
    benchmark.extra_info["us_per_scan"] = round(benchmark.stats.stats.median / count * 1e6, 2)
    benchmark.extra_info["scans_per_s"] = round(count / benchmark.stats.stats.median)


def test_answer_one_scan(benchmark: BenchmarkFixture, model: LoadedModel, scans: np.ndarray) -> None:
    """From the sensor's readings to logits, as a controller asks; at most 500 µs."""
    benchmark(model.predict_logits, scans[:1])
    if benchmark.stats:
        note_rate(benchmark, 1)


def test_answer_many_scans(benchmark: BenchmarkFixture, model: LoadedModel, scans: np.ndarray) -> None:
    benchmark(model.predict_logits, scans)
    if benchmark.stats:
        note_rate(benchmark, SCANS)


def test_network_alone_on_a_batch_of_128(benchmark: BenchmarkFixture, model: LoadedModel) -> None:
    batch = torch.rand(128, 541) * 4.0
    with one_torch_thread(), torch.inference_mode():
        benchmark(model.network, batch)
    if benchmark.stats:
        note_rate(benchmark, 128)


def test_resolve_codes(benchmark: BenchmarkFixture, scans: np.ndarray) -> None:
    """At least 50,000 scans/s; beside it numpy.interp, one scan at a time."""
    config = PreprocessConfig()
    benchmark(resolve_codes, scans, config)
    if benchmark.stats:
        note_rate(benchmark, SCANS)
        benchmark.extra_info["times_faster_than_numpy_interp"] = round(
            _interp_seconds(scans[:256]) / 256 / (benchmark.stats.stats.median / SCANS), 1
        )


def test_distance_to_the_nearest_domain(benchmark: BenchmarkFixture, scans: np.ndarray) -> None:
    resolved = resolve_codes(scans, PreprocessConfig())
    benchmark(distance_rms_m, resolved, SafetyLevel.THREE)
    if benchmark.stats:
        note_rate(benchmark, SCANS)


def test_one_epoch_of_training(benchmark: BenchmarkFixture, scans: np.ndarray) -> None:
    """On as many frames as the paper had, validation included; 80 of them in at most 60 s."""
    labels = np.random.default_rng(0).integers(0, 7, SCANS)
    ranges_m = scans.astype(np.float32)
    preprocess, loop = PreprocessConfig(), LoopConfig(epochs=1)
    batches = VariedBatches(ranges_m[:2705], labels[:2705], 64, AugmentConfig(), preprocess, seed=0)
    resolved = resolve_codes(ranges_m[2705:3275], preprocess)
    validation = Batch(torch.from_numpy(resolved), torch.from_numpy(labels[2705:3275]))
    network = new_follow_net(FollowNetConfig(), preprocess, seed=0)
    benchmark.pedantic(run_loop, (network, batches, validation, loop, 0, _nobody_looks), rounds=3, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["seconds_of_80_epochs"] = round(80 * benchmark.stats.stats.median, 1)


@pytest.mark.parametrize(("level", "arch"), [(3, "plain"), (4, "gate")])
def test_one_epoch_of_certified_training(benchmark: BenchmarkFixture, scans: np.ndarray, level: int, arch: str) -> None:
    """With domains in every step, as in the last epochs; 80 such epochs in at most 240 s. Beside it one without."""
    recipe = recipe_for(SpecificationConfig(level=level), arch)
    labels = np.random.default_rng(0).integers(0, 7, SCANS)
    ranges_m = scans.astype(np.float32)
    batches = VariedBatches(ranges_m[:2705], labels[:2705], 64, recipe.augment, recipe.preprocess, seed=0)
    resolved = resolve_codes(ranges_m[2705:3275], recipe.preprocess)
    validation = Batch(torch.from_numpy(resolved), torch.from_numpy(labels[2705:3275]))
    network: FollowNet
    if arch == "gate":
        network = new_gated_net(GatedNetConfig(), recipe.preprocess, seed=0)
    else:
        network = new_follow_net(FollowNetConfig(), recipe.preprocess, seed=0)
    config = recipe.safety.model_copy(update={"start_share": 0.0, "ramp_share": 0.0})
    safety = SafetyDomains((domains(SafetyLevel(level)),), network, config, seed=0)
    loop = LoopConfig(epochs=1, extra_epochs=0)

    def epoch(term: SafetyDomains | None) -> None:
        run_loop(network, batches, validation, loop, 0, _nobody_looks, term)

    benchmark.pedantic(epoch, (safety,), rounds=3, warmup_rounds=1)
    if benchmark.stats:
        started = perf_counter()
        epoch(None)
        benchmark.extra_info["seconds_of_80_epochs"] = round(80 * benchmark.stats.stats.median, 1)
        benchmark.extra_info["times_as_long_as_without"] = round(
            benchmark.stats.stats.median / (perf_counter() - started), 2
        )


def _interp_seconds(scans: np.ndarray) -> float:
    rays = np.arange(scans.shape[1])
    started = perf_counter()
    for scan in scans:
        valid = scan >= 0.005
        np.interp(rays, rays[valid], scan[valid])
    return perf_counter() - started


def _nobody_looks(record: EpochRecord) -> None:
    pass
