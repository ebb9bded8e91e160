"""The rasterizer against analysis: coverage, depth, texture coordinates in perspective, and what is far away."""

import math

import numpy as np
import pytest

from sdt_tools.frames import Pose2D
from sdt_tools.scene.rendering.mesh import DECAL, ONE_SIDED, SHADE, Mesh, join, panel, vector
from sdt_tools.scene.rendering.projection import CameraMount, Pinhole, View, view_from
from sdt_tools.scene.rendering.raster import draw
from sdt_tools.scene.rendering.texture import FULL, LANE_BITS, TextureBank, TexturePack

LENS = Pinhole(160, 120, 100.0, 100.0, 79.5, 59.5)
AHEAD = View(np.zeros(3), np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]))
"""At the origin, looking along x."""
WHOLE = np.array([0.0, 1.0])


def shoot(mesh: Mesh, textures: TexturePack, view: View = AHEAD) -> tuple[np.ndarray, np.ndarray]:
    radiance = np.zeros((LENS.height, LENS.width, 3), np.float32)
    inverse_depth = np.zeros((LENS.height, LENS.width), np.float32)
    draw(mesh, textures, view, LENS, radiance, inverse_depth)
    return radiance, inverse_depth


def plain(*colors: float) -> TexturePack:
    bank = TextureBank()
    for color in colors:
        bank.add_color(np.full(3, color))
    return bank.pack()


def board(x: float, texture: int = 0, flags: int = 0, half: float = 0.5) -> Mesh:
    """A square that faces the camera at distance ``x``."""
    return panel(
        vector(x, half, -half),
        vector(0.0, -2.0 * half, 0.0),
        vector(0.0, 0.0, 2.0 * half),
        WHOLE,
        WHOLE,
        (1.0, 1.0),
        texture,
        flags,
    )


def test_neighbouring_triangles_leave_no_gap_and_no_overlap() -> None:
    shares = np.linspace(0, 1, 8) ** 1.3
    mesh = panel(
        vector(2.0, 5.0, -5.0), vector(1.5, -10.0, 0.0), vector(0.0, 0.3, 10.0), shares, shares, (1.0, 1.0), 0, SHADE
    ).lit(np.full(64, 0.5))
    radiance = np.ones((LENS.height, LENS.width, 3), np.float32)

    draw(mesh, plain(255.0), AHEAD, LENS, radiance, np.zeros((LENS.height, LENS.width), np.float32))

    assert np.allclose(radiance, 0.5), "each pixel is shaded exactly once"


def test_texture_coordinates_are_in_perspective_on_a_slanted_floor() -> None:
    bank = TextureBank()
    ramp = np.repeat(np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 256, axis=0), 3, axis=2)
    bank.add(ramp)
    view = view_from(Pose2D(0.0, 0.0, 0.3), CameraMount(0.9, -0.4, 0.0))
    floor = panel(
        vector(-50.0, -50.0, 0.0), vector(100.0, 0.0, 0.0), vector(0.0, 100.0, 0.0), WHOLE, WHOLE, (25.0, 25.0), 0
    )

    radiance, _ = shoot(floor, bank.pack(), view)

    rows, columns = np.meshgrid(np.arange(70, 120), np.arange(160), indexing="ij")
    rays = (
        np.stack([(columns - LENS.cx) / LENS.fx, (rows - LENS.cy) / LENS.fy, np.ones(rows.shape)], axis=-1) @ view.axes
    )
    x = -0.9 / rays[..., 2] * rays[..., 0]
    code = ((x + 50) / 4 % 1.0) * 256 - 0.5
    linear = ((code / 255 + 0.055) / 1.055) ** 2.4
    middle = (code > 40) & (code < 215)
    assert np.abs(radiance[70:120, :, 0] - linear)[middle].max() < 0.02


def test_a_far_fine_pattern_turns_into_its_mean() -> None:
    bank = TextureBank()
    checks = (np.indices((256, 256)).sum(axis=0) % 2 * 255).astype(np.uint8)
    bank.add(np.repeat(checks[..., None], 3, axis=2))

    wall = panel(vector(4.0, 8.0, -8.0), vector(0.0, -16.0, 0.0), vector(0.0, 0.0, 16.0), WHOLE, WHOLE, (64.0, 64.0), 0)

    radiance, _ = shoot(wall, bank.pack())

    assert np.abs(radiance - 0.5).max() < 0.02


