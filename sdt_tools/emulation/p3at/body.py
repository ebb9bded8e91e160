"""What the emulated base moves: by default nothing but itself, on an endless floor."""

import math
from typing import Protocol, runtime_checkable

from sdt_tools.frames import Pose2D, Twist


@runtime_checkable
class Body(Protocol):
    """Something with wheels. The emulated base calls it from one thread."""

    @property
    def pose(self) -> Pose2D:
        """Where it is."""
        ...

    def move(self, twist: Twist, dt_s: float) -> None:
        """Roll with ``twist`` for ``dt_s``."""
        ...


class FreeBody:
    """A base that meets nothing."""

    def __init__(self, pose: Pose2D | None = None) -> None:
        self.pose = Pose2D(0.0, 0.0, 0.0) if pose is None else pose

    def move(self, twist: Twist, dt_s: float) -> None:
        """Roll along the arc of ``twist``."""
        turn_rad = twist.angular_radps * dt_s
        chord_m = twist.linear_mps * dt_s * _sinc(turn_rad / 2)
        ahead_rad = self.pose.yaw_rad + turn_rad / 2
        self.pose = Pose2D(
            self.pose.x_m + chord_m * math.cos(ahead_rad),
            self.pose.y_m + chord_m * math.sin(ahead_rad),
            math.remainder(self.pose.yaw_rad + turn_rad, 2 * math.pi),
        )


def _sinc(angle_rad: float) -> float:
    return math.sin(angle_rad) / angle_rad if angle_rad else 1.0
