"""Textures as the rasterizer reads them: linear light, halved again and again for what is far."""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8, UInt64

FULL: Final = 4096
"""The stored value of a surface that throws back all light.

Compiled into the rasterizer, like the lanes below: numba's cache does not notice when they change, so save raster.py.
"""
LANE_BITS: Final = 21
"""A texel's three colours share one word, each with room for 256 times ``FULL``: weighted sums of whole texels, with
weights that add up to 256, never spill from one colour into the next."""

_CODES = np.arange(256) / 255.0
_LINEAR: Final = np.where(_CODES <= 0.04045, _CODES / 12.92, ((_CODES + 0.055) / 1.055) ** 2.4)
"""The transfer curve of sRGB (IEC 61966-2-1)."""


@dataclass(frozen=True, eq=False)
class TexturePack:
    """All textures in one array of words (blue in the lowest lane, green, red), each with its halvings to one texel.

    ``offsets[texture, level]`` is where a level starts; ``sizes[texture]`` the side of level 0, a power of two.
    """

    texels: UInt64[np.ndarray, "texels"]
    offsets: Int64[np.ndarray, "textures levels"]
    sizes: Int64[np.ndarray, "textures"]


class TextureBank:
    """Collects square pictures and gives each a number."""

    def __init__(self) -> None:
        self._levels: list[list[UInt64[np.ndarray, "side side"]]] = []

    def add(self, image_bgr_u8: UInt8[np.ndarray, "side side 3"]) -> int:
        """The number of a new texture. Its side must be a power of two."""
        side = len(image_bgr_u8)
        assert side & (side - 1) == 0, f"the side of a texture must be a power of two, not {side}"
        linear = cv2.LUT(image_bgr_u8, _LINEAR.astype(np.float32))
        levels = [linear]
        while side > 1:
            side //= 2
            levels.append(cv2.resize(levels[-1], (side, side), interpolation=cv2.INTER_AREA).reshape(side, side, 3))
        self._levels.append([_words(level) for level in levels])
        return len(self._levels) - 1

    def add_color(self, color_bgr: Float64[np.ndarray, "3"]) -> int:
        """The number of a new texture of one colour, given as 0 to 255."""
        pixel = np.clip(np.rint(color_bgr), 0, 255).astype(np.uint8)
        return self.add(np.ascontiguousarray(np.broadcast_to(pixel, (1, 1, 3))))

    def pack(self) -> TexturePack:
        """Everything added so far."""
        offsets = np.zeros((len(self._levels), max(map(len, self._levels))), np.int64)
        flat, start = [], 0
        for texture, levels in enumerate(self._levels):
            for number, level in enumerate(levels):
                offsets[texture, number] = start
                flat.append(level.ravel())
                start += len(flat[-1])
        sizes = np.array([len(levels[0]) for levels in self._levels], np.int64)
        return TexturePack(np.concatenate(flat), offsets, sizes)


def _words(linear: Float32[np.ndarray, "side side 3"]) -> UInt64[np.ndarray, "side side"]:
    lanes = np.rint(linear * FULL).astype(np.uint64)
    words: UInt64[np.ndarray, "side side"] = (
        lanes[..., 0] | lanes[..., 1] << np.uint64(LANE_BITS) | lanes[..., 2] << np.uint64(2 * LANE_BITS)
    )
    return words
