"""One side of a wall: its paint, its skirting, what hangs on it, and the dark rim where it meets the floor."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.scene.layout import Wall
from sdt_tools.scene.rendering import paint
from sdt_tools.scene.rendering.decor import wall_decor
from sdt_tools.scene.rendering.light import Light
from sdt_tools.scene.rendering.mesh import DECAL, ONE_SIDED, SHADE, Mesh, Vector, join, panel, vector
from sdt_tools.scene.rendering.texture import TextureBank

_TILE_M: Final = 1.6
"""What one wall texture covers."""
_RIM_M: Final = 0.22
"""How far the soft dark rim reaches over the floor."""
_WHOLE: Final = np.array([0.0, 1.0])


@dataclass(frozen=True)
class WallPaint:
    """What walls are painted with: ``bands`` from below, each (its upper edge in metres, texture), then ``base``."""

    base: int
    bands: tuple[tuple[float, int], ...] = ()
    decor_per_m: float = 0.0


def draw_wall_paint(bank: TextureBank, rng: np.random.Generator) -> WallPaint:
    """The paint of all walls of a place: plaster (in one or two colours), brick, blocks, tiles or boards."""
    kind = rng.choice(5, p=(0.5, 0.15, 0.15, 0.08, 0.12))
    hue, saturation, value = rng.uniform(0, 360), rng.uniform(0.02, 0.3), rng.uniform(0.6, 0.95)
    bands: list[tuple[float, int]] = []
    if rng.random() < 0.75:
        skirting = paint.color_hsv(rng.uniform(0, 360), rng.uniform(0, 0.3), rng.uniform(0.15, 0.8))
        bands.append((float(rng.uniform(0.06, 0.12)), bank.add_color(skirting)))
    if kind == 0:
        picture = paint.plaster(rng, paint.color_hsv(hue, saturation, value))
        if rng.random() < 0.4:
            lower = paint.color_hsv(hue, min(1.0, saturation + 0.25), value * 0.7)
            bands.append((float(rng.uniform(1.0, 1.4)), bank.add(paint.plaster(rng, lower))))
    elif kind == 1:
        brick = paint.color_hsv(rng.uniform(5, 25), rng.uniform(0.3, 0.6), rng.uniform(0.45, 0.75))
        picture = paint.tiles(rng, brick, 16, 6, running=True)
    elif kind == 2:
        picture = paint.tiles(rng, paint.color_hsv(hue, saturation / 3, value * 0.85), 8, 4, running=True)
    elif kind == 3:
        picture = paint.tiles(rng, paint.color_hsv(hue, saturation, value), 8, 8)
    else:
        wood = paint.color_hsv(rng.uniform(18, 36), rng.uniform(0.3, 0.55), rng.uniform(0.5, 0.8))
        picture = np.ascontiguousarray(np.rot90(paint.planks(rng, wood, rows=8)))
    return WallPaint(bank.add(picture), tuple(bands), float(rng.uniform(0.1, 0.4)))


def build_wall(
    wall: Wall,
    height_m: float,
    wall_paint: WallPaint,
    light: Light,
    bank: TextureBank,
    rng: np.random.Generator,
    cell_m: float = 0.8,
) -> tuple[Mesh, Mesh]:
    """The side of ``wall`` that lies to its right (seen from its start to its end), lit; and its rim on the floor.

    Light is known at corners no farther apart than ``cell_m``.
    """
    start = vector(wall.x0_m, wall.y0_m, 0.0)
    along = vector(wall.x1_m - wall.x0_m, wall.y1_m - wall.y0_m, 0.0)
    length = float(np.linalg.norm(along))
    if length < 1e-6:
        return join([]), join([])
    cuts = np.linspace(0, 1, int(np.ceil(length / cell_m)) + 1)
    parts, low = [], 0.0
    for high, texture in (*wall_paint.bands, (height_m, wall_paint.base)):
        if high <= low:
            continue
        rows = (_rows(low, high) - low) / (high - low)
        strip = panel(
            start + vector(0.0, 0.0, low),
            along,
            vector(0.0, 0.0, high - low),
            cuts,
            rows,
            (length / _TILE_M, (high - low) / _TILE_M),
            texture,
            ONE_SIDED,
        )
        z = strip.points_m[:, 2]
        corner = 1 - 0.30 * np.exp(-z / 0.2) - 0.22 * np.exp(-(height_m - z) / 0.3)
        parts.append(strip.lit(light.at(strip.points_m, strip.normals) * corner))
        low = high
    parts += _hang(start, along, length, height_m, wall_paint, light, bank, rng)
    outward = vector(along[1], -along[0], 0.0) / length * _RIM_M
    rim = panel(start + outward, along, -outward, cuts[[0, -1]], _WHOLE, (1.0, 1.0), 0, SHADE)
    return join(parts), rim.lit(np.array([1.0, 1.0, 0.62, 0.62]))


def _rows(low_m: float, high_m: float) -> Float64[np.ndarray, "rows"]:
    """Heights to cut a strip at: close together where floor and ceiling darken it."""
    inner = [z for z in (0.12, 0.3, 0.6, 1.2, 1.8, high_m - 0.5, high_m - 0.15) if low_m + 0.05 < z < high_m - 0.05]
    return np.array([low_m, *sorted(inner), high_m])


def _hang(
    start_m: Vector,
    along_m: Vector,
    length_m: float,
    height_m: float,
    wall_paint: WallPaint,
    light: Light,
    bank: TextureBank,
    rng: np.random.Generator,
) -> list[Mesh]:
    """Things on this side of the wall, side by side, as many as there is room and taste for."""
    parts, place = [], float(rng.uniform(0.2, 1.2))
    direction = along_m / length_m
    for _ in range(int(rng.poisson(wall_paint.decor_per_m * length_m))):
        decor = wall_decor(rng)
        if place + decor.width_m > length_m - 0.2:
            break
        if decor.bottom_m + decor.height_m > height_m - 0.1:
            continue
        sheet = panel(
            start_m + direction * place + vector(0.0, 0.0, decor.bottom_m),
            direction * decor.width_m,
            vector(0.0, 0.0, decor.height_m),
            _WHOLE,
            np.array([0.0, 0.5, 1.0]),
            (1.0 - 1 / paint.SIDE, 1.0 - 1 / paint.SIDE),
            bank.add(decor.picture),
            ONE_SIDED | DECAL,
            uv_origin=(0.5 / paint.SIDE, 0.5 / paint.SIDE),
        )
        own = np.full(len(sheet.points_m), decor.glow)
        parts.append(sheet.lit(own if decor.glow else light.at(sheet.points_m, sheet.normals)))
        place += decor.width_m + float(rng.uniform(0.3, 2.0))
    return parts
