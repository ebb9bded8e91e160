"""What the trained layers see in an epoch: features of the frozen trunk, kept where they may be.

Without an attack the trunk always says the same of an image, so that it is asked once for each view of it, and its
features are kept in half precision. An attacked image is another one in every step: nothing of it is kept.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from jaxtyping import Float16, Float32, Int64, UInt8
from torch import Tensor

from sdt_tools.models.vision.net import VisionNet
from sdt_tools.robustness.image_attacks import AT_ONCE, fgsm
from sdt_tools.training.vision.data import ImageSet, as_batch
from sdt_tools.training.vision.views import ViewConfig, varied

_KEPT_VIEWS: Final = 7
"""Sets the draws of kept views apart from those of epochs."""


@dataclass(frozen=True, eq=False)
class FeatureBatch:
    """What comes out of the frozen trunk, and the classes."""

    features: Float32[Tensor, "batch channels rows columns"]
    labels: Int64[Tensor, "batch"]


class GestureBatches:
    """Epochs of shuffled batches; one depends on ``seed`` and its number alone, and, attacked, on the network.

    The trunk is the first ``frozen`` blocks of ``network``, whose weights must not change.
    """

    def __init__(
        self, network: VisionNet, frozen: int, images: ImageSet, batch_size: int, views: ViewConfig, seed: int
    ) -> None:
        self._network, self._frozen = network, frozen
        self._images, self._views, self._seed = images, views, seed
        self._size = min(batch_size, len(images))
        self._kept: Float16[Tensor, "views images channels rows columns"] | None = None

    def __len__(self) -> int:
        return len(self._images) // self._size

    def plain(self, epoch: int) -> Iterator[FeatureBatch]:
        """The batches of a plain epoch, of kept features."""
        if self._kept is None:
            self._kept = self._keep()
        rng = np.random.default_rng((self._seed, epoch))
        for chosen in self._shuffled(rng):
            view = rng.integers(len(self._kept), size=len(chosen))
            yield FeatureBatch(self._kept[view, chosen].float(), self._labels(chosen))

    def attacked(self, epoch: int, epsilon: int, clean_share: float) -> Iterator[FeatureBatch]:
        """The batches of an epoch attacked by the fast gradient sign, against the network as it is by then.

        ``clean_share`` of the images are left as they are, by chance.
        """
        rng = np.random.default_rng((self._seed, epoch))
        for chosen in self._shuffled(rng):
            images_u8 = np.stack([varied(self._images.images_u8[place], self._views, rng) for place in chosen])
            clean = torch.from_numpy(rng.random(len(chosen)) < clean_share)
            yield FeatureBatch(self._attack(images_u8, chosen, clean, epsilon), self._labels(chosen))

    def _attack(
        self,
        images_u8: UInt8[np.ndarray, "batch height width 3"],
        chosen: Int64[np.ndarray, "batch"],
        clean: Tensor,
        epsilon: int,
    ) -> Float32[Tensor, "batch channels rows columns"]:
        training = self._network.training
        self._network.eval()
        parts = []
        for start in range(0, len(chosen), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            images, labels = as_batch(images_u8[part]), self._labels(chosen[part])
            attacked = fgsm(self._network, images, labels, epsilon)
            attacked = torch.where(clean[part, None, None, None], images, attacked)
            with torch.no_grad():
                parts.append(self._network.trunk(attacked, self._frozen))
        self._network.train(training)
        return torch.cat(parts)

    def _shuffled(self, rng: np.random.Generator) -> Int64[np.ndarray, "batches batch"]:
        """Batches of one size; what is left over waits for another epoch's shuffle."""
        return rng.permutation(len(self._images))[: len(self) * self._size].reshape(-1, self._size)

    def _labels(self, chosen: Int64[np.ndarray, "batch"]) -> Int64[Tensor, "batch"]:
        return torch.from_numpy(self._images.labels[chosen])

    def _keep(self) -> Float16[Tensor, "views images channels rows columns"]:
        kept = []
        for view in range(self._views.kept):
            rng = np.random.default_rng((self._seed, view, _KEPT_VIEWS))
            images_u8 = self._images.images_u8
            if view:
                images_u8 = np.stack([varied(image, self._views, rng) for image in images_u8])
            kept.append(trunk_features(self._network, self._frozen, images_u8))
        return torch.stack(kept)


def trunk_features(
    network: VisionNet, frozen: int, images_u8: UInt8[np.ndarray, "images height width 3"]
) -> Float16[Tensor, "images channels rows columns"]:
    """What comes out of the first ``frozen`` blocks, in half precision."""
    with torch.no_grad():
        parts = [
            network.trunk(as_batch(images_u8[start : start + AT_ONCE]), frozen).half()
            for start in range(0, len(images_u8), AT_ONCE)
        ]
    return torch.cat(parts)
