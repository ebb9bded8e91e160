"""What stands around a yard: hedges, trees and houses, too far to matter to anything but the eye."""

import math
from typing import Final

import cv2
import numpy as np
from jaxtyping import Float64

from sdt_tools.scene.rendering import paint
from sdt_tools.scene.rendering.light import Light
from sdt_tools.scene.rendering.mesh import Mesh, join, panel, vector
from sdt_tools.scene.rendering.texture import TextureBank

_AROUND: Final = 22
_WHOLE: Final = np.array([0.0, 1.0])


def build_skyline(area_m: Float64[np.ndarray, "4"], light: Light, bank: TextureBank, rng: np.random.Generator) -> Mesh:
    """A ring of fronts around ``area_m``, each a hedge, a row of trees or a house, with gaps of open sky."""
    middle = (area_m[:2] + area_m[2:]) / 2
    radius_m = float(np.linalg.norm(area_m[2:] - area_m[:2])) / 2 + rng.uniform(9.0, 18.0)
    house, green = bank.add(_house(rng)), bank.add(_leaves(rng))
    fronts = []
    for place in range(_AROUND):
        kind = rng.choice(3, p=(0.3, 0.45, 0.25))
        if kind == 2:
            continue
        azimuth = 2 * math.pi * (place + rng.uniform(0.0, 0.5)) / _AROUND
        width = rng.uniform(0.7, 1.3) * 2 * math.pi * radius_m / _AROUND
        height = rng.uniform(4.0, 9.0) if kind == 0 else rng.uniform(1.0, 6.0)
        at = radius_m * rng.uniform(0.9, 1.4)
        out = np.array([math.cos(azimuth), math.sin(azimuth)])
        x, y = (middle + at * out - width / 2 * np.array([out[1], -out[0]])).tolist()
        front = panel(
            vector(x, y, 0.0),
            vector(width * float(out[1]), -width * float(out[0]), 0.0),
            vector(0.0, 0.0, height),
            _WHOLE,
            _WHOLE,
            (max(1.0, float(round(width / 5.0))), max(1.0, float(round(height / 5.0))))
            if kind == 0
            else (width / 3.0, height / 3.0),
            house if kind == 0 else green,
        )
        facing = np.tile([-float(out[0]), -float(out[1]), 0.3], (len(front.points_m), 1))
        fronts.append(front.lit(light.at(front.points_m, facing / math.hypot(1.0, 0.3))))
    return join(fronts)


def _house(rng: np.random.Generator) -> paint.Picture:
    color = paint.color_hsv(rng.uniform(0, 50), rng.uniform(0.05, 0.5), rng.uniform(0.5, 0.9))
    front = paint.plaster(rng, color).astype(np.float32)
    for x in (34, 150):
        cv2.rectangle(front, (x - 6, 70), (x + 66, 186), (228.0, 230.0, 230.0), -1)
        cv2.rectangle(front, (x, 76), (x + 60, 180), (96.0, 82.0, 70.0), -1)
        cv2.line(front, (x + 30, 76), (x + 30, 180), (228.0, 230.0, 230.0), 4)
    return paint.finish(front)


def _leaves(rng: np.random.Generator) -> paint.Picture:
    color = paint.color_hsv(rng.uniform(75, 120), rng.uniform(0.4, 0.65), rng.uniform(0.25, 0.45))
    leaves = paint.sheet(color) * (1 + 0.3 * paint.noise(rng, (12, 12)) + 0.2 * paint.noise(rng, (50, 50)))[..., None]
    return paint.finish(leaves.astype(np.float32))
