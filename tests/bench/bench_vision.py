"""The vision network on one thread: from a picture to a decision, and what training and attacks cost."""

from time import perf_counter

import cv2
import numpy as np
import pytest
import torch
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.models.card import VisionCard
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.models.vision.config import ImagePreprocessConfig, LiteConfig
from sdt_tools.models.vision.loaded import LoadedVisionModel, ready_to_answer, torch_logits
from sdt_tools.models.vision.net import VisionNet, draw_classifier
from sdt_tools.models.vision.pretrained import load_pretrained
from sdt_tools.robustness.image_attacks import AT_ONCE, ImageAttackConfig, attack_images
from sdt_tools.training.vision.batches import trunk_features


@pytest.fixture(scope="module")
def model() -> LoadedVisionModel:
    network = VisionNet(LiteConfig(), ImagePreprocessConfig()).eval()
    load_pretrained(network)
    draw_classifier(network, 0)
    card = VisionCard(kind="vision", seed=0, architecture=network.architecture, preprocess=network.preprocess)
    return ready_to_answer("bench", network.requires_grad_(False), card)


@pytest.fixture(scope="module")
def jpeg() -> bytes:
    """A picture of 640×480 with as much to see as the scene's."""
    coarse = np.random.default_rng(0).integers(0, 256, (60, 80, 3)).astype(np.uint8)
    picture = cv2.resize(coarse, (640, 480), interpolation=cv2.INTER_CUBIC)
    return bytes(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 90])[1].tobytes())


def images(count: int) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (count, 192, 256, 3)).astype(np.uint8)


def test_from_jpeg_to_decision(benchmark: BenchmarkFixture, model: LoadedVisionModel, jpeg: bytes) -> None:
    """At most 30 ms; beside it the same network in torch, on the pixels alone."""
    benchmark(model.decide, jpeg)
    if benchmark.stats:
        pixels_u8 = images(1)
        torch_logits(model.network, pixels_u8)
        started = perf_counter()
        for _ in range(10):
            torch_logits(model.network, pixels_u8)
        in_torch = (perf_counter() - started) / 10
        benchmark.extra_info["ms"] = round(benchmark.stats.stats.median * 1e3, 1)
        benchmark.extra_info["torch_alone_ms"] = round(in_torch * 1e3, 1)


def test_trunk_features_of_an_image(benchmark: BenchmarkFixture, model: LoadedVisionModel) -> None:
    """What plain training pays once for each view of an image."""
    pixels_u8 = images(16)

    def features() -> None:
        with one_torch_thread():
            trunk_features(model.network, 14, pixels_u8)

    benchmark.pedantic(features, rounds=5, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["ms_per_image"] = round(benchmark.stats.stats.median / 16 * 1e3, 1)


@pytest.mark.parametrize("method", ["fgsm", "pgd"])
def test_an_attack_on_an_image(benchmark: BenchmarkFixture, model: LoadedVisionModel, method: str) -> None:
    pixels_u8 = torch.from_numpy(images(AT_ONCE)).permute(0, 3, 1, 2)
    labels = torch.zeros(AT_ONCE, dtype=torch.long)
    config = ImageAttackConfig(method=method, epsilon=2)
    benchmark.pedantic(attack_images, (model.network, pixels_u8, labels, config), rounds=3, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["ms_per_image"] = round(benchmark.stats.stats.median / AT_ONCE * 1e3, 1)
