"""A small problem with a known answer: which half of the picture is bright says the gesture.

Bright above is enable, bright below is disable, neither is idle. Mirroring left to right changes nothing.
"""

from pathlib import Path

import cv2
import numpy as np
import tomli_w

from sdt_tools.dataset.frames_file import FRAMES_FILE, PICTURE_SCHEMA, FrameBlock, FramesWriter
from sdt_tools.dataset.manifest import FORMAT, MANIFEST_FILE
from sdt_tools.frames import Gesture
from sdt_tools.models.vision.config import ImagePreprocessConfig, LiteConfig, LiteStage
from sdt_tools.training.vision.config import VisionTrainingConfig
from sdt_tools.training.vision.data import ImageSet, VisionData
from sdt_tools.training.vision.views import ViewConfig

TINY = LiteConfig(
    stem=8,
    stages=(
        LiteStage(blocks=1, kernel=3, stride=1, expand=1, width=8),
        LiteStage(blocks=1, kernel=3, stride=2, expand=2, width=16),
        LiteStage(blocks=1, kernel=3, stride=2, expand=2, width=16),
    ),
    head=32,
    dropout=0.0,
)
TINY_CONFIG = VisionTrainingConfig(
    architecture=TINY,
    preprocess=ImagePreprocessConfig(width=32, height=24),
    pretrained=False,
    last_blocks=2,
    epochs=3,
    batch_size=16,
    views=ViewConfig(kept=2, shift=0.0, zoom=0.0, turn_deg=0.0, light=0.05),
)


def draw_images(seed: int, count: int, contrast: int = 60) -> ImageSet:
    rng = np.random.default_rng(seed)
    images_u8 = rng.integers(60, 120, (count, 24, 32, 3)).astype(np.uint8)
    labels = np.arange(count) % 3
    images_u8[labels == Gesture.ENABLE, :12] += np.uint8(contrast)
    images_u8[labels == Gesture.DISABLE, 12:] += np.uint8(contrast)
    return ImageSet(images_u8, labels.astype(np.int64))


def draw_data(train: int = 96, val: int = 48, contrast: int = 60) -> VisionData:
    return VisionData("corners", f"corners {contrast}", draw_images(0, train, contrast), draw_images(1, val, contrast))


def write_dataset(folder: Path, train: int = 48, val: int = 24) -> Path:
    """The same as a data set of JPEG pictures."""
    folder.mkdir()
    with FramesWriter(folder / FRAMES_FILE, [gesture.label for gesture in Gesture], PICTURE_SCHEMA) as writer:
        for split, images in (("train", draw_images(0, train)), ("val", draw_images(1, val))):
            pictures = [cv2.imencode(".png", image[:, :, ::-1])[1].tobytes() for image in images.images_u8]
            writer.write(
                FrameBlock(split, f"id-{split}", f"rec_{split}", np.arange(len(images)), images.labels, tuple(pictures))
            )
        frames_hash = writer.close()
    manifest = {"format": FORMAT, "hash": frames_hash, "classes": [gesture.label for gesture in Gesture]}
    (folder / MANIFEST_FILE).write_text(tomli_w.dumps(manifest | {"config": {"kind": "gesture"}}))
    return folder
