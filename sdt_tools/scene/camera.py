"""The robot's camera in the scene: one picture for each state of the world, the same bytes for the same state."""

from typing import Final

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.layout import AS_EVER, Behaviour, Layout, Manner
from sdt_tools.scene.rendering.figure import Figure
from sdt_tools.scene.rendering.furniture import build_furniture
from sdt_tools.scene.rendering.light import light_over, roof_over
from sdt_tools.scene.rendering.mesh import join
from sdt_tools.scene.rendering.person import draw_person
from sdt_tools.scene.rendering.photometry import take_picture
from sdt_tools.scene.rendering.posture import posture_of
from sdt_tools.scene.rendering.projection import CameraMount, Pinhole, view_from
from sdt_tools.scene.rendering.props import HANDY, build_props
from sdt_tools.scene.rendering.raster import draw
from sdt_tools.scene.rendering.room import build_room
from sdt_tools.scene.rendering.shadow import shadow_of
from sdt_tools.scene.rendering.skyline import build_skyline
from sdt_tools.scene.rendering.texture import TextureBank
from sdt_tools.scene.rendering.video import VideoCamera, draw_style
from sdt_tools.scene.seeds import Stream, generator

_FRAMES: Final = 1_000_003
"""More frames than one recording has, so that no two seeds share their noise."""

_HEIGHTS_M: Final[dict[str | None, tuple[float, float]]] = {"outdoor": (0.9, 2.4), "garage": (2.1, 2.7)}
"""Of the walls where they carry no ceiling of a room: fences, and garages."""
_IN_HAND: Final = 0.15
"""How far into a behaviour what belongs to it is in the hand: taken out of a pocket, picked up."""

# One frame runs on one thread; more would fight over the cores with the other processes.
cv2.setNumThreads(1)