def test_the_nearer_surface_wins_in_any_order() -> None:
    textures = plain(255.0, 0.0)
    near_last, _ = shoot(join([board(3.0, 0, half=2.0), board(2.0, 1)]), textures)
    near_first, _ = shoot(join([board(2.0, 1), board(3.0, 0, half=2.0)]), textures)

    assert near_last[60, 80, 0] == 0.0
    assert near_last[60, 20, 0] == pytest.approx(1.0)
    assert np.array_equal(near_last, near_first)


def test_a_decal_wins_over_what_it_lies_on() -> None:
    radiance, _ = shoot(join([board(3.0, 0, DECAL), board(3.0, 1, half=1.0)]), plain(0.0, 255.0))

    assert radiance[60, 80, 0] == 0.0
    assert radiance[60, 60, 0] == pytest.approx(1.0)


def test_one_sided_surfaces_are_seen_from_their_front_only() -> None:
    front = panel(
        vector(2.0, -0.5, -0.5), vector(0.0, 1.0, 0.0), vector(0.0, 0.0, 1.0), WHOLE, WHOLE, (1.0, 1.0), 0, ONE_SIDED
    )
    back = panel(
        vector(2.0, 0.5, -0.5), vector(0.0, -1.0, 0.0), vector(0.0, 0.0, 1.0), WHOLE, WHOLE, (1.0, 1.0), 0, ONE_SIDED
    )

    seen = [bool(shoot(mesh, plain(255.0))[1].any()) for mesh in (front, back)]

    facing = [float(mesh.normals[0] @ (-1.0, 0.0, 0.0)) for mesh in (front, back)]
    assert seen == [value > 0 for value in facing]
    assert sorted(seen) == [False, True]


def test_shade_multiplies_only_what_lies_at_or_behind_it() -> None:
    ground = join([board(3.0, 0, half=2.0), board(2.0, 0, half=0.2)])
    shade = board(2.5, 0, SHADE).lit(np.full(4, 0.25))

    radiance, _ = shoot(join([ground, shade]), plain(255.0))

    assert radiance[60, 80, 0] == pytest.approx(1.0), "in front of the shade"
    assert radiance[60, 65, 0] == pytest.approx(0.25), "behind it"
    assert radiance[60, 20, 0] == pytest.approx(1.0), "beside it"


def test_a_surface_that_passes_under_the_camera_is_cut_cleanly() -> None:
    floor = panel(vector(-5.0, -5.0, -1.0), vector(10.0, 0.0, 0.0), vector(0.0, 10.0, 0.0), WHOLE, WHOLE, (1.0, 1.0), 0)

    _, inverse_depth = shoot(floor, plain(255.0))

    rows = np.arange(LENS.height)
    expected = np.maximum((rows - LENS.cy) / LENS.fy, 0.0)
    column = inverse_depth[:, 80]
    # The floor ends 5 m ahead.
    assert np.allclose(column, np.where(expected >= 0.2, expected, 0.0), atol=1e-6)


def test_colors_keep_to_their_lanes() -> None:
    bank = TextureBank()
    color = np.array([255.0, 10.0, 128.0])
    bank.add_color(color)
    pack = bank.pack()

    radiance, _ = shoot(board(2.0), pack)

    linear = ((color / 255 + 0.055) / 1.055) ** 2.4
    linear[1] = 10 / 255 / 12.92
    assert np.allclose(radiance[60, 80], linear, atol=1 / FULL)
    assert 3 * LANE_BITS <= 64
    assert math.log2(256 * FULL) < LANE_BITS


def test_levels_of_a_texture_keep_its_mean() -> None:
    bank = TextureBank()
    bank.add(np.random.default_rng(1).integers(0, 256, (64, 64, 3)).astype(np.uint8))
    pack = bank.pack()

    def mean_green(level: int) -> float:
        side = 64 >> level
        words = pack.texels[pack.offsets[0, level] : pack.offsets[0, level] + side * side]
        return float(((words >> np.uint64(LANE_BITS)) & np.uint64((1 << LANE_BITS) - 1)).mean())

    means = [mean_green(level) for level in range(7)]
    assert np.allclose(means, means[0], atol=2.0)
