"""Training images, varied in ways that leave the gesture as it is."""

import math

import cv2
import numpy as np
from jaxtyping import UInt8
from pydantic import Field

from sdt_tools.config import Config


class ViewConfig(Config):
    """How training images are varied, anew for each view.

    Half of them are mirrored, if ``mirror``. ``shift`` and ``zoom`` are the largest shares of the image's size that it
    is moved and grown or shrunk by, ``turn_deg`` the largest turn, ``light`` the largest share by which brightness and
    contrast change; ``hue_deg`` is the largest turn of all hues and ``saturation`` the largest share by which colours
    grow stronger or weaker, so that clothes and walls have colours of which there is no image. Where the trunk's
    features are kept, ``kept`` views of each image are (the first as it is), and an epoch takes one of them; attacked
    images are varied anew in each epoch.
    """

    mirror: bool = True
    shift: float = Field(default=0.06, ge=0.0, lt=0.5)
    zoom: float = Field(default=0.1, ge=0.0, lt=0.9)
    turn_deg: float = Field(default=4.0, ge=0.0, le=180.0)
    light: float = Field(default=0.15, ge=0.0, lt=1.0)
    hue_deg: float = Field(default=0.0, ge=0.0, le=180.0)
    saturation: float = Field(default=0.0, ge=0.0, le=1.0)
    kept: int = Field(default=3, ge=1)


def varied(
    image_u8: UInt8[np.ndarray, "height width 3"], config: ViewConfig, rng: np.random.Generator
) -> UInt8[np.ndarray, "height width 3"]:
    """A varied copy; what comes in from beyond the edges is mirrored at them."""
    height, width = image_u8.shape[:2]
    mirror = config.mirror and rng.random() < 0.5
    turn, grow = math.radians(config.turn_deg) * rng.uniform(-1, 1), 1.0 + config.zoom * rng.uniform(-1, 1)
    across, down = config.shift * rng.uniform(-1, 1, 2) * (width, height)
    brightness, contrast = config.light * rng.uniform(-1, 1, 2)
    c, s = grow * math.cos(turn), grow * math.sin(turn)
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    linear = np.array([[c, -s], [s, c]]) @ np.diag([-1.0 if mirror else 1.0, 1.0])
    motion = np.column_stack([linear, middle + np.array([across, down]) - linear @ middle])
    moved = cv2.warpAffine(image_u8, motion, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
    if config.hue_deg or config.saturation:
        moved = _coloured(moved, config, rng)
    lit = (moved.astype(np.float32) - 128.0) * np.float32(1.0 + contrast) + np.float32(128.0 + 128.0 * brightness)
    rounded: UInt8[np.ndarray, "height width 3"] = np.clip(np.rint(lit), 0.0, 255.0).astype(np.uint8)
    return rounded


def _coloured(
    image_u8: UInt8[np.ndarray, "height width 3"], config: ViewConfig, rng: np.random.Generator
) -> UInt8[np.ndarray, "height width 3"]:
    hues = round(config.hue_deg * rng.uniform(-1, 1) / 2.0)  # OpenCV counts a full turn as 180
    stronger = 1.0 + config.saturation * rng.uniform(-1, 1)
    hsv = cv2.cvtColor(image_u8, cv2.COLOR_RGB2HSV)
    hsv[..., 0] = (hsv[..., 0].astype(np.int16) + hues) % 180
    hsv[..., 1] = np.clip(hsv[..., 1] * stronger, 0.0, 255.0).astype(np.uint8)
    return np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB), np.uint8)
