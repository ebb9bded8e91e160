"""Training scans, varied in ways that leave the right answer as it is."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import torch
from jaxtyping import Bool, Float32, Int64
from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.frames import FORWARD_CLASSES, MotionClass
from sdt_tools.models.preprocess import FIRST_FRONT_RAY, LAST_FRONT_RAY, PreprocessConfig, resolve_codes
from sdt_tools.training.loop import Batch

MIRRORED_LABEL: Final = np.array([int(motion.mirrored) for motion in MotionClass])
"""For each class the one for the scene mirrored left to right."""

_FORWARD: Final = [int(motion) for motion in sorted(FORWARD_CLASSES)]


class AugmentConfig(Config):
    """How training scans are varied, anew in each epoch.

    ``mirror``: half of the scans are mirrored left to right, with their classes. ``noise_m``: standard deviation of
    what is added to every reading. ``code_share``: share of the rays, each by chance, that turn into codes. Both come
    before codes are resolved, as they would at the sensor. ``near_miss_share``: share of the scans with a forward label
    and a clear front that get one front ray at ``near_miss_m``, and keep their label: near, but outside every domain.
    """

    mirror: bool = True
    noise_m: float = Field(default=0.0, ge=0.0)
    code_share: float = Field(default=0.0, ge=0.0, lt=1.0)
    near_miss_share: float = Field(default=0.0, ge=0.0, le=1.0)
    near_miss_m: tuple[float, float] = (0.26, 0.54)


_CLEAR_M: Final = 0.3
"""A front is clear when none of its rays is nearer."""


class VariedBatches:
    """Epochs of shuffled, varied batches of one size; what is left over waits for another epoch's shuffle.

    An epoch depends on ``seed`` and its number alone.
    """

    def __init__(
        self,
        ranges_m: Float32[np.ndarray, "frames rays"],
        labels: Int64[np.ndarray, "frames"],
        batch_size: int,
        config: AugmentConfig,
        preprocess: PreprocessConfig,
        seed: int,
    ) -> None:
        self._ranges_m, self._labels = ranges_m, labels
        self._size = min(batch_size, len(labels))
        self._config, self._preprocess = config, preprocess
        self._seed = seed

    def __len__(self) -> int:
        return len(self._labels) // self._size

    def epoch(self, number: int) -> Iterator[Batch]:
        """The batches of epoch ``number``."""
        rng = np.random.default_rng((self._seed, number))
        order = rng.permutation(len(self._labels))[: len(self) * self._size]
        for chosen in order.reshape(-1, self._size):
            ranges_m, labels = augment(self._ranges_m[chosen], self._labels[chosen], self._config, rng)
            resolved = resolve_codes(ranges_m, self._preprocess)
            yield Batch(torch.from_numpy(resolved), torch.from_numpy(labels))


def augment(
    ranges_m: Float32[np.ndarray, "batch rays"],
    labels: Int64[np.ndarray, "batch"],
    config: AugmentConfig,
    rng: np.random.Generator,
) -> tuple[Float32[np.ndarray, "batch rays"], Int64[np.ndarray, "batch"]]:
    """Varied copies of scans as the sensor gave them (codes kept), and the labels that go with them."""
    if config.mirror:
        ranges_m, labels = mirrored(ranges_m, labels, rng.random(len(labels)) < 0.5)
    if config.noise_m > 0.0:
        noise = rng.standard_normal(ranges_m.shape, dtype=np.float32) * np.float32(config.noise_m)
        ranges_m = np.where(ranges_m > 0.0, ranges_m + noise, ranges_m)
    if config.code_share > 0.0:
        ranges_m = np.where(rng.random(ranges_m.shape, dtype=np.float32) < config.code_share, np.float32(0), ranges_m)
    if config.near_miss_share > 0.0:
        ranges_m = _with_near_misses(ranges_m, labels, config, rng)
    return ranges_m, labels


def _with_near_misses(
    ranges_m: Float32[np.ndarray, "batch rays"],
    labels: Int64[np.ndarray, "batch"],
    config: AugmentConfig,
    rng: np.random.Generator,
) -> Float32[np.ndarray, "batch rays"]:
    front = ranges_m[:, FIRST_FRONT_RAY : LAST_FRONT_RAY + 1]
    clear = np.where(front > 0.0, front, np.inf).min(axis=1) > _CLEAR_M
    chosen = np.flatnonzero(np.isin(labels, _FORWARD) & clear & (rng.random(len(labels)) < config.near_miss_share))
    varied = ranges_m.copy()
    rays = rng.integers(FIRST_FRONT_RAY, LAST_FRONT_RAY + 1, len(chosen))
    varied[chosen, rays] = rng.uniform(*config.near_miss_m, len(chosen))
    return varied


def mirrored(
    ranges_m: Float32[np.ndarray, "batch rays"], labels: Int64[np.ndarray, "batch"], chosen: Bool[np.ndarray, "batch"]
) -> tuple[Float32[np.ndarray, "batch rays"], Int64[np.ndarray, "batch"]]:
    """Scans and labels, those ``chosen`` mirrored left to right."""
    return (
        np.where(chosen[:, None], ranges_m[:, ::-1], ranges_m),
        np.where(chosen, MIRRORED_LABEL[labels], labels),
    )
