"""The rasterizer against casting one ray a pixel, over random triangles; surfaces that tile."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sdt_tools.scene.rendering import paint
from sdt_tools.scene.rendering.mesh import SOLID, Mesh
from sdt_tools.scene.rendering.projection import Pinhole, View
from sdt_tools.scene.rendering.raster import draw
from sdt_tools.scene.rendering.texture import TextureBank

LENS = Pinhole(64, 48, 40.0, 40.0, 31.5, 23.5)
AXES = np.eye(3)


def cast(corners: np.ndarray, slack: float) -> tuple[np.ndarray, np.ndarray]:
    """Whether each pixel's ray meets the triangle widened by ``slack`` (barycentric), and its inverse depth there."""
    v, u = np.meshgrid(np.arange(LENS.height), np.arange(LENS.width), indexing="ij")
    rays = np.stack([(u - LENS.cx) / LENS.fx, (v - LENS.cy) / LENS.fy, np.ones(u.shape)], axis=-1)
    a, b, c = corners
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = np.cross(b - a, c - a)
        depth = (a @ normal) / (rays @ normal)
        points = rays * depth[..., None]
        area = normal @ normal
        first = np.cross(c - b, points - b) @ normal / area
        second = np.cross(a - c, points - c) @ normal / area
        third = 1 - first - second
        inside = (np.minimum(np.minimum(first, second), third) >= -slack) & (depth > 0.05)
        return inside, 1 / depth


coordinate = st.floats(-3, 3, width=32)


@settings(max_examples=100, deadline=None)
@given(arrays(np.float64, (3, 3), elements=coordinate), st.floats(0.0, 4.0))
def test_a_triangle_covers_what_its_rays_meet(corners: np.ndarray, ahead: float) -> None:
    corners = corners + np.array([0.0, 0.0, ahead])
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    # Slivers and triangles seen edge-on are all edge.
    if np.linalg.norm(normal) < 0.1 or abs(corners[0] @ normal) / np.linalg.norm(normal) < 0.05:
        return
    bank = TextureBank()
    bank.add_color(np.full(3, 255.0))
    mesh = Mesh(
        corners,
        np.tile(normal, (3, 1)),
        np.zeros((3, 2)),
        np.ones(3),
        np.array([[0, 1, 2]], np.int32),
        np.zeros(1, np.int32),
        np.full(1, SOLID, np.uint8),
    )
    radiance = np.zeros((LENS.height, LENS.width, 3), np.float32)
    inverse_depth = np.zeros((LENS.height, LENS.width), np.float32)

    draw(mesh, bank.pack(), View(np.zeros(3), AXES), LENS, radiance, inverse_depth)

    surely, expected = cast(corners, -1e-3)
    perhaps, _ = cast(corners, 1e-3)
    with np.errstate(divide="ignore"):  # a ray along the triangle meets it nowhere
        near_cut = np.abs(1 / expected - 0.05) < 1e-3
    covered = inverse_depth > 0
    assert not (surely & ~covered & ~near_cut).any()
    assert not (covered & ~perhaps & ~near_cut).any()
    both = surely & covered
    assert np.allclose(inverse_depth[both], expected[both], rtol=1e-4)
    assert np.allclose(radiance[both], 1.0, atol=1e-3)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.tuples(st.integers(1, 20), st.integers(1, 20)))
def test_noise_tiles(seed: int, cells: tuple[int, int]) -> None:
    noise = paint.noise(np.random.default_rng(seed), cells, 128)

    for axis in (0, 1):
        steps = np.abs(np.diff(noise, axis=axis)).mean(axis=1 - axis)
        seam = np.abs(np.take(noise, 0, axis) - np.take(noise, -1, axis)).mean()
        assert seam <= 2.0 * steps.max()
