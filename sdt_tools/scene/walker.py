"""The operator: walks his path on two legs, waits for the robot."""

import math
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.frames import Pose2D
from sdt_tools.scene.footprint import distance_to_footprint_m
from sdt_tools.scene.layout import Layout

_ARRIVED_M: Final = 0.06
_TURN_RADPS: Final = 3.0
_AMPLITUDE_PER_S: Final = 4.0
"""The stride grows to its full length, and comes to rest, within a quarter of a second."""
_TOES_M: Final = 0.05
"""Near the robot he takes steps short enough to leave this much room."""
_LEAST_SPREAD_M: Final = 0.075
"""Half the distance of legs that touch each other."""
_FACES_ROBOT_AFTER_S: Final = 0.6
"""People who wait turn round to whom they wait for."""


class Walker:
    """A walking person. ``advance`` moves him; his state is read from the attributes.

    ``gait_phase_rad`` runs through 2π with every two steps; ``gait_amplitude`` is 0 standing and 1 in full stride.
    """

    def __init__(self, layout: Layout) -> None:
        plan = layout.operator
        self.pose = Pose2D(*plan.path_m[0], plan.yaw_rad)
        self.gait_phase_rad = plan.first_phase_rad
        self.gait_amplitude = 0.0
        self.done = False
        self.standing = True
        self._plan = plan
        self._next = 1
        self._rest_until_s = plan.pauses_s[0]
        self._held_up_s = 0.0
        self._still_s = 0.0
        self._spread_m = 0.0
        self._stand_by(layout.robot)

    @property
    def at_end(self) -> bool:
        """Whether he stands at the last point of his path, resting there or for good."""
        return self._next == len(self._plan.path_m)

    def advance(self, time_s: float, dt_s: float, robot: Pose2D, lidar: Pose2D, signals: bool = False) -> None:
        """Live from ``time_s`` on for ``dt_s``, seeing the robot's centre and its LiDAR at these poses.

        Who ``signals`` stands still, and turns at once to the robot that is to see it.
        """
        rests = time_s < self._rest_until_s
        self.done = self._next == len(self._plan.path_m) and not rests
        self.standing = rests or self.done or signals or not self._walk(time_s, dt_s, robot, lidar)
        if not self.standing:
            self._still_s = 0.0
        else:
            self._still_s += dt_s
            self.gait_amplitude = max(0.0, self.gait_amplitude - _AMPLITUDE_PER_S * dt_s)
            if signals or self._still_s > _FACES_ROBOT_AFTER_S:
                x_m, y_m = self.pose.x_m, self.pose.y_m
                self._turn_to(math.atan2(lidar.y_m - y_m, lidar.x_m - x_m) + self._plan.faces_off_rad, dt_s)
        self._stand_by(robot)

    def legs(self) -> Float64[np.ndarray, "2 3"]:
        """The legs at the height of the LiDAR, left then right: x, y, radius."""
        plan, pose = self._plan, self.pose
        c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        swing = self.gait_amplitude * plan.step_length_m / 2 * math.sin(self.gait_phase_rad)
        half = self._spread_m
        return np.array(
            [
                (pose.x_m - s * half + c * swing, pose.y_m + c * half + s * swing, plan.leg_radius_m),
                (pose.x_m + s * half - c * swing, pose.y_m - c * half - s * swing, plan.leg_radius_m),
            ]
        )

    def _stand_by(self, robot: Pose2D) -> None:
        """Draw the legs together near the robot, so that none is under its wheels."""
        plan = self._plan
        room_m = distance_to_footprint_m(robot, self.pose.x_m, self.pose.y_m) - plan.leg_radius_m - _TOES_M
        self._spread_m = min(plan.leg_separation_m / 2, max(_LEAST_SPREAD_M, room_m))

    def _walk(self, time_s: float, dt_s: float, robot: Pose2D, lidar: Pose2D) -> bool:
        """Take one step if nothing holds him up; say whether he did."""
        plan = self._plan
        goal_x, goal_y = plan.path_m[self._next]
        dx, dy = goal_x - self.pose.x_m, goal_y - self.pose.y_m
        left_m = math.hypot(dx, dy)
        if left_m < _ARRIVED_M:
            self._go_on(time_s)
            return False
        stride_m = min(left_m, plan.speed_mps * dt_s)
        new_x, new_y = self.pose.x_m + dx / left_m * stride_m, self.pose.y_m + dy / left_m * stride_m
        lead_m = math.hypot(lidar.x_m - self.pose.x_m, lidar.y_m - self.pose.y_m)
        if lead_m > plan.waits_at_lead_m and math.hypot(lidar.x_m - new_x, lidar.y_m - new_y) > lead_m:
            return False
        room_m = distance_to_footprint_m(robot, new_x, new_y)
        if room_m < plan.keeps_away_m and room_m < distance_to_footprint_m(robot, self.pose.x_m, self.pose.y_m):
            self._held_up_s += dt_s
            if self._held_up_s > plan.patience_s:
                self._go_on(time_s)
            return False
        self._held_up_s = 0.0
        self.pose = Pose2D(new_x, new_y, self.pose.yaw_rad)
        self._turn_to(math.atan2(dy, dx), dt_s)
        short = max(0.1, min(1.0, (room_m - plan.leg_radius_m - _TOES_M) / (plan.step_length_m / 2)))
        self.gait_amplitude = min(short, self.gait_amplitude + _AMPLITUDE_PER_S * dt_s)
        # two steps, each of step_length_m, make one period of the gait
        self.gait_phase_rad = (self.gait_phase_rad + math.pi * stride_m / plan.step_length_m) % (2 * math.pi)
        return True

    def _go_on(self, time_s: float) -> None:
        self._held_up_s = 0.0
        self._rest_until_s = time_s + self._plan.pauses_s[self._next]
        self._next += 1

    def _turn_to(self, yaw_rad: float, dt_s: float) -> None:
        pose = self.pose
        error_rad = math.remainder(yaw_rad - pose.yaw_rad, 2 * math.pi)
        most_rad = _TURN_RADPS * dt_s
        turn_rad = max(-most_rad, min(most_rad, error_rad))
        self.pose = Pose2D(pose.x_m, pose.y_m, math.remainder(pose.yaw_rad + turn_rad, 2 * math.pi))
