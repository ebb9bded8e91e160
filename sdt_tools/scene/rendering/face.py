"""A face, painted: complexion, eyes, mouth, beard, glasses, a surgical mask, and the roots of the hair.

Painted to be wrapped around the head: crown above, chin below, the nose in the middle, the back of the head at the
sides. Places are given in shares of the head: x in half widths to the right of the nose as seen from the front, y from
the chin (0) to the crown (1).
"""

from typing import Final

import cv2
import numpy as np
from jaxtyping import Float32

from sdt_tools.scene.rendering.paint import Color, Picture, finish, noise, sheet
from sdt_tools.scene.rendering.person import Person

_SIDE: Final = 512
_HALF_WIDTH: Final = 0.3
"""Half the head's width in shares of the picture's: of what is wrapped around, the front takes more than a third."""
_WHITE: Final = np.array([222.0, 226.0, 228.0])
_IRIS: Final = np.array([45.0, 50.0, 62.0])
_DARK: Final = np.array([20.0, 20.0, 22.0])
_EYES: Final = (-0.31, 0.31)
_MASK: Final = (
    (-0.75, 0.36), (-0.3, 0.43), (0.0, 0.465), (0.3, 0.43), (0.75, 0.36),
    (0.66, 0.16), (0.35, 0.0), (-0.35, 0.0), (-0.66, 0.16),
)  # fmt: skip

Canvas = Float32[np.ndarray, "side side 3"]


def paint_face(person: Person, rng: np.random.Generator) -> Picture:
    """The face of ``person``."""
    canvas = _complexion(person, rng)
    if person.beard:
        canvas = _with_beard(canvas, person)
    skin = person.skin
    _blob(canvas, 0.0, 0.215, 0.20, 0.022, skin * (0.72, 0.62, 0.88))
    _stroke(canvas, (-0.2, 0.217), (0.2, 0.217), skin * 0.42, 2)
    for x in _EYES:
        _blob(canvas, x, 0.525, 0.145, 0.026, _WHITE)
        _blob(canvas, x, 0.525, 0.062, 0.026, _IRIS)
        _blob(canvas, x, 0.527, 0.03, 0.012, _DARK)
        cv2.ellipse(canvas, _place(x, 0.525), (23, 15), 0, 180, 360, (skin * 0.35).tolist(), 3, cv2.LINE_AA)
        brow = (person.hair_color * 0.7).tolist()
        cv2.ellipse(canvas, _place(x, 0.578), (29, 12), 0, 190, 350, brow, 6, cv2.LINE_AA)
    for x in (-0.07, 0.07):
        _blob(canvas, x, 0.322, 0.035, 0.009, skin * 0.45)
    if person.mask is not None:
        _put_on_mask(canvas, person.mask)
    if person.glasses:
        _put_on_glasses(canvas)
    if person.hair != "bald":
        _paint_roots(canvas, person.hair_color)
    return finish(canvas)


def _place(x: float, y: float) -> tuple[int, int]:
    return round(_SIDE / 2 + x * _SIDE * _HALF_WIDTH), round(_SIDE * (1 - y))


def _blob(canvas: Canvas, x: float, y: float, half_x: float, half_y: float, color: Color) -> None:
    axes = (max(1, round(half_x * _SIDE * _HALF_WIDTH)), max(1, round(half_y * _SIDE)))
    cv2.ellipse(canvas, _place(x, y), axes, 0, 0, 360, color.tolist(), -1, cv2.LINE_AA)


def _stroke(canvas: Canvas, start: tuple[float, float], end: tuple[float, float], color: Color, width: int) -> None:
    cv2.line(canvas, _place(*start), _place(*end), color.tolist(), width, cv2.LINE_AA)


def _complexion(person: Person, rng: np.random.Generator) -> Canvas:
    """Skin with hollows of the eyes, cheeks, and the shade under nose and lips."""
    skin = person.skin
    canvas: Canvas = sheet(skin, _SIDE) * (1 + 0.02 * noise(rng, (10, 10), _SIDE))[..., None]
    for x in _EYES:
        _blob(canvas, x, 0.52, 0.22, 0.0625, skin * 0.80)
        _blob(canvas, 1.5 * x, 0.36, 0.195, 0.07, skin * (0.90, 0.90, 1.04))
    _blob(canvas, 0.0, 0.315, 0.14, 0.023, skin * 0.78)
    _blob(canvas, 0.0, 0.13, 0.22, 0.016, skin * 0.84)
    return cv2.GaussianBlur(canvas, (0, 0), 8)


def _with_beard(canvas: Canvas, person: Person) -> Canvas:
    bearded = canvas.copy()
    _blob(bearded, 0.0, 0.14, 0.66, 0.2, person.hair_color)
    bearded = cv2.GaussianBlur(bearded, (0, 0), 5)
    _blob(bearded, 0.0, 0.31, 0.34, 0.05, person.skin)
    _blob(bearded, 0.0, 0.275, 0.26, 0.02, person.hair_color)
    return bearded


def _put_on_mask(canvas: Canvas, color: Color) -> None:
    """A surgical mask from the nose to the chin, its pleats, and its loops to the ears."""
    corners = np.array([_place(x, y) for x, y in _MASK], np.int32).reshape(-1, 1, 2)
    cv2.fillPoly(canvas, [corners], color.tolist(), cv2.LINE_AA)
    for y in (0.14, 0.21, 0.28):
        _stroke(canvas, (-0.6, y), (0.6, y), color * 0.82, 2)
    for side in (-1.0, 1.0):
        _stroke(canvas, (side * 0.72, 0.35), (side, 0.46), color, 3)
        _stroke(canvas, (side * 0.66, 0.17), (side, 0.40), color, 3)


def _put_on_glasses(canvas: Canvas) -> None:
    for x in _EYES:
        cv2.ellipse(canvas, _place(x, 0.52), (34, 30), 0, 0, 360, _DARK.tolist(), 4, cv2.LINE_AA)
    _stroke(canvas, (-0.1, 0.535), (0.1, 0.535), _DARK, 4)
    for side in (-1.0, 1.0):
        _stroke(canvas, (side * 0.53, 0.54), (side * 0.95, 0.55), _DARK, 4)


def _paint_roots(canvas: Canvas, color: Color) -> None:
    """Hair on the skull itself, so that no skin shows where the hair's own surface ends."""
    canvas[: int(_SIDE * 0.12)] = color
    for column in range(_SIDE):
        turn = abs(column - _SIDE / 2) / (_SIDE / 2)
        if turn > 0.5:
            canvas[: int(_SIDE * (0.25 + 0.9 * (turn - 0.5))), column] = color
