"""The world: rigid bodies that collide, a differential drive, and the operator's legs.

Poses are in the scenario's frame; the frame "odom" of a recording is the same one.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np
import pymunk
from jaxtyping import Float64

from sdt_tools.frames import ROBOT_LENGTH_M, ROBOT_WIDTH_M, Gesture, Mode, OperatorState, Pose2D, Twist
from sdt_tools.scene.config import PHYSICS_HZ, SceneConfig
from sdt_tools.scene.drive import Drive
from sdt_tools.scene.gestures import behaviour_at, commanded_mode_at, first_mode, gesture_at, signals_at
from sdt_tools.scene.layout import GestureEvent, Layout, lidar_pose
from sdt_tools.scene.seeds import Stream, generator
from sdt_tools.scene.sight import any_visible
from sdt_tools.scene.walker import Walker

STEP_S: Final = 1.0 / PHYSICS_HZ
GESTURE_S: Final = 2.0
"""How long a gesture lasts that is asked for; scenario files have it too."""
_ROBOT: Final = 1
"""Collision type of the robot; everything else keeps pymunk's 0."""
_SLOP_M: Final = 0.001
"""How far bodies may reach into each other; pymunk's own 0.1 is meant for pixels."""
_MASS_KG: Final = 52.0
"""The P3-AT with batteries and sensors."""


