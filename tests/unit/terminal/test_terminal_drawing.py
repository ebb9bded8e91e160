"""Drawings in characters, taken apart again dot by dot."""

import io
import unicodedata

import numpy as np
import pytest
from PIL import Image

from sdt_tools.class_colors import Rgb
from sdt_tools.frames import RAYS, CameraImage, LidarScan, Twist, ray_angles_rad
from sdt_tools.terminal.picture_view import thumbnail
from sdt_tools.terminal.raster import Dots, Words, draw_dots, draw_pixels, line
from sdt_tools.terminal.scan_view import AHEAD_SHARE, HIT, NEAR, draw_scan

RED: Rgb = (255, 0, 0)
BLUE: Rgb = (0, 0, 255)


def dots_of(strips: list) -> set[tuple[int, int]]:
    """The dots in braille characters, by the names that Unicode gives to them: x to the right, y down."""
    places = {1: (0, 0), 2: (0, 1), 3: (0, 2), 4: (1, 0), 5: (1, 1), 6: (1, 2), 7: (0, 3), 8: (1, 3)}
    found = set()
    for row, strip in enumerate(strips):
        for column, character in enumerate(strip.text):
            name = unicodedata.name(character, "")
            if name.startswith("BRAILLE PATTERN DOTS-"):
                for digit in name.removeprefix("BRAILLE PATTERN DOTS-"):
                    x, y = places[int(digit)]
                    found.add((2 * column + x, 4 * row + y))
    return found


def color_at(strips: list, column: int, row: int) -> Rgb:
    (segment,) = strips[row].crop(column, column + 1)
    assert segment.style is not None
    return tuple(segment.style.color.triplet)


def test_each_dot_is_where_it_was_put() -> None:
    rng = np.random.default_rng(0)
    asked = {(int(x), int(y)) for x, y in rng.integers((0, 0), (20, 24), (60, 2))}
    points = np.array([((x + 0.5) / 2, (y + 0.5) / 4) for x, y in asked])
    strips = draw_dots([Dots(points, RED)], [], 10, 6)
    assert dots_of(strips) == asked
    assert [strip.cell_length for strip in strips] == [10] * 6


def test_what_lies_outside_is_left_out_and_the_last_layer_gives_the_colour() -> None:
    points = np.array([[0.1, 0.1], [-0.1, 0.1], [3.0, 0.5], [0.5, 2.0]])
    strips = draw_dots([Dots(points, RED), Dots(np.array([[0.6, 0.9]]), BLUE)], [], 3, 2)
    assert dots_of(strips) == {(0, 0), (1, 3)}
    assert color_at(strips, 0, 0) == BLUE


def test_words_stand_over_dots_and_are_cut_at_the_edge() -> None:
    strips = draw_dots([], [Words(1, 0, "2 m", RED), Words(0, 5, "far", RED)], 3, 1)
    assert strips[0].text == " 2 "


def test_a_line_has_no_gaps() -> None:
    dots = np.floor(line(10, 10, np.array([[0.0, 0.0], [9.0, 3.0], [9.0, 9.0]])) * (2, 4))
    assert np.abs(np.diff(dots, axis=0)).max() <= 1
    assert (dots[0].tolist(), dots[-1].tolist()) == ([0.0, 0.0], [18.0, 36.0])


def scan(ranges_m: np.ndarray) -> LidarScan:
    return LidarScan(0, ranges_m)


def hits_of(ranges_m: np.ndarray, width: int, height: int) -> set[tuple[int, int]]:
    """What a scan adds to the drawing of an empty one."""
    return dots_of(draw_scan(scan(ranges_m), width, height)) - dots_of(draw_scan(scan(np.zeros(RAYS)), width, height))


@pytest.mark.parametrize(("width", "height"), [(40, 20), (70, 20), (45, 33)])
def test_ahead_is_up_left_is_left_and_a_metre_is_as_long_in_every_direction(width: int, height: int) -> None:
    metre_dots = AHEAD_SHARE * height / 3.0 * 4
    middle = np.array([width / 2 * 2, AHEAD_SHARE * height * 4])
    for ray, way in ((270, (0, -1)), (270 + 180, (-1, 0)), (270 - 180, (1, 0))):
        ranges_m = np.zeros(RAYS)
        ranges_m[ray] = 1.2
        (dot,) = hits_of(ranges_m, width, height)
        expected = middle + np.array(way) * 1.2 * metre_dots
        assert np.abs(np.array(dot) + 0.5 - expected).max() <= 1.0


def test_codes_and_the_full_range_are_not_drawn() -> None:
    ranges_m = np.zeros(RAYS)
    ranges_m[:100], ranges_m[100:200], ranges_m[200:300] = 0.003, 20.0, np.nan
    assert hits_of(ranges_m, 40, 20) == set()


def test_what_is_near_is_seen() -> None:
    angles = ray_angles_rad()
    strips = draw_scan(scan(np.where(np.abs(angles) < 0.2, 0.4, 2.0)), 60, 30)
    colors = {tuple(segment.style.color.triplet) for strip in strips for segment in strip if segment.style}
    assert {HIT, NEAR} <= colors


def test_a_motion_is_an_arrow_in_its_colour() -> None:
    strips = draw_scan(scan(np.zeros(RAYS)), 60, 30, motion=(Twist(0.4, 0.6), BLUE))
    blue = [
        column
        for strip in strips
        for column, cell in enumerate(strip.divide(range(1, 61)))
        if cell.text.strip() and color_at([cell], 0, 0) == BLUE
    ]
    assert blue
    assert min(blue) < 28  # a left turn leads to the left


def jpeg(width: int, height: int) -> CameraImage:
    pixels = np.zeros((height, width, 3), np.uint8)
    pixels[:, : width // 2], pixels[:, width // 2 :] = RED, BLUE
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=95)
    return CameraImage(0, stream.getvalue())


@pytest.mark.parametrize(("columns", "rows", "size"), [(24, 18, (18, 24)), (80, 30, (30, 40)), (10, 40, (8, 10))])
def test_a_picture_keeps_its_proportions(columns: int, rows: int, size: tuple[int, int]) -> None:
    small = thumbnail(jpeg(640, 480), columns, rows)
    assert small is not None
    assert small.shape[:2] == size


def test_pixels_are_half_blocks_of_their_colours() -> None:
    strips = draw_pixels(np.array([[RED, RED], [BLUE, RED]], np.uint8))
    (strip,) = strips
    assert strip.text == "▀▀"
    styles = [(segment.style.color.triplet[:], segment.style.bgcolor.triplet[:]) for segment in strip if segment.style]
    assert styles[0] == ((248, 0, 0), (0, 0, 248))
    assert styles[1] == ((248, 0, 0), (248, 0, 0))


def test_what_is_no_picture_is_none() -> None:
    assert thumbnail(CameraImage(0, b"noise"), 10, 10) is None
    cut = jpeg(64, 48)
    assert thumbnail(CameraImage(0, cut.data[:200]), 10, 10) is None