class SceneCamera:
    """Sees ``layout`` from the robot. The person, the room and its colours follow from ``seed``.

    ``seed`` and ``light`` default to the layout's own. ``calibration`` is the lens, ``mount`` its place on the base.
    It holds the buffers of one picture: share it between no threads. Raises ConfigError for an unknown light.
    """

    def __init__(self, layout: Layout, seed: int | None = None, light: str | None = None) -> None:
        self.calibration = Pinhole()
        self.mount = CameraMount()
        self._seed = layout.seed if seed is None else seed
        of_room, of_person, of_light = generator(self._seed, Stream.CAMERA).spawn(3)
        bounds = _bounds_m(layout)
        ceiling_m = float(of_room.uniform(2.5, 3.6))
        roof = roof_over(layout.walls) if layout.surroundings == "garage" and layout.walls else None
        name = layout.light if light is None else light
        self._light = light_over(name, bounds, ceiling_m, of_light, layout.sun, roof)
        height_m = ceiling_m
        if layout.surroundings in _HEIGHTS_M:
            height_m = float(of_light.uniform(*_HEIGHTS_M[layout.surroundings]))
        bank = TextureBank()
        room, room_rims = build_room(layout.walls, bounds, height_m, self._light, bank, of_room)
        if layout.surroundings in _HEIGHTS_M:
            room = join([room, build_skyline(bounds, self._light, bank, of_light)])
        furniture, furniture_rims = build_furniture(layout.boxes, layout.posts, self._light, bank, of_room)
        plan = layout.operator
        person = draw_person(of_person, plan.leg_separation_m, plan.leg_radius_m, layout.mask)
        self._step_m = plan.step_length_m
        self._figure = Figure(person, bank, of_person)
        holds = any(event.does in HANDY for event in layout.behaviours)
        self._props = build_props(person, self._figure.joints, bank, of_person) if holds else {}
        self._solids = join([furniture, room])
        self._rims = join([room_rims, furniture_rims])
        self._video = None
        if layout.camera == "video":
            self._video = VideoCamera(draw_style(not self._light.kind.outdoors, of_light), self.calibration)
            if roof is None:
                self._rims = join([self._rims, shadow_of(furniture.points_m, furniture.triangles, self._light)])
        self._textures = bank.pack()
        shape = (self.calibration.height, self.calibration.width)
        self._radiance = np.zeros((*shape, 3), np.float32)
        self._inverse_depth = np.zeros(shape, np.float32)

    def render(
        self,
        robot: Pose2D,
        operator: Pose2D,
        gait_phase: float = 0.0,
        gait_amplitude: float = 0.0,
        gesture: Gesture | Behaviour = Gesture.IDLE,
        gesture_phase: float = 1.0,
        time_s: float = 0.0,
        frame: int = 0,
        manner: Manner = AS_EVER,
        turn_radps: float = 0.0,
    ) -> UInt8[np.ndarray, "480 640 3"]:
        """The picture (blue, green, red) from a robot whose centre is at ``robot``.

        ``gait_phase`` in radians and ``gait_amplitude`` (0 to 1) are the walker's; ``gesture_phase`` runs from 0, arms
        down, to 1, gesture or behaviour made, in its ``manner``; ``time_s`` is for the small movements of one who
        stands; ``frame`` for the noise. A video camera also sees that it turns, and at what ``time_s``: its exposure is
        on the way from its last picture's; one that goes back in time begins anew.
        """
        self._draw(robot, operator, gait_phase, gait_amplitude, gesture, gesture_phase, time_s, manner)
        noise_key = (self._seed * _FRAMES + frame) % 2**63
        if self._video is None:
            return take_picture(self._radiance, self._light.kind, noise_key)
        view = view_from(robot, self.mount)
        buffers = (self._radiance, self._inverse_depth)
        return self._video.take(*buffers, self._light, view, turn_radps, time_s, noise_key)

    def depth(
        self,
        robot: Pose2D,
        operator: Pose2D,
        gait_phase: float = 0.0,
        gait_amplitude: float = 0.0,
        gesture: Gesture | Behaviour = Gesture.IDLE,
        gesture_phase: float = 1.0,
        time_s: float = 0.0,
        manner: Manner = AS_EVER,
    ) -> Float32[np.ndarray, "480 640"]:
        """Distance along the optical axis of what each pixel of ``render`` shows, metres; infinite for nothing.

        What hangs on walls or under the ceiling is 0.4 % nearer than these.
        """
        self._draw(robot, operator, gait_phase, gait_amplitude, gesture, gesture_phase, time_s, manner)
        with np.errstate(divide="ignore"):
            return np.float32(1.0) / self._inverse_depth

    def _draw(
        self,
        robot: Pose2D,
        operator: Pose2D,
        gait_phase: float,
        gait_amplitude: float,
        gesture: Gesture | Behaviour,
        gesture_phase: float,
        time_s: float,
        manner: Manner,
    ) -> None:
        """Fill the buffers: what is near first, so that little is painted twice."""
        stride_m = gait_amplitude * self._step_m / 2
        person = self._figure.person
        posture = posture_of(person, gait_phase, stride_m, gesture, gesture_phase, time_s, manner)
        holding = None
        if isinstance(gesture, Behaviour) and gesture_phase > _IN_HAND:
            holding = self._props.get((gesture, person.style.left_handed != manner.other_hand))
        figure, shade = self._figure.stand(posture, operator, self._light, holding)
        view = view_from(robot, self.mount)
        self._radiance[:] = 0.0
        self._inverse_depth[:] = 0.0
        meshes = [figure, self._solids, self._rims, shade]
        roof = self._light.roof
        if self._video is not None and not (roof is not None and roof.covers(operator.x_m, operator.y_m)):
            meshes.append(shadow_of(figure.points_m, figure.triangles, self._light))
        for mesh in meshes:
            draw(mesh, self._textures, view, self.calibration, self._radiance, self._inverse_depth)


def _bounds_m(layout: Layout) -> Float64[np.ndarray, "4"]:
    """x0, y0, x1, y1 around everything in ``layout``."""
    points = np.concatenate(
        [
            layout.segments().reshape(-1, 2),
            layout.circles()[:, :2],
            np.array(layout.operator.path_m),
            np.array([(layout.robot.x_m, layout.robot.y_m)]),
        ]
    )
    return np.concatenate([points.min(axis=0), points.max(axis=0)])
