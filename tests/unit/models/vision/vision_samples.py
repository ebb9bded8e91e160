"""Small vision networks, and pictures whose gesture is the colour of one corner."""

from pathlib import Path

import cv2
import numpy as np

from sdt_tools.models.card import VisionCard
from sdt_tools.models.vision.checkpoint import save_vision_checkpoint
from sdt_tools.models.vision.config import ImagePreprocessConfig, LiteConfig, LiteStage, ResNetConfig
from sdt_tools.models.vision.net import VisionNet, draw_vision_weights

SMALL = LiteConfig(
    stem=8,
    stages=(
        LiteStage(blocks=1, kernel=3, stride=1, expand=1, width=8),
        LiteStage(blocks=2, kernel=5, stride=2, expand=2, width=12),
    ),
    head=24,
    dropout=0.0,
)
SMALL_RESNET = ResNetConfig(stem=8, depths=(1, 2), widths=(16, 32))
SMALL_SIZE = ImagePreprocessConfig(width=32, height=24)


def small_network(architecture: LiteConfig | ResNetConfig = SMALL, seed: int = 3) -> VisionNet:
    network = VisionNet(architecture, SMALL_SIZE).eval()
    draw_vision_weights(network, seed)
    return network.requires_grad_(False)


def save_small(folder: Path, network: VisionNet) -> Path:
    card = VisionCard(kind=VisionNet.kind, seed=3, architecture=network.architecture, preprocess=network.preprocess)
    save_vision_checkpoint(folder, network, card)
    return folder


def noise(count: int, height: int = 24, width: int = 32, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (count, height, width, 3)).astype(np.uint8)


def jpeg(picture_bgr_u8: np.ndarray) -> bytes:
    done, data = cv2.imencode(".jpg", picture_bgr_u8)
    assert done
    return bytes(data.tobytes())
