"""Images with their gestures, as the network sees them up to its first layer."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Int64, UInt8
from torch import Tensor

from sdt_tools.dataset.load import PictureSet, load_gestures
from sdt_tools.errors import DatasetError, RecordingError
from sdt_tools.frames import Gesture
from sdt_tools.models.vision.config import ImagePreprocessConfig
from sdt_tools.models.vision.pictures import decode_picture, resize_picture


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


def load_vision_data(folder: Path, preprocess: ImagePreprocessConfig) -> VisionData:
    """The data set of gestures in ``folder`` as a network with ``preprocess`` sees it.

    Raises DatasetError where it is missing, damaged or not of gestures, or a picture in it cannot be decoded.
    """
    dataset = load_gestures(folder)
    expected = tuple(gesture.label for gesture in Gesture)
    if dataset.classes != expected:
        raise DatasetError(f"{folder}: its classes are {', '.join(dataset.classes)}, not {', '.join(expected)}")
    train, val = (_images(folder, part, preprocess) for part in (dataset.train, dataset.val))
    return VisionData(folder.resolve().name, dataset.hash, train, val)


def as_batch(images_u8: UInt8[np.ndarray, "images height width 3"]) -> Float[Tensor, "images 3 height width"]:
    """Images as the network takes them."""
    return torch.from_numpy(np.ascontiguousarray(images_u8)).permute(0, 3, 1, 2).float()


def _images(folder: Path, pictures: PictureSet, preprocess: ImagePreprocessConfig) -> ImageSet:
    images_u8 = np.empty((len(pictures), preprocess.height, preprocess.width, 3), np.uint8)
    for place, data in enumerate(pictures.pictures):
        try:
            images_u8[place] = resize_picture(decode_picture(data), preprocess)
        except RecordingError as error:
            where = f"{pictures.recordings[place]} at {pictures.stamps_ns[place]} ns"
            raise DatasetError(f"{folder}: {where}: {error}; build the data set again") from None
    return ImageSet(images_u8, pictures.labels.copy())  # torch wants arrays that may be written to
