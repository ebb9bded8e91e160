"""The camera at work in a world: its place, its lens, its pictures in time."""

import math
from collections.abc import Iterator

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import (
    FRAME_BASE,
    FRAME_CAMERA,
    CameraCalibration,
    FrameTransform,
    Message,
    Pose2D,
    RawPicture,
)
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.gestures import arms_at
from sdt_tools.scene.world import STEP_S, World


class SceneFilm:
    """Films ``world`` from ``start_ns`` on. Implements ``source.Film``."""

    def __init__(self, world: World, start_ns: int) -> None:
        self._world = world
        self._start_ns = start_ns
        self._camera = SceneCamera(world.layout)
        self._taken = 0

    def introduction(self) -> Iterator[Message]:
        """Where the camera is, and its lens."""
        mount, lens = self._camera.mount, self._camera.calibration
        yield FrameTransform(self._start_ns, FRAME_BASE, FRAME_CAMERA, mount.translation_m, mount.rotation_xyzw)
        yield CameraCalibration(self._start_ns, lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy)

    def pictures(self, now_ns: int, robot_before: Pose2D, operator_before: Pose2D) -> Iterator[Message | RawPicture]:
        """The pictures due up to ``now_ns``, each from the robot's place at its stamp; and the gesture."""
        world = self._world
        period_ns = SECOND_NS / world.config.rates.image_hz
        while (stamp_ns := self._start_ns + round(self._taken * period_ns)) <= now_ns:
            share = 1.0 - (now_ns - stamp_ns) / (STEP_S * SECOND_NS)
            time_s = (stamp_ns - self._start_ns) / SECOND_NS
            arms = arms_at(world.gestures, world.layout.behaviours, time_s)
            picture = self._camera.render(
                between(robot_before, world.robot, share),
                between(operator_before, world.operator, share),
                world.gait_phase,
                world.gait_amplitude,
                arms.makes,
                arms.share,
                time_s,
                self._taken,
                arms.manner,
                math.remainder(world.robot.yaw_rad - robot_before.yaw_rad, 2 * math.pi) / STEP_S,
            )
            self._taken += 1
            yield RawPicture(stamp_ns, stamp_ns, picture)
            yield world.operator_state(stamp_ns, time_s)


def between(before: Pose2D, after: Pose2D, share: float) -> Pose2D:
    """The pose at ``share`` of the way from ``before`` to ``after``, turning the shorter way."""
    turn_rad = math.remainder(after.yaw_rad - before.yaw_rad, 2 * math.pi)
    return Pose2D(
        before.x_m + share * (after.x_m - before.x_m),
        before.y_m + share * (after.y_m - before.y_m),
        math.remainder(before.yaw_rad + share * turn_rad, 2 * math.pi),
    )
