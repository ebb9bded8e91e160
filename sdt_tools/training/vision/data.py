"""Images with their gestures, as the network sees them up to its first layer."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int64, UInt8
from torch import Tensor


@dataclass(frozen=True, eq=False)
class ImageSet:
    """The images of one split: red, green, blue at the network's size; ``labels`` in the order of ``Gesture``."""

    images_u8: UInt8[np.ndarray, "images height width 3"]
    labels: Int64[np.ndarray, "images"]

    def __len__(self) -> int:
        return len(self.labels)


@dataclass(frozen=True, eq=False)
class VisionData:
    """Both splits, and what they are called and known by."""

    name: str
    hash: str
    train: ImageSet
    val: ImageSet


def as_batch(images_u8: UInt8[np.ndarray, "images height width 3"]) -> Float[Tensor, "images 3 height width"]:
    """Images as the network takes them."""
    return torch.from_numpy(np.ascontiguousarray(images_u8)).permute(0, 3, 1, 2).float()
