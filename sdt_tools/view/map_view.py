"""The world from above, in the odometry frame: where robot and operator went, and what the LiDAR saw on the way."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import rerun as rr
from jaxtyping import Float64, Int64

from sdt_tools.replay.tracks import PoseTrack
from sdt_tools.top_view import Mount, distances, footprint_base, hits_lidar, lidar_poses, place, to_screen
from sdt_tools.view import entities, palette
from sdt_tools.view.palette import Rgb
from sdt_tools.view.scan_view import NORMAL, THIN
from sdt_tools.view.timeline import Rows, send

MARGIN_M: Final = 2.0
FARTHEST_HIT_M: Final = 8.0
"""Hits beyond it are left out of the map: turns smear them."""


@dataclass(frozen=True)
class Bounds:
    """A rectangle on the screen, in metres; y runs down."""

    left: float
    right: float
    top: float
    bottom: float


def map_bounds(tracks: Sequence[PoseTrack]) -> Bounds:
    """What the map shows at first: the ways, and some space around them."""
    ways = to_screen(np.concatenate([track.poses[:2].T for track in tracks]))
    (left, top), (right, bottom) = ways.min(axis=0) - MARGIN_M, ways.max(axis=0) + MARGIN_M
    return Bounds(float(left), float(right), float(top), float(bottom))


def draw_way(stream: rr.RecordingStream, entity: str, track: PoseTrack, color: Rgb) -> None:
    """The whole way of a track, as a line that is always there."""
    if len(track.stamps_ns) > 1:
        way = rr.LineStrips2D([to_screen(track.poses[:2].T)], colors=color, radii=THIN, draw_order=1.0)
        stream.log(entity, way, static=True, strict=True)


def draw_surroundings(
    stream: rr.RecordingStream,
    ranges_m: Float64[np.ndarray, "scans rays"],
    stamps_ns: Int64[np.ndarray, "scans"],
    robot: PoseTrack,
    mount: Mount,
) -> None:
    """What a few scans of the recording hit, put where the robot stood."""
    bases = robot.at(stamps_ns).T
    known = np.isfinite(bases).all(axis=1)
    near = distances(ranges_m) & (ranges_m < FARTHEST_HIT_M)
    hits = hits_lidar(np.where(near, ranges_m, 0.0))
    rows = zip(lidar_poses(bases[known], mount), hits[known], near[known], strict=True)
    seen = [place(hit[shown], pose[None])[0] for pose, hit, shown in rows]
    if seen:
        points = rr.Points2D(to_screen(np.concatenate(seen)), radii=-1.0, colors=palette.WALLS, draw_order=-5.0)
        stream.log(entities.MAP_SURROUNDINGS, points, static=True, strict=True)


def style_robot(stream: rr.RecordingStream) -> None:
    """How the robot is drawn in the map, once for all rows."""
    style = rr.LineStrips2D.from_fields(colors=palette.ROBOT, radii=NORMAL, draw_order=4.0)
    stream.log(entities.MAP_ROBOT, style, static=True, strict=True)


def send_robot(stream: rr.RecordingStream, rows: Rows, bases: Float64[np.ndarray, "rows 3"]) -> None:
    """The robot's footprint where its base stood (x m, y m, yaw rad)."""
    outlines, chevrons = (to_screen(place(strip, bases)) for strip in footprint_base())
    strips = [strip for pair in zip(outlines, chevrons, strict=True) for strip in pair]
    send(stream, entities.MAP_ROBOT, rows, rr.LineStrips2D.columns(strips=strips).partition([2] * len(bases)))
