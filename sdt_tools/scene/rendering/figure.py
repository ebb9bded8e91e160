"""The operator in the scene: his surface carried by his bones, lit, with the shade at his feet."""

import math

import numpy as np

from sdt_tools.frames import Pose2D
from sdt_tools.scene.rendering.body import build_body
from sdt_tools.scene.rendering.clothes import paint_person
from sdt_tools.scene.rendering.furniture import ring_shade
from sdt_tools.scene.rendering.light import Light
from sdt_tools.scene.rendering.mesh import Mesh, join
from sdt_tools.scene.rendering.person import Person
from sdt_tools.scene.rendering.skeleton import Bone, Posture, pose_bones, rest_joints
from sdt_tools.scene.rendering.skin import Skin, carry, join_skins
from sdt_tools.scene.rendering.texture import TextureBank

_WRAP = 0.3
"""Light of wide lamps reaches this far around a body (as a cosine) beyond the half that faces them."""
_CIRCLE = np.linspace(0, 2 * math.pi, 12, endpoint=False)


class Figure:
    """One person, ready to be put into any posture at any place."""

    def __init__(self, person: Person, bank: TextureBank, rng: np.random.Generator) -> None:
        self.person = person
        self.joints = rest_joints(person)
        self._skin = build_body(person, self.joints, paint_person(person, bank, rng))

    def stand(self, posture: Posture, place: Pose2D, light: Light, holding: Skin | None = None) -> tuple[Mesh, Mesh]:
        """The lit figure in ``posture`` at ``place``, with what he is ``holding``; and the shade under it."""
        bones = pose_bones(self.joints, posture, place)
        skin = self._skin if holding is None else join_skins([self._skin, holding])
        bare = carry(skin, bones)
        direction, strength = light.around(np.array([place.x_m, place.y_m, 0.6 * self.person.height_m]))
        facing = np.maximum((bare.normals @ direction + _WRAP) / (1 + _WRAP), 0.0)
        ambient = light.ambient_at(np.array([place.x_m, place.y_m, 1.0]))
        around = ambient * (0.85 + 0.3 * bare.normals[:, 2])
        lit = bare.lit(skin.openness * (around + strength * facing))
        feet = [
            self._shade_under(bones.rotations[foot] @ self.joints.at_m[foot] + bones.translations_m[foot], place)
            for foot in (Bone.FOOT_LEFT, Bone.FOOT_RIGHT)
        ]
        return lit, join([*feet, _disc(place.x_m, place.y_m, 0.12, 0.35, 0.75)])

    def _shade_under(self, ankle_m: np.ndarray, place: Pose2D) -> Mesh:
        ahead = 0.04 * self.person.height_m
        x = float(ankle_m[0]) + ahead * math.cos(place.yaw_rad)
        y = float(ankle_m[1]) + ahead * math.sin(place.yaw_rad)
        return _disc(x, y, 0.05, 0.12, 0.5)


def _disc(x_m: float, y_m: float, inner_m: float, reach_m: float, darkest: float) -> Mesh:
    outline = np.column_stack(
        [x_m + inner_m * np.cos(_CIRCLE), y_m + inner_m * np.sin(_CIRCLE), np.zeros_like(_CIRCLE)]
    )
    return ring_shade(outline, reach_m, darkest)
