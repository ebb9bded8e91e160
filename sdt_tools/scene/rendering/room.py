"""The surroundings: floor, what is overhead, and the layout's walls raised to full height, as one lit mesh."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.frames import MAX_RANGE_M
from sdt_tools.scene.layout import Wall
from sdt_tools.scene.rendering import paint
from sdt_tools.scene.rendering.light import Light, Roof
from sdt_tools.scene.rendering.mesh import DECAL, ONE_SIDED, Mesh, join, panel, vector
from sdt_tools.scene.rendering.texture import TextureBank
from sdt_tools.scene.rendering.wall import WallPaint, build_wall, draw_wall_paint

_TILE_M: Final = 1.6
"""What one floor texture covers."""
_HALL_M: Final = MAX_RANGE_M + 5.0
"""Where no wall closes the view, a hall does so, this far around everything: farther than the LiDAR sees."""
_SKY_M: Final = 120.0


def build_room(
    walls: Sequence[Wall],
    bounds_m: Float64[np.ndarray, "4"],
    height_m: float,
    light: Light,
    bank: TextureBank,
    rng: np.random.Generator,
) -> tuple[Mesh, Mesh]:
    """Floor, walls with what hangs on them and ceiling or sky, lit; and the soft dark rims that lie over it."""
    hall = bounds_m + np.array([-_HALL_M, -_HALL_M, _HALL_M, _HALL_M])
    parts = [_floor(bounds_m, hall, light, bank, rng)]
    wall_paint = draw_wall_paint(bank, rng)
    if light.kind.outdoors:
        parts.append(_sky(bounds_m, bank))
        if light.roof is not None:
            parts += [_slab(light.roof, light, bank, rng), _underside(light.roof, height_m, light, bank, rng)]
    else:
        parts += _ceiling(bounds_m, hall, height_m, light, bank, rng)
        bare = WallPaint(wall_paint.base, wall_paint.bands)
        parts += [build_wall(side, height_m, bare, light, bank, rng, cell_m=6.0)[0] for side in _sides(hall)]
    rims = []
    for wall in walls:
        for side in (wall, Wall(wall.x1_m, wall.y1_m, wall.x0_m, wall.y0_m)):
            solid, rim = build_wall(side, height_m, wall_paint, light, bank, rng)
            parts.append(solid)
            rims.append(rim)
    return join(parts), join(rims)


def _sides(rectangle_m: Float64[np.ndarray, "4"]) -> Iterator[Wall]:
    """The four sides of x0, y0, x1, y1, as walls that face inwards."""
    x0, y0, x1, y1 = (float(value) for value in rectangle_m)
    yield Wall(x0, y0, x0, y1)
    yield Wall(x0, y1, x1, y1)
    yield Wall(x1, y1, x1, y0)
    yield Wall(x1, y0, x0, y0)


def _cuts(inner: tuple[float, float], outer: tuple[float, float]) -> Float64[np.ndarray, "cuts"]:
    """Shares of ``outer`` to cut at: fine over ``inner``, coarse beyond it."""
    fine = np.linspace(inner[0], inner[1], max(2, int((inner[1] - inner[0]) / 0.7) + 1))
    low = np.linspace(outer[0], inner[0], 6)[:-1]
    high = np.linspace(inner[1], outer[1], 6)[1:]
    return (np.concatenate([low, fine, high]) - outer[0]) / (outer[1] - outer[0])


def _shares(
    bounds_m: Float64[np.ndarray, "4"], outer_m: Float64[np.ndarray, "4"], axis: int
) -> Float64[np.ndarray, "cuts"]:
    inner = (float(bounds_m[axis]) - 1.0, float(bounds_m[axis + 2]) + 1.0)
    return _cuts(inner, (float(outer_m[axis]), float(outer_m[axis + 2])))


def _floor(
    bounds_m: Float64[np.ndarray, "4"],
    hall_m: Float64[np.ndarray, "4"],
    light: Light,
    bank: TextureBank,
    rng: np.random.Generator,
) -> Mesh:
    outer = hall_m + (np.array([-1.0, -1.0, 1.0, 1.0]) * (_SKY_M if light.kind.outdoors else 0.0))
    x0, y0, x1, y1 = (float(value) for value in outer)
    texture = bank.add(_outdoor_floor(rng) if light.kind.outdoors else _indoor_floor(rng))
    mesh = panel(
        vector(x0, y0, 0.0),
        vector(x1 - x0, 0.0, 0.0),
        vector(0.0, y1 - y0, 0.0),
        _shares(bounds_m, outer, 0),
        _shares(bounds_m, outer, 1),
        ((x1 - x0) / _TILE_M, (y1 - y0) / _TILE_M),
        texture,
        ONE_SIDED,
    )
    return mesh.lit(light.at(mesh.points_m, mesh.normals))


def _indoor_floor(rng: np.random.Generator) -> paint.Picture:
    hue, grey = rng.uniform(15, 45), rng.uniform(0.0, 0.2)
    kind = rng.integers(6)
    if kind == 0:
        return paint.carpet(rng, paint.color_hsv(rng.uniform(0, 360), rng.uniform(0.05, 0.4), rng.uniform(0.3, 0.6)))
    if kind == 1:
        count = int(rng.choice([2, 4]))
        return paint.tiles(rng, paint.color_hsv(hue, grey, rng.uniform(0.5, 0.8)), count, count)
    if kind == 2:
        wood = paint.color_hsv(rng.uniform(16, 36), rng.uniform(0.3, 0.6), rng.uniform(0.4, 0.75))
        return paint.planks(rng, wood, rows=int(rng.choice([8, 16])))
    if kind == 3:
        return paint.concrete(rng, paint.color_hsv(hue, grey / 2, rng.uniform(0.4, 0.7)))
    if kind == 4:
        return paint.terrazzo(rng, paint.color_hsv(hue, grey, rng.uniform(0.5, 0.8)))
    return paint.plaster(rng, paint.color_hsv(rng.uniform(0, 360), rng.uniform(0.05, 0.35), rng.uniform(0.35, 0.7)))


def _outdoor_floor(rng: np.random.Generator) -> paint.Picture:
    kind = rng.integers(3)
    if kind == 0:
        return paint.carpet(rng, paint.color_hsv(rng.uniform(70, 100), rng.uniform(0.4, 0.6), rng.uniform(0.3, 0.45)))
    grey = paint.color_hsv(rng.uniform(20, 50), rng.uniform(0, 0.12), rng.uniform(0.4, 0.62))
    return paint.concrete(rng, grey) if kind == 1 else paint.tiles(rng, grey, 4, 4, running=True)


def _ceiling(
    bounds_m: Float64[np.ndarray, "4"],
    hall_m: Float64[np.ndarray, "4"],
    height_m: float,
    light: Light,
    bank: TextureBank,
    rng: np.random.Generator,
) -> list[Mesh]:
    white = paint.color_hsv(rng.uniform(0, 360), 0.03, rng.uniform(0.82, 0.95))
    picture = paint.ceiling_grid(rng, white) if rng.random() < 0.6 else paint.plaster(rng, white)
    x0, y0, x1, y1 = (float(value) for value in hall_m)
    ceiling = panel(
        vector(x0, y0, height_m),
        vector(0.0, y1 - y0, 0.0),
        vector(x1 - x0, 0.0, 0.0),
        _shares(bounds_m, hall_m, 1),
        _shares(bounds_m, hall_m, 0),
        ((y1 - y0) / 1.25, (x1 - x0) / 1.25),
        bank.add(picture),
        ONE_SIDED,
    )
    # A ceiling is lit from below, by what the floor throws back.
    bounced = light.at(ceiling.points_m * (1, 1, 0), -ceiling.normals)
    parts = [ceiling.lit(0.35 + 0.55 * bounced)]
    glow = bank.add_color(np.full(3, 255.0))
    frame = bank.add_color(white * 0.7)
    long, wide = ((1.2, 0.25) if rng.random() < 0.5 else (0.6, 0.6))[:: 1 if rng.random() < 0.5 else -1]
    for x, y, z in light.lamps_m:
        for rim, lift, texture, brightness in ((0.05, 0.0, frame, 0.8), (0.0, 0.01, glow, 2.6)):
            lamp = panel(
                vector(x - wide / 2.0 - rim, y - long / 2.0 - rim, z - lift),
                vector(0.0, long + 2.0 * rim, 0.0),
                vector(wide + 2.0 * rim, 0.0, 0.0),
                np.array([0.0, 1.0]),
                np.array([0.0, 1.0]),
                (1.0, 1.0),
                texture,
                ONE_SIDED | DECAL,
            )
            parts.append(lamp.lit(np.full(4, brightness)))
    return parts


def _slab(roof: Roof, light: Light, bank: TextureBank, rng: np.random.Generator) -> Mesh:
    """The concrete under a roof, thin enough that what is darkened of the floor is darkened of it too."""
    x0, y0, x1, y1 = roof.rectangle_m
    cells = np.linspace(0.0, 1.0, 13)
    slab = panel(
        vector(x0, y0, 0.001),
        vector(x1 - x0, 0.0, 0.0),
        vector(0.0, y1 - y0, 0.0),
        cells,
        cells,
        ((x1 - x0) / _TILE_M, (y1 - y0) / _TILE_M),
        bank.add(paint.concrete(rng, paint.color_hsv(rng.uniform(0, 360), 0.04, rng.uniform(0.35, 0.65)))),
        ONE_SIDED,
    )
    return slab.lit(light.at(slab.points_m, slab.normals))


def _underside(roof: Roof, height_m: float, light: Light, bank: TextureBank, rng: np.random.Generator) -> Mesh:
    """What is seen of a roof from below."""
    x0, y0, x1, y1 = roof.rectangle_m
    grey = paint.color_hsv(rng.uniform(0, 360), 0.04, rng.uniform(0.4, 0.8))
    whole = np.linspace(0.0, 1.0, 9)
    ceiling = panel(
        vector(x0, y0, height_m),
        vector(0.0, y1 - y0, 0.0),
        vector(x1 - x0, 0.0, 0.0),
        whole,
        whole,
        ((y1 - y0) / _TILE_M, (x1 - x0) / _TILE_M),
        bank.add(paint.concrete(rng, grey)),
    )
    return ceiling.lit(0.8 * light.at(ceiling.points_m * (1, 1, 0), -ceiling.normals))


def _sky(bounds_m: Float64[np.ndarray, "4"], bank: TextureBank) -> Mesh:
    share = np.linspace(0, 1, paint.SIDE)[:, None, None] ** 2.5
    zenith, horizon = np.array([225.0, 160.0, 100.0]), np.array([245.0, 232.0, 215.0])
    picture = np.broadcast_to(zenith + (horizon - zenith) * share, (paint.SIDE, paint.SIDE, 3))
    texture = bank.add(np.ascontiguousarray(picture.astype(np.uint8)))
    around = bounds_m + np.array([-_SKY_M, -_SKY_M, _SKY_M, _SKY_M])
    whole = np.array([0.0, 1.0])
    sides = [
        panel(
            vector(side.x0_m, side.y0_m, -1.0),
            vector(side.x1_m - side.x0_m, side.y1_m - side.y0_m, 0.0),
            vector(0.0, 0.0, 4.0 * _SKY_M),
            whole,
            whole,
            (1.0, 0.98),
            texture,
            uv_origin=(0.0, 0.01),
        )
        for side in _sides(around)
    ]
    sky = join(sides)
    return sky.lit(np.full(len(sky.points_m), 1.2))
