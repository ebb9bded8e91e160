"""What a recording knows around its scans: where robot and operator were, what was driven, what the expert said."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.frames import LIDAR_AHEAD_M, MotionCommand, Odometry, OperatorPose, Pose2D
from sdt_tools.recording.messages.topics import COMMAND, ODOMETRY, OPERATOR_POSE
from sdt_tools.recording.reader import Recording

POSE_HOLDS_NS: Final = 100_000_000
"""A pose is known at a stamp when it was measured within this time of it."""
COMMAND_HOLDS_NS: Final = 500_000_000
"""A command drives until the next one, or for this long."""
SPEED_WINDOW_NS: Final = 200_000_000
"""Speed is the way within this window, which odometry of millimetres resolves to 1 cm/s."""


@dataclass(frozen=True, eq=False)
class PoseTrack:
    """Poses in the odometry frame in order of stamps: x (m), y (m), yaw (rad, without jumps)."""

    stamps_ns: Int64[np.ndarray, "poses"]
    poses: Float64[np.ndarray, "3 poses"]

    def at(self, stamps_ns: Int64[np.ndarray, "frames"]) -> Float64[np.ndarray, "3 frames"]:
        """Poses at other stamps, linear in between; NaN where none was measured near."""
        if self.stamps_ns.size == 0:
            return np.full((3, len(stamps_ns)), np.nan)
        poses = self._interpolated(stamps_ns)
        poses[:, ~self._knows(stamps_ns)] = np.nan
        return poses

    def speed_mps(self, stamps_ns: Int64[np.ndarray, "frames"]) -> Float64[np.ndarray, "frames"]:
        """Speed along the heading, negative backwards; NaN where no pose is near."""
        if self.stamps_ns.size < 2:
            return np.full(len(stamps_ns), np.nan)
        ends_ns, seconds, known = self._window(stamps_ns)
        before, after = (self._interpolated(end_ns) for end_ns in ends_ns)
        yaw_rad = self._interpolated(stamps_ns)[2]
        way_m = (after[0] - before[0]) * np.cos(yaw_rad) + (after[1] - before[1]) * np.sin(yaw_rad)
        return np.where(known, way_m / np.where(known, seconds, 1.0), np.nan)

    def turn_radps(self, stamps_ns: Int64[np.ndarray, "frames"]) -> Float64[np.ndarray, "frames"]:
        """How fast the heading turns, left positive; NaN where no pose is near."""
        if self.stamps_ns.size < 2:
            return np.full(len(stamps_ns), np.nan)
        ends_ns, seconds, known = self._window(stamps_ns)
        before_rad, after_rad = (self._interpolated(end_ns)[2] for end_ns in ends_ns)
        return np.where(known, (after_rad - before_rad) / np.where(known, seconds, 1.0), np.nan)

    def _window(
        self, stamps_ns: Int64[np.ndarray, "frames"]
    ) -> tuple[Int64[np.ndarray, "2 frames"], Float64[np.ndarray, "frames"], Bool[np.ndarray, "frames"]]:
        """The window around each stamp, as far as poses reach: its ends, its length in seconds, whether it is known."""
        half = SPEED_WINDOW_NS // 2
        ends_ns = np.clip([stamps_ns - half, stamps_ns + half], self.stamps_ns[0], self.stamps_ns[-1])
        seconds = (ends_ns[1] - ends_ns[0]) * 1e-9
        return ends_ns, seconds, self._knows(stamps_ns) & (seconds > 0)

    def _interpolated(self, stamps_ns: Int64[np.ndarray, "frames"]) -> Float64[np.ndarray, "3 frames"]:
        start_ns = self.stamps_ns[0]  # float64 holds nanoseconds since the start exactly, since the epoch not
        own, asked = (self.stamps_ns - start_ns).astype(float), (stamps_ns - start_ns).astype(float)
        return np.array([np.interp(asked, own, values) for values in self.poses])

    def _knows(self, stamps_ns: Int64[np.ndarray, "frames"]) -> Bool[np.ndarray, "frames"]:
        after = np.searchsorted(self.stamps_ns, stamps_ns)
        next_ns = self.stamps_ns[np.minimum(after, len(self.stamps_ns) - 1)]
        last_ns = self.stamps_ns[np.maximum(after - 1, 0)]
        near: Bool[np.ndarray, "frames"] = (
            np.minimum(abs(next_ns - stamps_ns), abs(stamps_ns - last_ns)) <= POSE_HOLDS_NS
        )
        return near


@dataclass(frozen=True, eq=False)
class Tracks:
    """Poses of the robot's base and of the operator, and all commands, each in order of stamps."""

    robot: PoseTrack
    operator: PoseTrack
    commands: tuple[MotionCommand, ...]

    def operator_from_lidar(
        self, stamps_ns: Int64[np.ndarray, "frames"]
    ) -> tuple[Float64[np.ndarray, "frames"], Float64[np.ndarray, "frames"]]:
        """Range (m) and bearing (rad, left positive) of the operator in the LiDAR frame; NaN without poses."""
        x_m, y_m, yaw_rad = self.robot.at(stamps_ns)
        operator_x_m, operator_y_m, _ = self.operator.at(stamps_ns)
        ahead_m = operator_x_m - (x_m + LIDAR_AHEAD_M * np.cos(yaw_rad))
        aside_m = operator_y_m - (y_m + LIDAR_AHEAD_M * np.sin(yaw_rad))
        bearing_rad = np.arctan2(aside_m, ahead_m) - yaw_rad
        return np.hypot(ahead_m, aside_m), (bearing_rad + np.pi) % (2 * np.pi) - np.pi

    def operator_turned_rad(self, stamps_ns: Int64[np.ndarray, "frames"]) -> Float64[np.ndarray, "frames"]:
        """By how much the operator is turned away from the robot: 0 where he faces it, π where he shows his back."""
        x_m, y_m, _ = self.robot.at(stamps_ns)
        operator_x_m, operator_y_m, operator_yaw_rad = self.operator.at(stamps_ns)
        to_robot_rad = np.arctan2(y_m - operator_y_m, x_m - operator_x_m)
        turned_rad: Float64[np.ndarray, "frames"] = np.abs(
            (operator_yaw_rad - to_robot_rad + np.pi) % (2 * np.pi) - np.pi
        )
        return turned_rad

    def commands_at(self, stamps_ns: Int64[np.ndarray, "frames"]) -> list[MotionCommand | None]:
        """The command in force at each stamp; None where there was none, or it had run out."""
        commanded_ns = np.array([command.stamp_ns for command in self.commands], np.int64)
        latest = np.searchsorted(commanded_ns, stamps_ns, side="right") - 1
        return [
            self.commands[i] if i >= 0 and stamp_ns - self.commands[i].stamp_ns <= COMMAND_HOLDS_NS else None
            for i, stamp_ns in zip(latest.tolist(), stamps_ns.tolist(), strict=True)
        ]


