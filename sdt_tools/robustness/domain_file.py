"""Safety domains of one's own, in a TOML file.

A ``[[domain]]`` is a family of boxes that allow the same classes:

    [[domain]]
    name = "shins"
    rays = [150, 389]                            # one box for each of these rays, both ends included
    width = 3                                    # so many neighbouring rays are near, that ray in their middle
    near = { lower_m = 0.0, upper_m = 0.2 }
    others = { lower_m = 0.0, upper_m = 4.0 }    # without it, 0 to 20 m
    allowed = ["stay", "backward", "left_backward", "right_backward"]

Instead of ``rays``, ``width`` and ``near``, ``box`` gives a single box part by part; rays that no part names take
``others``:

    box = [{ rays = [100, 200], lower_m = 0.0, upper_m = 1.0 }, { rays = [340, 440], lower_m = 0.0, upper_m = 1.0 }]
"""

from pathlib import Path
from typing import Final

import numpy as np
from pydantic import Field, model_validator

from sdt_tools.config import Config, load_config
from sdt_tools.errors import ConfigError
from sdt_tools.frames import MAX_RANGE_M, RAYS, MotionClass
from sdt_tools.robustness.boxes import DomainSet

_LABELS: Final = {motion.label: motion for motion in MotionClass}


class Interval(Config):
    """Ranges from ``lower_m`` to ``upper_m``, both included."""

    lower_m: float = Field(ge=0.0, le=MAX_RANGE_M, strict=True)
    upper_m: float = Field(ge=0.0, le=MAX_RANGE_M, strict=True)

    @model_validator(mode="after")
    def _ordered(self) -> "Interval":
        if self.lower_m > self.upper_m:
            raise ValueError(f"lower_m = {self.lower_m:g} is above upper_m = {self.upper_m:g}")
        return self


class BoxPart(Interval):
    """An interval for the rays first to last, both included."""

    rays: tuple[int, int]

    @model_validator(mode="after")
    def _on_the_scan(self) -> "BoxPart":
        _check_rays(self.rays)
        return self


class DomainSpec(Config):
    """One ``[[domain]]``."""

    name: str = Field(pattern=r"^[\w .,:+-]+$")
    allowed: tuple[str, ...]
    others: Interval = Interval(lower_m=0.0, upper_m=MAX_RANGE_M)
    rays: tuple[int, int] | None = None
    width: int = Field(default=1, ge=1, le=RAYS, strict=True)
    near: Interval | None = None
    box: tuple[BoxPart, ...] | None = Field(default=None, min_length=1)

    @model_validator(mode="after")
    def _fits(self) -> "DomainSpec":
        _check_allowed(self.allowed)
        if self.box is not None:
            if self.rays is not None or self.near is not None or self.width != 1:
                raise ValueError("box stands alone; rays, width and near belong to the other form")
            return self
        if self.rays is None or self.near is None:
            raise ValueError("give rays and near, or box")
        if self.width % 2 == 0:
            raise ValueError(f"width = {self.width} has no middle ray; give an odd number")
        half = self.width // 2
        _check_rays((self.rays[0] - half, self.rays[1] + half))
        return self


class DomainFile(Config):
    """A file of domains."""

    domain: tuple[DomainSpec, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _named_apart(self) -> "DomainFile":
        names = [spec.name for spec in self.domain]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two domains are called '{name}'; name them apart")
        return self


def load_domains(path: Path) -> tuple[DomainSet, ...]:
    """The sets of a file, one a ``[[domain]]``.

    Raises ConfigError, naming file and entry: for a file that is missing, empty or malformed, unknown keys, rays that a
    scan does not have, intervals upside down or beyond the sensor's range, and for allowing all classes or none.
    """
    if not path.is_file():
        raise ConfigError(f"{path}: no such file of domains; check the path")
    return tuple(_domain_set(spec) for spec in load_config(DomainFile, path).domain)


def _domain_set(spec: DomainSpec) -> DomainSet:
    if spec.box is not None:
        rays = np.array([(spec.box[0].rays[0] + spec.box[0].rays[1]) // 2])
    else:
        assert spec.rays is not None
        rays = np.arange(spec.rays[0], spec.rays[1] + 1)
    lower_m = np.full((len(rays), RAYS), spec.others.lower_m)
    upper_m = np.full((len(rays), RAYS), spec.others.upper_m)
    if spec.box is not None:
        for part in spec.box:
            inside = slice(part.rays[0], part.rays[1] + 1)
            lower_m[:, inside], upper_m[:, inside] = part.lower_m, part.upper_m
    else:
        assert spec.near is not None
        for offset in range(-(spec.width // 2), spec.width // 2 + 1):
            lower_m[np.arange(len(rays)), rays + offset] = spec.near.lower_m
            upper_m[np.arange(len(rays)), rays + offset] = spec.near.upper_m
    return DomainSet(spec.name, lower_m, upper_m, rays, frozenset(_LABELS[label] for label in spec.allowed))


def _check_rays(rays: tuple[int, int]) -> None:
    first, last = rays
    if first > last:
        raise ValueError(f"rays {first} to {last}: the first comes after the last")
    if not 0 <= first <= last < RAYS:
        raise ValueError(f"rays {first} to {last} are not on a scan, whose rays are 0 to {RAYS - 1}")


def _check_allowed(allowed: tuple[str, ...]) -> None:
    for label in allowed:
        if label not in _LABELS:
            raise ValueError(f"allowed has '{label}', but the classes are {', '.join(_LABELS)}")
    if not allowed:
        raise ValueError("allowed names no class, so nothing could be right in this domain")
    if len(set(allowed)) == len(_LABELS):
        raise ValueError("allowed names every class, so nothing is asked of this domain")
