"""The vision network: pixels to logits over the three gestures, in two parts, so that a frozen trunk runs only once."""

from typing import ClassVar

import torch
from jaxtyping import Float
from torch import Tensor, nn

from sdt_tools.errors import ConfigError
from sdt_tools.frames import Gesture
from sdt_tools.models.vision.backbones import build_backbone
from sdt_tools.models.vision.config import ImagePreprocessConfig, LiteConfig, ResNetConfig
from sdt_tools.models.vision.layers import MeanOverImage, Normalise


class VisionNet(nn.Module):
    """Red, green, blue of 0 to 255, float32 [batch, 3, height, width], to logits in the order of ``Gesture``."""

    kind: ClassVar[str] = "vision"
    stem: nn.Sequential
    blocks: nn.Sequential
    head: nn.Sequential

    def __init__(self, architecture: LiteConfig | ResNetConfig, preprocess: ImagePreprocessConfig) -> None:
        super().__init__()
        self.architecture = architecture
        self.preprocess = preprocess
        with torch.random.fork_rng(devices=[]):  # torch draws weights for each layer; nobody else's numbers shall move
            parts = build_backbone(architecture)
            self.normalise = Normalise(preprocess.mean, preprocess.std)
            self.stem, self.blocks, self.head = parts.stem, parts.blocks, parts.head
            self.mean = MeanOverImage()
            self.dropout = nn.Dropout(architecture.dropout)
            self.classifier = nn.Linear(architecture.features, len(Gesture))
        self.to(memory_format=torch.channels_last)  # type: ignore[call-overload]  # the stubs lack it

    def forward(self, images: Float[Tensor, "batch 3 height width"]) -> Float[Tensor, "batch classes"]:
        """The logits."""
        return self.tail(self.trunk(images, 0), 0)

    def trunk(
        self, images: Float[Tensor, "batch 3 height width"], blocks: int
    ) -> Float[Tensor, "batch channels rows columns"]:
        """What comes out of the first ``blocks`` blocks."""
        features: Tensor = self.stem(self.normalise(images))
        for block in list(self.blocks)[:blocks]:
            features = block(features)
        return features

    def tail(
        self, features: Float[Tensor, "batch channels rows columns"], blocks: int
    ) -> Float[Tensor, "batch classes"]:
        """The logits for what came out of the first ``blocks`` blocks."""
        logits: Tensor = self.classifier(self.dropout(self.embed(features, blocks)))
        return logits

    def embed(
        self, features: Float[Tensor, "batch channels rows columns"], blocks: int
    ) -> Float[Tensor, "batch features"]:
        """What the classifier sees: a place in feature space for each image."""
        for block in list(self.blocks)[blocks:]:
            features = block(features)
        embedded: Tensor = self.mean(self.head(features))
        return embedded


def draw_vision_weights(network: VisionNet, seed: int) -> None:
    """Give ``network`` random weights that depend on ``seed`` alone: of a size that keeps the signal's (He 2015)."""
    generator = torch.Generator().manual_seed(seed)
    for layer in network.modules():
        if isinstance(layer, nn.Conv2d):
            nn.init.kaiming_uniform_(layer.weight, nonlinearity="relu", generator=generator)
            assert layer.bias is not None
            nn.init.zeros_(layer.bias)
    draw_classifier(network, seed)


def draw_classifier(network: VisionNet, seed: int) -> None:
    """Give the classifier new random weights that depend on ``seed`` alone."""
    generator = torch.Generator().manual_seed(seed)
    bound = network.classifier.in_features**-0.5
    for parameter in network.classifier.parameters():
        nn.init.uniform_(parameter, -bound, bound, generator=generator)


def tune_last(network: VisionNet, last_blocks: int) -> int:
    """Leave only the last layers to be trained; how many blocks before them are frozen.

    The classifier is trained always; with ``last_blocks`` above 0, the head and so many blocks before it too; the stem
    never.
    Raises ConfigError where the network has fewer blocks.
    """
    blocks = len(network.blocks)
    if not 0 <= last_blocks <= blocks:
        raise ConfigError(f"last_blocks = {last_blocks}: the network has {blocks} blocks")
    network.requires_grad_(False)
    trained: list[nn.Module] = [network.classifier]
    if last_blocks:
        trained += [network.head, *list(network.blocks)[blocks - last_blocks :]]
    for part in trained:
        part.requires_grad_(True)
    return blocks - last_blocks
