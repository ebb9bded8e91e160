"""A video camera: its exposure follows the light with delay, it blurs what it turns past, the sun dazzles it.

Lamps on alternating current flicker: with a rolling shutter that makes bands, which wander from picture to picture.
"""

import math
from dataclasses import dataclass
from typing import Final, no_type_check

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8
from numba import njit

from sdt_tools.scene.rendering.light import Light
from sdt_tools.scene.rendering.photometry import develop, exposure_for, metered_light
from sdt_tools.scene.rendering.projection import Pinhole, View

_SHUTTER_S: Final = 0.016
"""Exposure time in the light of a well-lit office; as long as the light is less, up to a whole picture."""
_LONGEST_SHUTTER_S: Final = 1 / 30
_READOUT_S: Final = 0.025
"""From the first row to the last."""
_LENS: Final = cv2.getGaussianKernel(3, 0.55)
_BRIGHTEST: Final = 5.0
"""Exposure over that of the unadapted camera: electronics amplify no more."""
_SKY_M: Final = 60.0
"""What is farther is sky."""
_GLARE: Final = ((0.035, 6.0), (0.16, 0.55), (0.5, 0.22))
"""Of the sun: the disc and its halos, each with a width (radians) and a strength (1 is a well-lit white sheet)."""


@dataclass(frozen=True)
class VideoStyle:
    """What differs between cameras and lamps."""

    tint_bgr: tuple[float, float, float]
    """White balance that is a little off, and colour of the lamps."""
    bias: float
    """Factor on the exposure that it aims at."""
    settles_s: float
    noise: float
    """Factor on the noise."""
    flicker: float
    """Share by which lamps fall off between the crests of their current."""
    mains_hz: float
    glare: float
    """Factor on what the lens scatters."""


def draw_style(lamps: bool, rng: np.random.Generator) -> VideoStyle:
    """The style of a camera; where there are ``lamps``, of their colour and flicker too."""
    warm = 0.22 * rng.standard_normal() if lamps else 0.06 * rng.standard_normal()
    green = abs(0.07 * rng.standard_normal()) if lamps else 0.02 * rng.standard_normal()
    return VideoStyle(
        tint_bgr=(math.exp(-warm), math.exp(green), math.exp(0.6 * warm)),
        bias=float(math.exp(0.25 * rng.standard_normal())),
        settles_s=float(rng.uniform(0.25, 0.9)),
        noise=float(rng.uniform(0.7, 1.8)),
        flicker=float(rng.uniform(0.05, 0.5)) if lamps and rng.random() < 0.6 else 0.0,
        mains_hz=50.0 if rng.random() < 0.7 else 60.0,
        glare=float(rng.uniform(0.5, 1.6)),
    )


