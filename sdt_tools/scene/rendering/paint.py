"""Painters of surfaces: pictures that tile, drawn from a seed. Colours are blue, green, red, 0 to 255."""

from typing import Final

import cv2
import numpy as np
from jaxtyping import Float, Float32, Float64, UInt8

SIDE: Final = 256
"""Texels a side of a painted surface."""

Picture = UInt8[np.ndarray, "side side 3"]
Color = Float64[np.ndarray, "3"]


def color_hsv(hue_deg: float, saturation: float, value: float) -> Color:
    """A colour by hue (degrees), saturation and value (0 to 1)."""
    pixel = np.array([[[hue_deg % 360.0, saturation, value]]], np.float32)
    color: Color = cv2.cvtColor(pixel, cv2.COLOR_HSV2BGR)[0, 0].astype(np.float64) * 255.0
    return color


def noise(rng: np.random.Generator, cells: tuple[int, int], side: int = SIDE) -> Float32[np.ndarray, "side side"]:
    """Smooth noise of about ±1 that tiles, with ``cells`` (rows, columns) bumps across and three finer octaves."""
    total = np.zeros((side, side), np.float32)
    for octave in range(4):
        rows, columns = (min(count * 3**octave, side) for count in cells)
        bumps = rng.standard_normal((rows, columns), dtype=np.float32)
        wrapped = np.pad(bumps, 2, mode="wrap")
        # Sampled so that the pattern's period is exactly the picture's side.
        x = (np.arange(side, dtype=np.float32) + 0.5) * (columns / side) + 1.5
        y = (np.arange(side, dtype=np.float32) + 0.5) * (rows / side) + 1.5
        grid_x, grid_y = np.meshgrid(x, y)
        total += 0.5**octave * cv2.remap(wrapped, grid_x, grid_y, cv2.INTER_LINEAR)
    return total


def finish(canvas: Float[np.ndarray, "side side 3"]) -> Picture:
    """A canvas as 8-bit colours."""
    picture: Picture = np.clip(np.rint(canvas), 0, 255).astype(np.uint8)
    return picture


def sheet(color: Color, side: int = SIDE) -> Float32[np.ndarray, "side side 3"]:
    """A canvas of one colour."""
    canvas = np.empty((side, side, 3), np.float32)
    canvas[:] = color
    return canvas


def plaster(rng: np.random.Generator, color: Color) -> Picture:
    """Painted plaster: nearly even, with faint clouds and grain."""
    canvas = sheet(color) * (1 + 0.02 * noise(rng, (3, 3)) + 0.02 * noise(rng, (60, 60)))[..., None]
    return finish(canvas)


def concrete(rng: np.random.Generator, color: Color) -> Picture:
    """Concrete: clouds, grain, a few pores."""
    canvas = sheet(color) * (1 + 0.07 * noise(rng, (4, 4)) + 0.05 * noise(rng, (50, 50)))[..., None]
    for x, y in rng.integers(0, SIDE, (30, 2)):
        cv2.circle(canvas, (int(x), int(y)), int(rng.integers(1, 3)), (color * 0.6).tolist(), -1, cv2.LINE_AA)
    return finish(canvas)


def carpet(rng: np.random.Generator, color: Color) -> Picture:
    """Short carpet: strong grain, faint wear."""
    grain = rng.standard_normal((SIDE, SIDE), dtype=np.float32)
    return finish(sheet(color) * (1 + 0.10 * grain + 0.04 * noise(rng, (5, 5)))[..., None])


def terrazzo(rng: np.random.Generator, color: Color) -> Picture:
    """Terrazzo or speckled lino: chips of other shades."""
    canvas = sheet(color)
    for x, y in rng.integers(0, SIDE, (700, 2)):
        shade = color * rng.uniform(0.6, 1.3)
        axes = (int(rng.integers(1, 5)), int(rng.integers(1, 4)))
        cv2.ellipse(canvas, (int(x), int(y)), axes, rng.uniform(0, 180), 0, 360, shade.tolist(), -1, cv2.LINE_AA)
    return finish(canvas * (1 + 0.02 * noise(rng, (4, 4)))[..., None])


def tiles(rng: np.random.Generator, color: Color, rows: int = 4, columns: int = 4, running: bool = False) -> Picture:
    """Tiles, bricks or blocks with joints; ``running`` shifts every other row by half a tile."""
    joint = color * (0.62 if rng.random() < 0.6 else 1.25)
    canvas = sheet(joint)
    high, wide = SIDE // rows, SIDE // columns
    gap = max(1, min(high, wide) // 24)
    shades = 1 + 0.07 * rng.standard_normal((rows, columns))
    for row in range(rows):
        for column in range(-1, columns):
            x, y = column * wide + (wide // 2 if running and row % 2 else 0), row * high
            # The tile that leaves the picture on the right is the one that enters on the left.
            shade = (color * shades[row, column]).tolist()
            cv2.rectangle(canvas, (x + gap, y + gap), (x + wide - gap - 1, y + high - gap - 1), shade, -1)
    return finish(canvas * (1 + 0.03 * noise(rng, (6, 6)) + 0.03 * noise(rng, (60, 60)))[..., None])


def planks(rng: np.random.Generator, color: Color, rows: int = 8) -> Picture:
    """Boards along the picture's x axis, with grain, and joints at chance places."""
    high = SIDE // rows
    grain = noise(rng, (60, 2))
    canvas = sheet(color)
    for row in range(rows):
        band = slice(row * high, (row + 1) * high)
        canvas[band] *= 1 + 0.12 * rng.standard_normal()
        canvas[band] *= (1 + 0.09 * np.roll(grain, int(rng.integers(SIDE)), axis=1)[band])[..., None]
        canvas[row * high] *= 0.55
        canvas[band, int(rng.integers(SIDE))] *= 0.6
    return finish(canvas)


def fabric(rng: np.random.Generator, color: Color, folds: float = 0.08) -> Picture:
    """Cloth: a fine weave, and folds that run down it (the picture's y axis)."""
    weave = rng.standard_normal((SIDE, SIDE), dtype=np.float32)
    streaks = noise(rng, (2, 7)) + 0.7 * noise(rng, (5, 5))
    return finish(sheet(color) * (1 + 0.035 * weave + folds * streaks)[..., None])


def ceiling_grid(rng: np.random.Generator, color: Color) -> Picture:
    """Four mineral-fibre panels in their rails."""
    canvas = sheet(color) * (1 + 0.03 * noise(rng, (70, 70)))[..., None]
    half = SIDE // 2
    for line in (0, half):
        canvas[line : line + 3] = color * 0.82
        canvas[:, line : line + 3] = color * 0.82
    return finish(canvas)
