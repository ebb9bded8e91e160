"""A scan from above in a terminal: ahead is up, left is left, a metre is as long in every direction."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from jaxtyping import Float64
from textual.strip import Strip
from textual.widget import Widget

from sdt_tools.class_colors import Rgb
from sdt_tools.frames import LidarScan, Twist
from sdt_tools.terminal.raster import BLANK, Dots, Words, draw_dots, line, style
from sdt_tools.top_view import (
    Mount,
    arc,
    base_to_lidar,
    distances,
    footprint_base,
    hits_lidar,
    motion_base,
    safety_zone_lidar,
    to_screen,
)

REACHES_M: Final = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0, 20.0)
"""How far ahead one can look, from close to far."""
USUAL_REACH_M: Final = 3.0
AHEAD_SHARE: Final = 0.72
"""The LiDAR stands at this share of the height."""

HIT: Final[Rgb] = (150, 206, 255)
NEAR: Final[Rgb] = (255, 208, 92)
ZONE: Final[Rgb] = (255, 82, 82)
ROBOT: Final[Rgb] = (225, 230, 238)
RING: Final[Rgb] = (62, 68, 80)
QUIET: Final[Rgb] = (120, 128, 142)
NEAR_M: Final = 0.5
_MOUNT: Final = Mount()


def draw_scan(
    scan: LidarScan, width: int, height: int, reach_m: float = USUAL_REACH_M, motion: tuple[Twist, Rgb] | None = None
) -> list[Strip]:
    """``height`` lines of ``width`` cells that show ``reach_m`` ahead of the LiDAR; ``motion`` is drawn as an arrow.

    Rings stand at whole metres, or at more where there would be many. Hits nearer than half a metre are yellow, the
    safety zone is red.
    """
    place = _Place(width, height, reach_m)
    furniture, words = _furniture(place)
    layers = list(furniture)
    if motion is not None:
        twist, color = motion
        layers += [Dots(place.drawn(base_to_lidar(shape, _MOUNT)), color) for shape in motion_base(twist)]
    ranges_m = scan.ranges_m[None]
    hit = distances(ranges_m)[0]
    near = hit & (scan.ranges_m < NEAR_M)
    points_lidar = hits_lidar(np.where(hit, scan.ranges_m, 0.0)[None])[0]
    layers += [Dots(place.cells(points_lidar[hit & ~near]), HIT), Dots(place.cells(points_lidar[near]), NEAR)]
    return draw_dots(layers, words, width, height)


@dataclass(frozen=True)
class _Place:
    """From the LiDAR's frame to cells."""

    width: int
    height: int
    reach_m: float

    def cells(self, points_lidar: Float64[np.ndarray, "points 2"]) -> Float64[np.ndarray, "points 2"]:
        """Where points are drawn."""
        rows_a_metre = AHEAD_SHARE * self.height / self.reach_m
        seen = to_screen(points_lidar).astype(np.float64) * (2.0 * rows_a_metre, rows_a_metre)
        at: Float64[np.ndarray, "points 2"] = seen + np.array([self.width / 2, AHEAD_SHARE * self.height])
        return at

    def drawn(self, points_lidar: Float64[np.ndarray, "points 2"]) -> Float64[np.ndarray, "dots 2"]:
        """The dots of a polyline."""
        return line(self.width, self.height, self.cells(points_lidar))


@lru_cache(maxsize=8)
def _furniture(place: _Place) -> tuple[tuple[Dots, ...], tuple[Words, ...]]:
    """What is the same in every scan: rings, robot, safety zone."""
    apart_m = next(step for step in (0.5, 1.0, 2.0, 5.0) if place.reach_m / step <= 4.0)
    radii_m = [apart_m * number for number in range(1, int(place.reach_m / apart_m) + 1)]
    rings = [Dots(place.drawn(arc(radius_m, -2.36, 2.36))[::4], RING) for radius_m in radii_m]
    words = [_ring_words(radius_m, place.cells(np.array([[0.0, -radius_m]]))[0]) for radius_m in radii_m]
    robot = [Dots(place.drawn(base_to_lidar(shape, _MOUNT)), ROBOT) for shape in footprint_base()]
    return (*rings, *robot, Dots(place.drawn(safety_zone_lidar()), ZONE)), tuple(words)


def _ring_words(radius_m: float, beside: Float64[np.ndarray, "2"]) -> Words:
    """Its radius, inside the ring, to the right of the robot: the way ahead stays free."""
    text = f"{radius_m:g} m"
    return Words(int(beside[0]) - len(text), int(beside[1]), text, QUIET)


class ScanView(Widget):
    """Shows one scan; ``reach_m`` ahead of the LiDAR."""

    DEFAULT_CSS = "ScanView { width: 1fr; height: 1fr; }"

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.reach_m = USUAL_REACH_M
        self._scan: LidarScan | None = None
        self._words = "no scan"
        self._motion: tuple[Twist, Rgb] | None = None
        self._strips: list[Strip] = []

    def show(self, scan: LidarScan | None, motion: tuple[Twist, Rgb] | None = None, words: str = "no scan") -> None:
        """Show ``scan``; without one say ``words``."""
        self._scan, self._motion, self._words = scan, motion, words
        self._draw()

    def zoom(self, by: int) -> None:
        """Look ``by`` steps further, or nearer."""
        place = REACHES_M.index(self.reach_m) + by
        self.reach_m = REACHES_M[min(max(place, 0), len(REACHES_M) - 1)]
        self._draw()

    def on_resize(self) -> None:
        """Draw anew."""
        self._draw()

    def render_line(self, y: int) -> Strip:
        """One line of the drawing."""
        return self._strips[y] if y < len(self._strips) else Strip.blank(self.size.width, style(BLANK))

    def _draw(self) -> None:
        width, height = self.size
        if width and height:
            self._strips = (
                said_in_the_middle(self._words, width, height)
                if self._scan is None
                else draw_scan(self._scan, width, height, self.reach_m, self._motion)
            )
        self.refresh()


def said_in_the_middle(text: str, width: int, height: int) -> list[Strip]:
    """Lines of nothing, but for a text in the middle."""
    return draw_dots([], [Words((width - len(text)) // 2, height // 2, text, QUIET)], width, height)
