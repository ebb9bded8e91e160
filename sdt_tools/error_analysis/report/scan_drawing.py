"""A scan from above as SVG paths: ahead is up, left is left, in centimetres."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float, Float64

from sdt_tools.config import MotionConfig
from sdt_tools.frames import MotionClass
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

REACH_M: Final = 2.6
"""How far to the sides and ahead is shown."""
BEHIND_M: Final = 1.2


@dataclass(frozen=True)
class Furniture:
    """What is the same in every drawing."""

    view_box: str
    robot: str
    zone: str
    rings: str


def furniture() -> Furniture:
    """Robot, safety zone, and a ring every metre."""
    wide, high = round(200 * REACH_M), round(100 * (REACH_M + BEHIND_M))
    rings = [arc(float(metre), -np.pi, np.pi) for metre in range(1, int(REACH_M) + 1)]
    return Furniture(
        view_box=f"{-wide // 2} {-round(100 * REACH_M)} {wide} {high}",
        robot=_lines(base_to_lidar(strip, Mount()) for strip in footprint_base()),
        zone=_lines([safety_zone_lidar()]),
        rings=_lines(rings),
    )


def hits_path(ranges_m: Float64[np.ndarray, "rays"]) -> str:
    """Where the rays end, as dots (lines of no length, to be drawn with round ends); codes and far ranges left out."""
    rows = ranges_m[None]
    shown = distances(rows)
    points = np.round(100.0 * to_screen(hits_lidar(np.where(shown, rows, 0.0))[shown])).astype(int)
    limit = round(100 * REACH_M)
    near = (np.abs(points[:, 0]) <= limit) & (points[:, 1] >= -limit) & (points[:, 1] <= round(100 * BEHIND_M))
    return "".join(f"M{x} {y}h0" for x, y in np.unique(points[near], axis=0).tolist())


def motion_path(motion: str) -> str:
    """The way that a motion class would take the robot, as an arrow; empty for what is none."""
    known = {one.label: one for one in MotionClass}
    if motion not in known:
        return ""
    return _lines(base_to_lidar(strip, Mount()) for strip in motion_base(MotionConfig().twist(known[motion])))


def operator_place(range_m: float | None, bearing_rad: float | None) -> tuple[int, int] | None:
    """Where he stands in the drawing; None where that is not known, or beyond what is shown."""
    if range_m is None or bearing_rad is None:
        return None
    point = range_m * np.array([[np.cos(bearing_rad), np.sin(bearing_rad)]])
    x, y = np.round(100.0 * to_screen(point)[0]).astype(int).tolist()
    inside = abs(x) <= 100 * REACH_M and -100 * REACH_M <= y <= 100 * BEHIND_M
    return (x, y) if inside else None


def _lines(strips: Iterable[Float[np.ndarray, "_ 2"]]) -> str:
    drawn = [np.round(100.0 * to_screen(np.asarray(strip, np.float64))).astype(int).tolist() for strip in strips]
    return "".join("M" + "L".join(f"{x} {y}" for x, y in strip) for strip in drawn)
