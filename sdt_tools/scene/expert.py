"""The expert: follows the operator by a polar rule, and gives way where the rule would touch something.

Nominally it turns while the operator stands more than 20° aside, drives up when he is farther than 1.2 m, backs off
when he is nearer than 0.8 m, and stays otherwise. Each candidate is driven in thought for a second; one that leaves too
little room yields to the next. It knows the scene's truth, but behaves much as a function of what the LiDAR sees, so
that a network without memory can learn it.
"""

import math
from typing import Final, no_type_check

import numpy as np
from numba import njit

from sdt_tools.frames import RAYS, MotionClass
from sdt_tools.scene.footprint import clearance_m
from sdt_tools.scene.raycast import cast_rays
from sdt_tools.scene.world import World

BEARING_BAND_RAD: Final = 0.35
NEAR_M: Final = 0.8
FAR_M: Final = 1.2
_TURN_AT_M: Final = 1.0
"""Turns are made forward beyond this range, else backward: both lead to the paper's one metre."""
_LOOK_AHEAD_S: Final = 0.6
_LOOK_BACK_S: Final = 0.3
"""How far driving is thought ahead: forwards far enough to go round things, backwards, where the LiDAR is blind and a
network can only guess, no farther than stopping takes."""
_LOOK_STEP_S: Final = 0.1
_ROOM_M: Final = 0.08
_ESCAPE_M: Final = 0.02
"""A motion is also right when it gains this much room."""
_FIRST_FRONT_RAY: Final = 150
_LAST_FRONT_RAY: Final = 389
"""The rays of the paper's safety domains (Table II)."""
_FRONT_STOP_M: Final = 0.25
"""Nothing is approached that a front ray sees nearer than this: the domains' 0.2 m, and some for the noise."""

# what to try when the polar rule asks for the row's class: the operator to the left, to the right
_TRIES_LEFT: Final = np.array([[0, 0, 0], [1, 2, 3], [2, 1, 5], [3, 1, 6], [4, 5, 6], [5, 4, 2], [6, 4, 3]])
_TRIES_RIGHT: Final = np.array([[0, 0, 0], [1, 3, 2], [2, 1, 5], [3, 1, 6], [4, 6, 5], [5, 4, 2], [6, 4, 3]])


class SceneExpert:
    """Advises on the motion class for the present state of ``world``."""

    def __init__(self, world: World) -> None:
        self._world = world
        twists = [world.config.motions.twist(motion) for motion in MotionClass]
        self._twists = np.array([(twist.linear_mps, twist.angular_radps) for twist in twists])
        self._scan = np.empty(RAYS)

    def advise(self) -> MotionClass:
        """The motion that the expert would choose now."""
        world, lidar = self._world, self._world.lidar_pose
        cast_rays(lidar.x_m, lidar.y_m, lidar.yaw_rad, world.segments, world.circles, self._scan)
        front_m = self._scan[_FIRST_FRONT_RAY : _LAST_FRONT_RAY + 1].min()
        robot = world.robot
        return MotionClass(
            _choose(
                robot.x_m,
                robot.y_m,
                robot.yaw_rad,
                *self._operator(),
                front_m <= _FRONT_STOP_M,
                world.segments,
                world.circles,
                self._twists,
            )
        )

    def advise_in_the_open(self) -> MotionClass:
        """The polar rule alone: what the expert would choose if nothing stood around."""
        return MotionClass(polar_rule(*self._operator()))

    def _operator(self) -> tuple[float, float]:
        """His range in metres and bearing in radians, seen from the LiDAR."""
        lidar, operator = self._world.lidar_pose, self._world.operator
        dx_m, dy_m = operator.x_m - lidar.x_m, operator.y_m - lidar.y_m
        return math.hypot(dx_m, dy_m), math.remainder(math.atan2(dy_m, dx_m) - lidar.yaw_rad, 2 * math.pi)


@njit(cache=True)
@no_type_check
def polar_rule(range_m, bearing_rad):
    """The class for an operator at ``range_m`` and ``bearing_rad`` of the LiDAR in an empty world."""
    if abs(bearing_rad) > BEARING_BAND_RAD:
        if range_m > _TURN_AT_M:
            return 2 if bearing_rad > 0.0 else 3
        return 5 if bearing_rad > 0.0 else 6
    if range_m > FAR_M:
        return 1
    if range_m < NEAR_M:
        return 4
    return 0


@njit(cache=True)
@no_type_check
def _choose(x_m, y_m, yaw_rad, range_m, bearing_rad, front_blocked, segments, circles, twists):
    wanted = polar_rule(range_m, bearing_rad)
    if wanted == 0:
        return 0
    left = bearing_rad > 0.0
    room_now = clearance_m(x_m, y_m, yaw_rad, segments, circles)
    for i in range(3):
        motion = _TRIES_LEFT[wanted, i] if left else _TRIES_RIGHT[wanted, i]
        if front_blocked and motion <= 3:
            continue
        look_s = _LOOK_AHEAD_S if motion <= 3 else _LOOK_BACK_S
        room = _room_ahead(x_m, y_m, yaw_rad, twists[motion], look_s, segments, circles)
        if room > _ROOM_M or room > room_now + _ESCAPE_M:
            return motion
    if wanted <= 3 or front_blocked:
        for i in range(3):
            motion = 4 if i == 1 else (5 if left == (i == 0) else 6)
            if _room_ahead(x_m, y_m, yaw_rad, twists[motion], _LOOK_BACK_S, segments, circles) > _ROOM_M:
                return motion
    return 0


@njit(cache=True)
@no_type_check
def _room_ahead(x_m, y_m, yaw_rad, twist, look_s, segments, circles):
    """The least clearance on the way when ``twist`` is driven for ``look_s``."""
    least = clearance_m(x_m, y_m, yaw_rad, segments[:0], circles[:0])
    for _ in range(round(look_s / _LOOK_STEP_S)):
        middle = yaw_rad + 0.5 * twist[1] * _LOOK_STEP_S
        x_m += twist[0] * math.cos(middle) * _LOOK_STEP_S
        y_m += twist[0] * math.sin(middle) * _LOOK_STEP_S
        yaw_rad += twist[1] * _LOOK_STEP_S
        least = min(least, clearance_m(x_m, y_m, yaw_rad, segments, circles))
    return least
