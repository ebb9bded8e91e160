"""What hangs on walls: doors, windows, boards, posters; and the pictures that boxes are painted with."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from jaxtyping import Float32

from sdt_tools.scene.rendering.paint import SIDE, Color, Picture, color_hsv, finish, noise, planks, plaster, sheet

Canvas = Float32[np.ndarray, "side side 3"]


@dataclass(frozen=True, eq=False)
class Decor:
    """A picture on a wall: its size, how high its lower edge hangs, and its own light (0: it is lit by the room)."""

    picture: Picture
    width_m: float
    height_m: float
    bottom_m: float
    glow: float = 0.0


def _frame(canvas: Canvas, color: Color, thickness: int) -> None:
    cv2.rectangle(canvas, (0, 0), (SIDE - 1, SIDE - 1), color.tolist(), thickness)


def door(rng: np.random.Generator) -> Decor:
    """A door in its frame, with a handle, perhaps a pane of glass."""
    color = color_hsv(rng.uniform(10, 40), rng.uniform(0.1, 0.6), rng.uniform(0.35, 0.85))
    if rng.random() < 0.35:
        color = color_hsv(rng.uniform(0, 360), rng.uniform(0.2, 0.6), rng.uniform(0.4, 0.8))
    canvas = sheet(color)
    canvas *= (1 + 0.05 * noise(rng, (2, 30)))[..., None]
    kind = rng.integers(3)
    if kind == 0:
        for top, low in ((22, 112), (134, 236)):
            cv2.rectangle(canvas, (48, top), (208, low), (color * 0.72).tolist(), 3)
            cv2.rectangle(canvas, (53, top + 4), (203, low - 4), (color * 1.08).tolist(), 1)
    elif kind == 1:
        cv2.rectangle(canvas, (150, 30), (205, 110), (90.0, 84.0, 70.0), -1)
        cv2.rectangle(canvas, (150, 30), (205, 110), (color * 0.6).tolist(), 3)
    else:
        cv2.rectangle(canvas, (30, 206), (226, 244), (160.0, 160.0, 160.0), -1)
    side = 34 if rng.random() < 0.5 else 222
    cv2.rectangle(canvas, (side - 9, 122), (side + 9, 142), (175.0, 178.0, 180.0), -1)
    cv2.line(canvas, (side, 131), (side + (28 if side < 128 else -28), 131), (210.0, 214.0, 216.0), 4, cv2.LINE_AA)
    _frame(canvas, color * 0.55, 16)
    return Decor(finish(canvas), float(rng.uniform(0.85, 1.0)), 2.05, 0.0)


def window(rng: np.random.Generator) -> Decor:
    """A window with daylight in it."""
    top, low = np.array([250, 238, 225.0]), np.array([235, 240, 240.0])
    share = np.linspace(0, 1, SIDE, dtype=np.float32)[:, None, None]
    canvas = sheet(top)
    canvas[:] = top * (1 - share) + low * share
    skyline = (SIDE * (0.72 + 0.06 * noise(rng, (1, 4))[0])).astype(int)
    for x in range(SIDE):
        canvas[skyline[x] :, x] *= (0.62, 0.72, 0.66)
    for x in np.linspace(0, SIDE, int(rng.integers(2, 4)) + 1)[1:-1]:
        cv2.line(canvas, (int(x), 0), (int(x), SIDE), (205.0, 208.0, 210.0), 9)
    if rng.random() < 0.4:
        for y in range(0, int(rng.uniform(0.3, 0.9) * SIDE), 9):
            canvas[y : y + 4] *= 0.72
    _frame(canvas, np.array([212.0, 216.0, 220.0]), 18)
    return Decor(finish(canvas), float(rng.uniform(1.0, 1.8)), float(rng.uniform(1.0, 1.4)), 0.95, glow=1.15)


def poster(rng: np.random.Generator) -> Decor:
    """A poster: shapes and lines of text."""
    canvas = sheet(color_hsv(rng.uniform(0, 360), rng.uniform(0, 0.5), rng.uniform(0.6, 1)))
    for _ in range(int(rng.integers(2, 6))):
        color = color_hsv(rng.uniform(0, 360), rng.uniform(0.2, 0.9), rng.uniform(0.2, 0.95)).tolist()
        x, y, size = (int(value) for value in rng.integers(20, 200, 3))
        if rng.random() < 0.5:
            cv2.circle(canvas, (x, y), size // 3, color, -1, cv2.LINE_AA)
        else:
            cv2.rectangle(canvas, (x, y), (x + size, y + size // 2), color, -1)
    ink = (40.0, 40.0, 40.0)
    for line in range(int(rng.integers(2, 6))):
        y = 176 + 15 * line
        cv2.line(canvas, (24, y), (int(rng.integers(90, 230)), y), ink, 4, cv2.LINE_AA)
    _frame(canvas, np.array(ink) if rng.random() < 0.5 else np.full(3, 235.0), 6)
    width = float(rng.uniform(0.4, 0.8))
    return Decor(finish(canvas), width, width * 1.35, float(rng.uniform(1.05, 1.3)))


def whiteboard(rng: np.random.Generator) -> Decor:
    """A whiteboard with some writing on it."""
    canvas = np.full((SIDE, SIDE, 3), 238, np.float32)
    for line in range(int(rng.integers(3, 8))):
        color = [(150.0, 60.0, 40.0), (50.0, 50.0, 180.0), (50.0, 50.0, 50.0)][int(rng.integers(3))]
        x, y = int(rng.integers(20, 120)), 30 + 26 * line
        xs = np.arange(x, x + int(rng.integers(40, 120)), 3)
        curve = np.stack([xs, y + 5 * np.sin(xs * rng.uniform(0.3, 1.0)) + rng.normal(0, 2, len(xs))], axis=1)
        cv2.polylines(canvas, [curve.astype(np.int32).reshape(-1, 1, 2)], False, color, 2, cv2.LINE_AA)
    _frame(canvas, np.array([150.0, 150.0, 150.0]), 8)
    return Decor(finish(canvas), float(rng.uniform(1.2, 2.0)), 1.0, 0.9)


def fuse_box(rng: np.random.Generator) -> Decor:
    """A grey metal box with a warning sign."""
    canvas = sheet(color_hsv(210.0, 0.05, rng.uniform(0.5, 0.8)))
    cv2.rectangle(canvas, (20, 20), (236, 236), (110.0, 112.0, 112.0), 3)
    triangle = np.array([[128, 70], [84, 146], [172, 146]], np.int32).reshape(-1, 1, 2)
    cv2.fillConvexPoly(canvas, triangle, (30.0, 200.0, 240.0), cv2.LINE_AA)
    cv2.circle(canvas, (212, 128), 8, (60.0, 60.0, 60.0), -1, cv2.LINE_AA)
    return Decor(finish(canvas), 0.45, 0.6, 1.1)


WALL_DECOR: Final[tuple[Callable[[np.random.Generator], Decor], ...]] = (door, window, poster, whiteboard, fuse_box)
_DECOR_SHARES: Final = (0.3, 0.2, 0.28, 0.12, 0.1)


def wall_decor(rng: np.random.Generator) -> Decor:
    """Something that hangs on a wall."""
    return WALL_DECOR[int(rng.choice(len(WALL_DECOR), p=_DECOR_SHARES))](rng)


def box_pictures(rng: np.random.Generator) -> tuple[Picture, Picture]:
    """A box's sides and its lid: cardboard, a wooden crate, a steel cabinet or a plastic bin."""
    kind = rng.choice(4, p=(0.4, 0.2, 0.25, 0.15))
    if kind == 0:
        return _cardboard(rng)
    if kind == 1:
        wood = color_hsv(rng.uniform(25, 38), rng.uniform(0.35, 0.6), rng.uniform(0.5, 0.75))
        side = planks(rng, wood, rows=4).astype(np.float32)
        for corner in (0, SIDE - 34):
            side[:, corner : corner + 34] = planks(rng, wood * 0.92)[:, :34]
            side[:, corner] *= 0.5
        return finish(side), planks(rng, wood, rows=4)
    if kind == 2:
        return _cabinet(rng)
    color = color_hsv(rng.uniform(0, 360), rng.uniform(0.4, 0.85), rng.uniform(0.35, 0.8))
    canvas = plaster(rng, color).astype(np.float32)
    canvas[:26] *= 0.8
    for x in range(30, SIDE, 50):
        canvas[30:, x : x + 6] *= 0.85
    return finish(canvas), plaster(rng, color * 0.7)