class World:
    """One scene in motion. ``step`` moves it on by 1/50 s; its state is read from the attributes.

    ``robot`` is the pose of the robot's centre, ``lidar_pose`` that of its LiDAR. ``contact`` names the first thing
    that the robot touched. ``gestures`` are those planned and those asked for, in order of time. ``segments`` and
    ``circles`` are what rays can meet; the last two circles are the operator's legs. They are the world's own arrays,
    the legs' rows changing with every step: copy them to keep them.
    """

    def __init__(self, layout: Layout, config: SceneConfig | None = None) -> None:
        self.layout = layout
        self.config = SceneConfig() if config is None else config
        self.steps = 0
        self.contact: str | None = None
        self.gestures = list(layout.gestures)
        self.segments: Float64[np.ndarray, "segments 4"] = layout.segments()
        self._walker = Walker(layout)
        self._static_circles = layout.circles()
        self.circles: Float64[np.ndarray, "circles 3"] = np.vstack([self._static_circles, self._walker.legs()])
        self._drive = Drive(self.config.drive, generator(layout.seed, Stream.WHEELS))
        self.robot = layout.robot
        self.lidar_pose = lidar_pose(layout.robot)
        self._space = pymunk.Space()
        self._space.collision_slop = _SLOP_M
        self._names: dict[pymunk.Shape, str] = {}
        self._body = self._add_robot()
        self._add_static()
        self._legs = [self._add_leg(*leg) for leg in self._walker.legs()]
        self._space.on_collision(_ROBOT, 0, begin=self._note_contact)

    @property
    def time_s(self) -> float:
        """Seconds since the start."""
        return self.steps * STEP_S

    @property
    def operator(self) -> Pose2D:
        """Where the operator stands, and where he faces."""
        return self._walker.pose

    @property
    def operator_done(self) -> bool:
        """Whether he has come to the end of his path."""
        return self._walker.done

    @property
    def operator_at_end(self) -> bool:
        """Whether he stands at the last point of his path, resting there or for good."""
        return self._walker.at_end

    @property
    def operator_standing(self) -> bool:
        """Whether he stands: resting, waiting for the robot, or at the end of his path."""
        return self._walker.standing

    @property
    def legs(self) -> Float64[np.ndarray, "2 3"]:
        """His legs, left then right: x, y, radius."""
        return self.circles[-2:]

    @property
    def static_circles(self) -> Float64[np.ndarray, "posts 3"]:
        """The circles that stand still."""
        return self._static_circles

    @property
    def gesture(self) -> Gesture:
        """The gesture that he shows."""
        return self.gesture_at(self.time_s)

    @property
    def commanded_mode(self) -> Mode:
        """What he has asked the robot to be."""
        return self.commanded_mode_at(self.time_s)

    def gesture_at(self, time_s: float) -> Gesture:
        """The gesture that he shows at ``time_s``."""
        return gesture_at(self.gestures, time_s)

    def commanded_mode_at(self, time_s: float) -> Mode:
        """What he has asked the robot to be until ``time_s``."""
        return commanded_mode_at(self.gestures, time_s, first_mode(self.layout.gestures))

    def show(self, gesture: Gesture) -> None:
        """Have him show ``gesture`` from now on, for as long as people do; to be idle ends the one that he shows."""
        now_s = self.time_s
        begun = sum(one.at_s <= now_s for one in self.gestures)
        if gesture is not Gesture.IDLE:
            self.gestures.insert(begun, GestureEvent(now_s, gesture, GESTURE_S))
        elif begun and self.gesture is not Gesture.IDLE:
            shown = self.gestures[begun - 1]
            self.gestures[begun - 1] = replace(shown, lasts_s=now_s - shown.at_s)

    def operator_state(self, stamp_ns: int, time_s: float) -> OperatorState:
        """What he shows, does and has asked for at ``time_s``, stamped ``stamp_ns``."""
        does = behaviour_at(self.layout.behaviours, time_s)
        return OperatorState(stamp_ns, self.gesture_at(time_s), self.commanded_mode_at(time_s), does or "")

    @property
    def gait_phase(self) -> float:
        """Where he is in his gait, radians in [0, 2π)."""
        return self._walker.gait_phase_rad

    @property
    def gait_amplitude(self) -> float:
        """How wide he strides, from 0 (stands) to 1."""
        return self._walker.gait_amplitude

    @property
    def velocity(self) -> Twist:
        """What the robot really does."""
        return self._drive.velocity

    def operator_visible(self) -> bool:
        """Whether a straight line from the LiDAR to one of his legs meets nothing that stands still."""
        pose = self.lidar_pose
        return bool(any_visible(pose.x_m, pose.y_m, self.legs, self.segments, self._static_circles))

    def step(self, twist: Twist) -> None:
        """Move on by 1/50 s with ``twist`` commanded to the base."""
        signals = signals_at(self.gestures, self.time_s)
        self._walker.advance(self.time_s, STEP_S, self.robot, self.lidar_pose, signals)
        legs = self._walker.legs()
        for body, old, new in zip(self._legs, self.legs, legs, strict=True):
            body.velocity = ((new[0] - old[0]) / STEP_S, (new[1] - old[1]) / STEP_S)
        body = self._body
        yaw_rad = self.robot.yaw_rad
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        vx, vy = body.velocity
        velocity = self._drive.next_velocity(Twist(vx * c + vy * s, body.angular_velocity), twist, STEP_S)
        # the chord of the arc driven in this step
        middle_rad = yaw_rad + velocity.angular_radps * STEP_S / 2
        body.velocity = (velocity.linear_mps * math.cos(middle_rad), velocity.linear_mps * math.sin(middle_rad))
        body.angular_velocity = velocity.angular_radps
        self._space.step(STEP_S)
        self.circles[-2:] = legs
        x_m, y_m = body.position
        self.robot = Pose2D(x_m, y_m, math.remainder(body.angle, 2 * math.pi))
        self.lidar_pose = lidar_pose(self.robot)
        self.steps += 1

    def _add_robot(self) -> pymunk.Body:
        body = pymunk.Body(_MASS_KG, pymunk.moment_for_box(_MASS_KG, (ROBOT_LENGTH_M, ROBOT_WIDTH_M)))
        body.position = (self.robot.x_m, self.robot.y_m)
        body.angle = self.robot.yaw_rad
        shape = pymunk.Poly.create_box(body, (ROBOT_LENGTH_M, ROBOT_WIDTH_M))
        shape.collision_type = _ROBOT
        self._space.add(body, shape)
        return body

    def _add_static(self) -> None:
        ground = self._space.static_body
        layout = self.layout
        for i, wall in enumerate(layout.walls):
            self._name(pymunk.Segment(ground, (wall.x0_m, wall.y0_m), (wall.x1_m, wall.y1_m), 0.0), f"wall {i}")
        for i, box in enumerate(layout.boxes):
            self._name(pymunk.Poly(ground, [(x, y) for x, y in box.corners().tolist()]), f"box {i}")
        for i, post in enumerate(layout.posts):
            self._name(pymunk.Circle(ground, post.radius_m, (post.x_m, post.y_m)), f"post {i}")

    def _add_leg(self, x_m: float, y_m: float, radius_m: float) -> pymunk.Body:
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.position = (float(x_m), float(y_m))
        self._space.add(body)
        self._name(pymunk.Circle(body, float(radius_m)), "operator")
        return body

    def _name(self, shape: pymunk.Shape, name: str) -> None:
        shape.friction = 0.5
        self._space.add(shape)
        self._names[shape] = name

    def _note_contact(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:  # noqa: ARG002
        if self.contact is None:
            self.contact = self._names[arbiter.shapes[1]]