def read_tracks(recording: Recording) -> Tracks:
    """All poses and commands of ``recording``: some hundred bytes a scan, where a scan has thousands.

    Raises RecordingError as ``Recording.messages`` does.
    """
    robot: list[tuple[int, Pose2D]] = []
    operator: list[tuple[int, Pose2D]] = []
    commands: list[MotionCommand] = []
    for received in recording.messages(topics=(ODOMETRY, OPERATOR_POSE, COMMAND)):
        match received.message:
            case Odometry(stamp_ns=stamp_ns, pose=pose):
                robot.append((stamp_ns, pose))
            case OperatorPose(stamp_ns=stamp_ns, pose=pose):
                operator.append((stamp_ns, pose))
            case MotionCommand() as command:
                commands.append(command)
            case _:
                pass
    return Tracks(_track(robot), _track(operator), tuple(sorted(commands, key=lambda command: command.stamp_ns)))


def _track(stamped: list[tuple[int, Pose2D]]) -> PoseTrack:
    stamped.sort(key=lambda pair: pair[0])
    poses = np.array([(pose.x_m, pose.y_m, pose.yaw_rad) for _, pose in stamped], np.float64).reshape(-1, 3).T
    poses[2] = np.unwrap(poses[2])
    return PoseTrack(np.array([stamp_ns for stamp_ns, _ in stamped], np.int64), np.ascontiguousarray(poses))
