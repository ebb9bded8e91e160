"""Pictures out of characters: dots in braille cells (2 × 4 a cell), pixels in half blocks (1 × 2 a cell).

A terminal's cell is about twice as high as wide, so that dots and pixels are square.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from typing import Final

import numpy as np
from jaxtyping import Float, Int64, UInt8
from rich.color import Color
from rich.color_triplet import ColorTriplet
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from sdt_tools.class_colors import Rgb

BLANK: Final[Rgb] = (16, 18, 24)
_BRAILLE: Final = 0x2800
_DOTS: Final = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""The bit of each dot of a braille character (Unicode 15, block Braille Patterns)."""
_LEVELS: Final = 0xF8
"""Pixels keep five bits a channel: so few styles are needed that they are made once."""


@dataclass(frozen=True, eq=False)
class Dots:
    """Dots of one colour at ``points``: x to the right and y down, in cells."""

    points: Float[np.ndarray, "dots 2"]
    color: Rgb


@dataclass(frozen=True)
class Words:
    """Text that begins in a cell."""

    column: int
    line: int
    text: str
    color: Rgb


@lru_cache(maxsize=1 << 16)
def style(color: Rgb, background: Rgb = BLANK, *, bold: bool = False) -> Style:
    """A style of true colours."""
    return Style(
        color=Color.from_triplet(ColorTriplet(*color)),
        bgcolor=Color.from_triplet(ColorTriplet(*background)),
        bold=bold,
    )


def draw_dots(layers: Sequence[Dots], words: Sequence[Words], width: int, height: int) -> list[Strip]:
    """``height`` lines of ``width`` cells. A cell shows the dots of all layers in the colour of the last of them."""
    bits = np.zeros((height * 4, width * 2), np.int64)
    colors = np.full((height, width), -1)
    for number, layer in enumerate(layers):
        dots = np.floor(layer.points * (2, 4)).astype(np.int64)
        inside = ((dots >= 0) & (dots < (width * 2, height * 4))).all(axis=1)
        x, y = dots[inside].T
        bits[y, x] = 1
        colors[y // 4, x // 2] = number
    cells = _BRAILLE + np.einsum("aibj,ij->ab", bits.reshape(height, 4, width, 2), _DOTS)
    rows = [[chr(cell) if cell != _BRAILLE else " " for cell in line] for line in cells.tolist()]
    palette = {number: layer.color for number, layer in enumerate(layers)}
    inks = [[palette.get(number, BLANK) for number in line] for line in colors.tolist()]
    for text in words:
        for place, character in enumerate(text.text, text.column):
            if 0 <= text.line < height and 0 <= place < width:
                rows[text.line][place], inks[text.line][place] = character, text.color
    return [_strip(row, ink) for row, ink in zip(rows, inks, strict=True)]


def draw_pixels(rgb: UInt8[np.ndarray, "rows columns 3"]) -> list[Strip]:
    """One line for two rows of pixels (an even number)."""
    packed: Int64[np.ndarray, "rows columns"] = (rgb & _LEVELS).astype(np.int64) @ np.array([1 << 16, 1 << 8, 1])
    lines = []
    for top, bottom in zip(packed[0::2].tolist(), packed[1::2].tolist(), strict=True):
        pairs = groupby(zip(top, bottom, strict=True))
        segments = [Segment("▀" * len(list(run)), _pixel_style(*pair)) for pair, run in pairs]
        lines.append(Strip(segments, len(top)))
    return lines


def line(width: int, height: int, points: Float[np.ndarray, "corners 2"]) -> Float[np.ndarray, "dots 2"]:
    """Dots along a polyline given in cells, those within ``width`` by ``height``."""
    starts, ends = points[:-1], points[1:]
    steps = 1 + np.ceil(2 * np.abs((ends - starts) * (2, 4)).max(axis=1)).astype(np.int64)  # two a dot: no gaps
    steps = np.minimum(steps, 8 * (width + height))
    parts = [
        start + (end - start) * np.linspace(0.0, 1.0, count + 1)[:, None]
        for start, end, count in zip(starts, ends, steps.tolist(), strict=True)
    ]
    return np.concatenate(parts)


@lru_cache(maxsize=1 << 16)
def _pixel_style(top: int, bottom: int) -> Style:
    return style(_unpacked(top), _unpacked(bottom))


def _unpacked(color: int) -> Rgb:
    return color >> 16, color >> 8 & 0xFF, color & 0xFF


def _strip(characters: Sequence[str], colors: Sequence[Rgb]) -> Strip:
    segments = []
    for color, run in groupby(zip(characters, colors, strict=True), key=lambda cell: cell[1]):
        segments.append(Segment("".join(character for character, _ in run), style(color)))
    return Strip(segments, len(characters))