class VideoCamera:
    """Takes pictures one after the other. Its state is the exposure that it has come to."""

    def __init__(self, style: VideoStyle, lens: Pinhole) -> None:
        self._style = style
        self._lens = lens
        self._exposure: float | None = None
        self._last_s = 0.0

    def take(
        self,
        radiance: Float32[np.ndarray, "height width 3"],
        inverse_depth: Float32[np.ndarray, "height width"],
        light: Light,
        view: View,
        turn_radps: float,
        time_s: float,
        noise_key: int,
    ) -> UInt8[np.ndarray, "height width 3"]:
        """The picture of ``radiance``, seen in ``view`` while turning, ``time_s`` after the start.

        ``radiance`` is changed by the glare of the sun.
        """
        style, kind = self._style, light.kind
        if kind.outdoors and light.power > 0.5:
            self._dazzle(radiance, inverse_depth, light, view)
        exposure = self._expose(metered_light(radiance) * kind.gain, time_s)
        shutter_s = min(_LONGEST_SHUTTER_S, _SHUTTER_S / kind.gain**2)
        soft = _soften(radiance, abs(turn_radps) * shutter_s * self._lens.fx)
        tint = np.array(kind.tint_bgr) * style.tint_bgr
        noise = style.noise * kind.noise_codes * max(1.0, exposure) ** 0.5
        rows = _flicker(style, len(radiance), shutter_s, time_s)
        return develop(soft, exposure * kind.gain * tint, noise, noise_key, rows)

    def _expose(self, metered: float, time_s: float) -> float:
        """The exposure of this moment: on its way, in stops, to the one that this light asks for."""
        wanted = min(_BRIGHTEST, exposure_for(metered) * self._style.bias)
        if self._exposure is None or time_s < self._last_s:
            self._exposure = wanted
        else:
            share = 1.0 - math.exp(-(time_s - self._last_s) / self._style.settles_s)
            self._exposure *= (wanted / self._exposure) ** share
        self._last_s = time_s
        return self._exposure

    def _dazzle(
        self,
        radiance: Float32[np.ndarray, "height width 3"],
        inverse_depth: Float32[np.ndarray, "height width"],
        light: Light,
        view: View,
    ) -> None:
        """Add the sun, where the sky around it is seen, and what the lens scatters of it."""
        x, y, z = (view.axes @ light.sun).tolist()
        if z < 0.2:
            return
        lens = self._lens
        column, row = lens.cx + lens.fx * x / z, lens.cy + lens.fy * y / z
        seen = _seen(inverse_depth, column, row)
        if seen <= 0.0:
            return
        beyond = max(0.0, -column, column - lens.width, -row, row - lens.height) / lens.fx
        strength = seen * self._style.glare * math.exp(-3.0 * beyond)
        for width, height in _GLARE:
            sigma = width * lens.fx
            across = np.exp(-0.5 * ((np.arange(lens.width) - column) / sigma) ** 2)
            down = strength * height * np.exp(-0.5 * ((np.arange(lens.height) - row) / sigma) ** 2)
            if across.max() * down.max() > 0.004:
                _add(radiance, across.astype(np.float32), down.astype(np.float32))


def _seen(inverse_depth: Float32[np.ndarray, "height width"], column: float, row: float) -> float:
    """How much of the sun is not hidden: of what lies around its place in the picture, the share that is sky.

    A sun beyond the picture's edge is not hidden.
    """
    height, width = inverse_depth.shape
    x, y = round(column), round(row)
    if not (0 <= x < width and 0 <= y < height):
        return 1.0
    patch = inverse_depth[max(0, y - 9) : y + 10 : 3, max(0, x - 9) : x + 10 : 3]
    return float((patch < 1.0 / _SKY_M).mean())


@njit(cache=True, error_model="numpy")
@no_type_check
def _add(radiance, across, down):
    height, width, _ = radiance.shape
    for y in range(height):
        if down[y] > np.float32(0.001):
            for x in range(width):
                more = down[y] * across[x]
                radiance[y, x, 0] += np.float32(0.85) * more
                radiance[y, x, 1] += more
                radiance[y, x, 2] += more


def _soften(radiance: Float32[np.ndarray, "height width 3"], smear_px: float) -> Float32[np.ndarray, "height width 3"]:
    """What the lens makes of it, and what a turn smears over ``smear_px`` pixels sideways."""
    if smear_px < 0.5:
        return cv2.GaussianBlur(radiance, (3, 3), 0.55)
    size = 2 * math.ceil(smear_px / 2) + 1
    places = np.abs(np.arange(size) - size // 2)
    smear = np.clip(smear_px / 2 + 0.5 - places, 0.0, 1.0)
    smear = np.convolve(smear / smear.sum(), _LENS[:, 0])
    return cv2.sepFilter2D(radiance, -1, smear.astype(np.float32), _LENS.astype(np.float32))


def _flicker(style: VideoStyle, rows: int, shutter_s: float, time_s: float) -> Float64[np.ndarray, "rows"]:
    """The light of each row: lamps pulse twice a period of the mains, and a longer exposure evens that out."""
    if style.flicker == 0.0:
        return np.ones(rows)
    pulse = 2 * math.pi * 2 * style.mains_hz
    evened = abs(math.sin(pulse * shutter_s / 2) / (pulse * shutter_s / 2))
    # A shutter of whole pulses would show nothing; cheap cameras are never so exact.
    depth = style.flicker * max(evened, 0.12)
    times_s = time_s + np.arange(rows) / rows * _READOUT_S
    return 1.0 + depth * np.cos(pulse * times_s)
