"""The scan from above: what stays (robot, rings, safety zone), what each scan shows, and the motions as arrows."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import rerun as rr
from jaxtyping import Float32, Float64

from sdt_tools.config import MotionConfig
from sdt_tools.frames import FIRST_RAY_RAD, MotionClass, ray_angles_rad
from sdt_tools.top_view import (
    Mount,
    arc,
    base_to_lidar,
    codes,
    distances,
    footprint_base,
    hits_lidar,
    motion_base,
    safety_zone_lidar,
    to_screen,
)
from sdt_tools.view import entities, palette
from sdt_tools.view.palette import Rgb
from sdt_tools.view.timeline import Rows, send

Strip = Float32[np.ndarray, "_ 2"]

THIN: Final = -0.8
"""Negative radii are in points on the screen, whatever the zoom."""
NORMAL: Final = -1.4
BOLD: Final = -2.4
POINT: Final = -2.3
TICK: Final = -1.2

RIM: Final = 0.97
"""Where the ticks for codes stand, as a share of the reach."""


def draw_furniture(stream: rr.RecordingStream, mount: Mount, reach_m: float) -> None:
    """What does not move in the LiDAR's frame: range rings up to ``reach_m``, field of view, robot, safety zone."""
    metres = np.arange(1, int(reach_m) + 1)
    rings = [arc(float(metre), -np.pi, np.pi) for metre in metres]
    edge = reach_m * np.array([[np.cos(FIRST_RAY_RAD), np.sin(FIRST_RAY_RAD)]])
    blind = [np.concatenate([np.zeros((1, 2)), edge * (1.0, side)]) for side in (-1.0, 1.0)]
    _draw_strips(stream, f"{entities.SCAN_FURNITURE}/rings", rings + blind, palette.FAINT, THIN, order=-20.0)
    ahead_right = np.stack([metres, -metres], axis=1) * np.sqrt(0.5)  # where the operator seldom is
    marks = rr.Points2D(
        to_screen(ahead_right), radii=THIN, colors=palette.QUIET, labels=[f"{m} m" for m in metres], show_labels=True
    )
    stream.log(f"{entities.SCAN_FURNITURE}/metres", marks, static=True, strict=True)
    robot = [base_to_lidar(strip, mount) for strip in footprint_base()]
    _draw_strips(stream, f"{entities.SCAN_FURNITURE}/robot", robot, palette.ROBOT, -1.0, order=10.0)
    zone = [safety_zone_lidar()]
    _draw_strips(stream, f"{entities.SCAN_FURNITURE}/safety_zone", zone, palette.ZONE, NORMAL, order=11.0)


def _draw_strips(
    stream: rr.RecordingStream,
    entity: str,
    strips: Sequence[Float64[np.ndarray, "_ 2"]],
    color: Rgb,
    radius: float,
    order: float,
) -> None:
    drawn = [to_screen(strip) for strip in strips]
    shape = rr.LineStrips2D(drawn, colors=color, radii=radius, draw_order=order)
    stream.log(entity, shape, static=True, strict=True)


def style_scans(stream: rr.RecordingStream) -> None:
    """How scans are drawn, once for all of them."""
    points = rr.Points2D.from_fields(radii=POINT)
    ticks = rr.Points2D.from_fields(radii=TICK, colors=palette.CODE)
    stream.log(entities.SCAN_POINTS, points, static=True, strict=True)
    stream.log(entities.SCAN_CODES, ticks, static=True, strict=True)


def send_scans(
    stream: rr.RecordingStream,
    rows: Rows,
    ranges_m: Float64[np.ndarray, "rows rays"],
    statuses: Sequence[str],
    reach_m: float,
) -> None:
    """Scans as points, coloured by what is known of them; codes become small ticks at the rim, full range nothing."""
    shown = distances(ranges_m)
    hits = to_screen(hits_lidar(np.where(shown, ranges_m, 0.0))[shown])
    colors = palette.packed(palette.STATUSES[status] for status in statuses)
    points = rr.Points2D.columns(positions=hits).partition(shown.sum(axis=1))
    send(stream, entities.SCAN_POINTS, rows, [*points, *rr.Points2D.columns(colors=colors)])
    without = codes(ranges_m)
    angles = ray_angles_rad()[np.nonzero(without)[1]]
    ticks = to_screen(RIM * reach_m * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    send(stream, entities.SCAN_CODES, rows, rr.Points2D.columns(positions=ticks).partition(without.sum(axis=1)))


def style_motion(stream: rr.RecordingStream, entity: str, color: Rgb, radius: float, order: float) -> None:
    """How an arrow is drawn, once for all rows; a higher ``order`` lies on top."""
    style = rr.LineStrips2D.from_fields(radii=radius, colors=color, draw_order=order)
    stream.log(entity, style, static=True, strict=True)


def send_motions(
    stream: rr.RecordingStream, entity: str, rows: Rows, motions: Sequence[str], config: MotionConfig, mount: Mount
) -> None:
    """Motion classes as the way the robot would go with them; what is none of them is not drawn."""
    shapes = {motion.label: motion_strips(motion, config, mount) for motion in MotionClass}
    drawn = [shapes.get(motion, []) for motion in motions]
    strips = [strip for row in drawn for strip in row]
    send(stream, entity, rows, rr.LineStrips2D.columns(strips=strips).partition([len(row) for row in drawn]))


def motion_strips(motion: MotionClass, config: MotionConfig, mount: Mount) -> list[Strip]:
    """A motion class as an arrow on the screen."""
    return [to_screen(base_to_lidar(strip, mount)) for strip in motion_base(config.twist(motion))]
