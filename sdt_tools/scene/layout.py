"""One drawn world: where everything stands and what the operator is going to do. No randomness is left in it.

Metres, radians and seconds, in the frame of the scenario: x ahead of the robot's nominal start, y left.
"""

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final, Literal

import numpy as np
from jaxtyping import Float64

from sdt_tools.frames import FRAME_BASE, FRAME_LIDAR, LIDAR_AHEAD_M, FrameTransform, Gesture, Pose2D


@dataclass(frozen=True)
class Wall:
    """A straight wall without thickness."""

    x0_m: float
    y0_m: float
    x1_m: float
    y1_m: float


@dataclass(frozen=True)
class Box:
    """A rectangle: ``length_m`` along its own x axis, ``width_m`` along its y axis; ``height_m`` is for the camera."""

    x_m: float
    y_m: float
    length_m: float
    width_m: float
    yaw_rad: float
    height_m: float = 0.6

    def corners(self) -> Float64[np.ndarray, "4 2"]:
        """The corners, counter-clockwise."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (self.length_m / 2, self.width_m / 2)
        corners: Float64[np.ndarray, "4 2"] = half @ np.array([[c, s], [-s, c]]) + (self.x_m, self.y_m)
        return corners


@dataclass(frozen=True)
class Post:
    """A round upright: a table leg, a pole."""

    x_m: float
    y_m: float
    radius_m: float


@dataclass(frozen=True)
class OperatorPlan:
    """What the operator does: his path from his start to its end, and how he walks.

    He rests ``pauses_s[i]`` before he leaves ``path_m[i]``, waits while the robot's LiDAR is farther than
    ``waits_at_lead_m`` behind him, and never walks closer to the robot's sides than ``keeps_away_m``; when it does not
    make way within ``patience_s`` he goes on to his next point.
    """

    path_m: tuple[tuple[float, float], ...]
    pauses_s: tuple[float, ...]
    speed_mps: float
    waits_at_lead_m: float
    keeps_away_m: float
    patience_s: float
    yaw_rad: float
    leg_radius_m: float
    leg_separation_m: float
    step_length_m: float
    first_phase_rad: float
    faces_off_rad: float = 0.0
    """How far beside the robot he faces when he waits for it."""


class Behaviour(StrEnum):
    """What an idle operator does with his hands that is no gesture, but might be taken for one."""

    SCRATCH_HEAD = "scratch_head"
    RUB_NECK = "rub_neck"
    TOUCH_FACE = "touch_face"
    DRINK = "drink"
    PHONE_CALL = "phone_call"
    PHONE_TEXT = "phone_text"
    POINT_AHEAD = "point_ahead"
    POINT_ASIDE = "point_aside"
    CARRY_BOX = "carry_box"
    FOLD_ARMS = "fold_arms"
    HANDS_ON_HIPS = "hands_on_hips"
    WAVE_LOW = "wave_low"
    SHRUG = "shrug"


@dataclass(frozen=True)
class Manner:
    """How one gesture or behaviour differs from another by the same person; zeros are his habit. Radians."""

    raise_rad: float = 0.0
    elbow_rad: float = 0.0
    forward_rad: float = 0.0
    spread_rad: float = 0.0
    uneven_rad: float = 0.0
    """How much higher the left arm is held than the right one."""
    phase_rad: float = 0.0
    """Of what is moved to and fro."""
    other_hand: bool = False


AS_EVER: Final = Manner()


@dataclass(frozen=True)
class GestureEvent:
    """A gesture shown from ``at_s`` on for ``lasts_s``.

    Arms take ``moves_s`` from rest to it; they begin ``lead_s`` before ``at_s``, and as long before it ends they sink.
    """

    at_s: float
    gesture: Gesture
    lasts_s: float
    moves_s: float = 0.6
    lead_s: float = 0.0
    manner: Manner = AS_EVER


@dataclass(frozen=True)
class BehaviourEvent:
    """Something that the operator does with his hands, timed as a gesture is. A gesture goes before it."""

    at_s: float
    does: Behaviour
    lasts_s: float
    moves_s: float = 0.6
    lead_s: float = 0.0
    manner: Manner = AS_EVER


Surroundings = Literal["indoor", "outdoor", "garage"]
CameraKind = Literal["plain", "video"]


@dataclass(frozen=True)
class Sun:
    """Where the sun stands: counter-clockwise from x, and above the horizon."""

    azimuth_rad: float
    elevation_rad: float


@dataclass(frozen=True)
class Layout:
    """A drawn world. ``robot`` is the pose of the robot's centre; gestures and behaviours are in the order of time.

    For the camera: without ``surroundings`` the light tells them; ``mask`` forces or forbids a surgical mask; a
    ``video`` camera adapts its exposure with time, blurs what it turns past, and is dazzled.
    """

    name: str
    seed: int
    timeout_s: float
    robot: Pose2D
    operator: OperatorPlan
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    posts: tuple[Post, ...] = ()
    gestures: tuple[GestureEvent, ...] = field(default=())
    light: str = "indoor"
    behaviours: tuple[BehaviourEvent, ...] = ()
    surroundings: Surroundings | None = None
    sun: Sun | None = None
    mask: bool | None = None
    camera: CameraKind = "plain"

    def notes(self) -> dict[str, str]:
        """What a recording says of this world beside its name: light, and surroundings and mask where they are set."""
        told = {"light": self.light}
        if self.surroundings is not None:
            told["surroundings"] = self.surroundings
        if self.mask is not None:
            told["mask"] = "yes" if self.mask else "no"
        return told

    def segments(self) -> Float64[np.ndarray, "segments 4"]:
        """Everything straight that a ray can meet: x0, y0, x1, y1 of walls, then of the boxes' sides."""
        rows = [(wall.x0_m, wall.y0_m, wall.x1_m, wall.y1_m) for wall in self.walls]
        for box in self.boxes:
            corners = box.corners()
            rows += [(*corners[i], *corners[(i + 1) % 4]) for i in range(4)]
        return np.array(rows, dtype=np.float64).reshape(-1, 4)

    def circles(self) -> Float64[np.ndarray, "posts 3"]:
        """Everything round that stands still: x, y, radius of the posts."""
        rows = [(post.x_m, post.y_m, post.radius_m) for post in self.posts]
        return np.array(rows, dtype=np.float64).reshape(-1, 3)


LIDAR_HEIGHT_M: Final = 0.35
"""Height of the scan plane above the floor: shins, not feet."""


def lidar_mount(stamp_ns: int) -> FrameTransform:
    """Where the LiDAR stands on the robot, as a message of that moment."""
    return FrameTransform(stamp_ns, FRAME_BASE, FRAME_LIDAR, (LIDAR_AHEAD_M, 0.0, LIDAR_HEIGHT_M), (0.0, 0.0, 0.0, 1.0))


def lidar_pose(robot: Pose2D) -> Pose2D:
    """Where the LiDAR is when the robot's centre is at ``robot``."""
    return Pose2D(
        robot.x_m + LIDAR_AHEAD_M * math.cos(robot.yaw_rad),
        robot.y_m + LIDAR_AHEAD_M * math.sin(robot.yaw_rad),
        robot.yaw_rad,
    )
