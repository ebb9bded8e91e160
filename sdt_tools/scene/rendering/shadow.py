"""Hard shadows on the floor, cast by the sun."""

import numpy as np
from jaxtyping import Float64, Int32

from sdt_tools.scene.rendering.light import Light
from sdt_tools.scene.rendering.mesh import CAST, EMPTY, Mesh

_LEAST_ELEVATION = 0.12
"""Sine of the lowest sun that casts shadows: those of a lower one would reach too far."""


def shadow_of(
    points_m: Float64[np.ndarray, "points 3"], triangles: Int32[np.ndarray, "triangles 3"], light: Light
) -> Mesh:
    """What ``points_m`` and their ``triangles`` keep the sun from, flat on the floor; nothing without a sun.

    Its light is the share of the floor's light that does not come from the sun.
    """
    if not light.kind.outdoors or light.power < 0.5 or light.sun[2] < _LEAST_ELEVATION:
        return EMPTY
    flat = points_m - points_m[:, 2:] / light.sun[2] * light.sun
    flat[:, 2] = 0.0
    ambient = light.kind.ambient
    kept = ambient / (ambient + light.power * float(light.sun[2]))
    up = np.zeros_like(flat)
    up[:, 2] = 1.0
    return Mesh(
        flat,
        up,
        np.zeros((len(flat), 2)),
        np.full(len(flat), kept),
        triangles,
        np.zeros(len(triangles), np.int32),
        np.full(len(triangles), CAST, np.uint8),
    )
