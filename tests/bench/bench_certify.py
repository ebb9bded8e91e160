"""Verdicts on the 240 domains of level 4, and their export, on one thread."""

from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.certify.certify import certify
from sdt_tools.certify.export import check_export, write_export
from sdt_tools.certify.onnx_answers import OnnxNetwork
from sdt_tools.certify.onnx_export import onnx_model
from sdt_tools.certify.verdicts import CertifyConfig
from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.gated_net import GatedNetConfig, new_gated_net
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import SafetyLevel, domains

BOXES = domains(SafetyLevel.FOUR)
BOUNDS_ALONE = CertifyConfig(attack=None)
SEARCHED_TOO = CertifyConfig()


@pytest.fixture(params=["plain", "gated"])
def model(request: pytest.FixtureRequest) -> LoadedModel:
    preprocess = PreprocessConfig()
    network: FollowNet = (
        new_follow_net(FollowNetConfig(), preprocess, seed=0)
        if request.param == "plain"
        else new_gated_net(GatedNetConfig(), preprocess, seed=0)
    )
    card = ModelCard(kind=network.kind, seed=0, architecture=network.architecture, preprocess=preprocess)
    return LoadedModel(request.param, network.eval(), card)


def test_onnx_runtime_answers_240_scans(benchmark: BenchmarkFixture, model: LoadedModel) -> None:
    """The yardstick: one scan of each domain, through the same network."""
    benchmark(OnnxNetwork(onnx_model(model)).logits, BOXES.upper_m)


def test_verdicts_by_bounds_alone(benchmark: BenchmarkFixture, model: LoadedModel) -> None:
    """The measurement of the numerical error, on 2400 scans computed both ways, included."""
    benchmark.pedantic(certify, (model, [BOXES], BOUNDS_ALONE), rounds=5, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["times_as_long_as_onnx_runtime_s_answers"] = (
            benchmark.stats.stats.median / _answers_seconds(model)
        )


def test_verdicts_with_a_search_of_every_domain(benchmark: BenchmarkFixture, model: LoadedModel) -> None:
    benchmark.pedantic(certify, (model, [BOXES], SEARCHED_TOO), rounds=2)
    if benchmark.stats:
        benchmark.extra_info["ms_per_domain"] = benchmark.stats.stats.median / len(BOXES) * 1e3


def test_export_of_240_domains(benchmark: BenchmarkFixture, model: LoadedModel, tmp_path: Path) -> None:
    benchmark.pedantic(write_export, setup=lambda: (_fresh(tmp_path, model), {}), rounds=3)


def test_check_of_an_export_of_24_domains(benchmark: BenchmarkFixture, model: LoadedModel, tmp_path: Path) -> None:
    """Strict reading of text, and run-time type checks slow it down several times here."""
    part = slice(0, 240, 10)
    boxes = DomainSet("every tenth", BOXES.lower_m[part], BOXES.upper_m[part], BOXES.rays[part], BOXES.allowed)
    write_export(tmp_path, model, [boxes])
    ledger = certify(model, [boxes], BOUNDS_ALONE)
    benchmark.pedantic(check_export, (tmp_path, model, [boxes], ledger), rounds=2)


def _fresh(folder: Path, model: LoadedModel) -> tuple[object, ...]:
    new = folder / str(sum(1 for _ in folder.iterdir()))
    new.mkdir()
    return new, model, [BOXES]


def _answers_seconds(model: LoadedModel) -> float:
    network = OnnxNetwork(onnx_model(model))
    seconds = []
    for _ in range(20):
        started = perf_counter()
        network.logits(BOXES.upper_m)
        seconds.append(perf_counter() - started)
    return float(np.median(seconds))