def _cardboard(rng: np.random.Generator) -> tuple[Picture, Picture]:
    color = color_hsv(rng.uniform(26, 34), rng.uniform(0.35, 0.5), rng.uniform(0.55, 0.75))
    side = plaster(rng, color).astype(np.float32)
    side *= (1 + 0.02 * np.sin(np.arange(SIDE, dtype=np.float32) * 0.9))[None, :, None]
    tape = color_hsv(32.0, 0.25, 0.85)
    side[:70, 112:144] = 0.5 * side[:70, 112:144] + 0.5 * tape
    if rng.random() < 0.7:
        x, y = int(rng.integers(20, 140)), int(rng.integers(90, 170))
        cv2.rectangle(side, (x, y), (x + 72, y + 52), (232.0, 234.0, 236.0), -1)
        for line in range(4):
            cv2.line(side, (x + 6, y + 10 + 10 * line), (x + 60 - 7 * line, y + 10 + 10 * line), (70.0, 70.0, 70.0), 2)
    lid = plaster(rng, color * 1.05).astype(np.float32)
    lid[112:144] = 0.5 * lid[112:144] + 0.5 * tape
    lid[127:129] *= 0.6
    return finish(side), finish(lid)


def _cabinet(rng: np.random.Generator) -> tuple[Picture, Picture]:
    color = color_hsv(rng.uniform(180, 260), rng.uniform(0, 0.3), rng.uniform(0.35, 0.85))
    side = plaster(rng, color).astype(np.float32)
    drawers = int(rng.integers(2, 4))
    for drawer in range(drawers):
        top = 8 + drawer * (SIDE - 8) // drawers
        cv2.rectangle(side, (8, top), (SIDE - 9, top + (SIDE - 8) // drawers - 8), (color * 0.6).tolist(), 3)
        cv2.rectangle(side, (96, top + 18), (160, top + 28), (color * 0.4).tolist(), -1)
    return finish(side), plaster(rng, color)
