"""What a cheap camera makes of light: exposure that half adapts, a soft lens, dark corners, sRGB, noise."""

from typing import Final, no_type_check

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int8, UInt8
from numba import njit

from sdt_tools.scene.rendering.light import LightKind

_TARGET: Final = 0.24
"""Mean linear light that the exposure aims at, of full scale."""
_ADAPTS: Final = 0.75
"""The exponent of its correction; 1 would make every picture equally bright."""
_LENS_SIGMA_PX: Final = 0.55
_CORNER_LOSS: Final = 0.22
"""Share of the light that is lost in the picture's corners."""
_STEPS: Final = 4096
"""Entries of the tone curve."""
_NOISE_LENGTH: Final = 1 << 18


def _noise_table() -> Int8[np.ndarray, "length"]:
    """Gaussian noise of standard deviation 16, to be cut into at chance places."""
    rng = np.random.Generator(np.random.SFC64(np.random.SeedSequence(20250101)))
    noise = rng.standard_normal(_NOISE_LENGTH + 4096) * 16
    return np.clip(np.rint(noise), -127, 127).astype(np.int8)


_NOISE: Final = _noise_table()
_LINEAR = (np.arange(_STEPS) + 0.5) / _STEPS
# Up to 0.8 of full scale the plain curve of sRGB, then a shoulder: full scale is reached at 1.6 times white.
_SHOULDER = np.where(_LINEAR < 0.4, 2 * _LINEAR, 1 - 0.2 * np.exp(-(2 * _LINEAR - 0.8) / 0.2 * 0.9))
_TONE: Final = np.where(_SHOULDER <= 0.0031308, 12.92 * _SHOULDER, 1.055 * _SHOULDER ** (1 / 2.4) - 0.055) * 255
_TONE_CURVE: Final = (_TONE + 0.5).astype(np.float32)
"""From linear light in steps to 8-bit codes, half a code up, so that cutting off rounds."""


def metered_light(radiance: Float32[np.ndarray, "height width 3"]) -> float:
    """The mean light of a picture, as a camera meters it."""
    return float(radiance[::8, ::8].mean())


def exposure_for(metered: float) -> float:
    """The exposure that the camera would settle at, of full scale for unit light."""
    return float((_TARGET / max(metered, 1e-3)) ** _ADAPTS)


def take_picture(
    radiance: Float32[np.ndarray, "height width 3"], kind: LightKind, noise_key: int
) -> UInt8[np.ndarray, "height width 3"]:
    """The picture of ``radiance``; ``noise_key`` chooses the noise."""
    tint = np.array(kind.tint_bgr)
    exposure = kind.gain * exposure_for(metered_light(radiance) * kind.gain)
    soft = cv2.GaussianBlur(radiance, (3, 3), _LENS_SIGMA_PX)
    noise = kind.noise_codes * max(1.0, exposure / kind.gain) ** 0.5
    return develop(soft, exposure * tint, noise, noise_key, np.ones(len(radiance)))


def develop(
    radiance: Float32[np.ndarray, "height width 3"],
    gains: Float64[np.ndarray, "3"],
    noise_codes: float,
    noise_key: int,
    row_gains: Float64[np.ndarray, "height"],
) -> UInt8[np.ndarray, "height width 3"]:
    """8-bit colours of ``radiance`` times ``gains`` (a colour) and ``row_gains``, with noise of that deviation."""
    picture = np.empty(radiance.shape, np.uint8)
    scale = np.float32(noise_codes / 16)
    rows = row_gains.astype(np.float32)
    _develop(radiance, gains.astype(np.float32), scale, noise_key, _TONE_CURVE, _NOISE, rows, picture)
    return picture


@njit(cache=True, error_model="numpy")
@no_type_check
def _develop(radiance, gains, noise_scale, noise_key, curve, noise, row_gains, picture):
    height, width, _ = radiance.shape
    middle_x, middle_y = np.float32((width - 1) / 2), np.float32((height - 1) / 2)
    falloff = np.float32(_CORNER_LOSS) / (middle_x * middle_x + middle_y * middle_y)
    gain, loss = np.empty(3 * width, np.float32), np.empty(3 * width, np.float32)
    for i in range(3 * width):
        across = np.float32(i // 3) - middle_x
        gain[i] = gains[i % 3] * np.float32(_STEPS / 2)
        loss[i] = gain[i] * falloff * across * across
    # Loops of one kind of work each, over one row: all but the look-up run on vectors.
    step, codes = np.empty(3 * width, np.int32), np.empty(3 * width, np.float32)
    state = np.uint64(noise_key) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(1)
    for y in range(height):
        # A step of a 64-bit linear congruential generator (Knuth's MMIX constants) a row.
        state = state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
        grain = noise[np.int64(state >> np.uint64(46)) :]
        light, row = radiance[y].ravel(), picture[y].ravel()
        down = np.float32(y) - middle_y
        kept = np.float32(1.0) - falloff * down * down
        brighter = row_gains[y]
        for i in range(3 * width):
            step[i] = np.int32(min(light[i] * brighter * (gain[i] * kept - loss[i]), np.float32(_STEPS - 1)))
        for i in range(3 * width):
            codes[i] = curve[step[i]]
        for i in range(3 * width):
            code = codes[i] + np.float32(grain[i]) * noise_scale
            row[i] = np.uint8(min(max(code, np.float32(0.0)), np.float32(255.0)))
