"""The operator's bones: where they are when he stands with his arms spread, and how a posture turns them.

Body axes: x ahead, y left, z up, the origin on the floor between the feet.
"""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float64

from sdt_tools.frames import Pose2D
from sdt_tools.scene.rendering.mesh import Vector
from sdt_tools.scene.rendering.person import Person

Rotation = Float64[np.ndarray, "3 3"]


class Bone(IntEnum):
    """All bones; the left ones of a pair come first."""

    PELVIS = 0
    CHEST = 1
    HEAD = 2
    UPPER_ARM_LEFT = 3
    UPPER_ARM_RIGHT = 4
    FOREARM_LEFT = 5
    FOREARM_RIGHT = 6
    HAND_LEFT = 7
    HAND_RIGHT = 8
    THIGH_LEFT = 9
    THIGH_RIGHT = 10
    SHIN_LEFT = 11
    SHIN_RIGHT = 12
    FOOT_LEFT = 13
    FOOT_RIGHT = 14


@dataclass(frozen=True, eq=False)
class Joints:
    """Where each bone turns, in the rest posture: upright, arms spread, palms ahead, thumbs up, legs straight."""

    at_m: Float64[np.ndarray, "bones 3"]


def rest_joints(person: Person) -> Joints:
    """The joints of ``person``. Shares of the height after Drillis and Contini (1966)."""
    height = person.height_m
    at = np.zeros((len(Bone), 3))
    at[Bone.PELVIS] = (0, 0, 0.53)
    at[Bone.CHEST] = (0, 0, 0.61)
    at[Bone.HEAD] = (0, 0, 0.845)
    shoulder = 0.106 * person.shoulders
    for left, right, side_share, z in (
        (Bone.UPPER_ARM_LEFT, Bone.UPPER_ARM_RIGHT, shoulder, 0.793),
        (Bone.FOREARM_LEFT, Bone.FOREARM_RIGHT, shoulder + 0.178, 0.793),
        (Bone.HAND_LEFT, Bone.HAND_RIGHT, shoulder + 0.178 + 0.148, 0.793),
        (Bone.THIGH_LEFT, Bone.THIGH_RIGHT, 0.050, 0.52),
        (Bone.SHIN_LEFT, Bone.SHIN_RIGHT, 0.050, 0.283),
        (Bone.FOOT_LEFT, Bone.FOOT_RIGHT, 0.050, 0.042),
    ):
        at[left], at[right] = (0, side_share, z), (0, -side_share, z)
    return Joints(at * height)


@dataclass(frozen=True, eq=False)
class ArmPosture:
    """One arm, in the chest's axes: unit directions of its two halves, and how far the palm turns inwards or down."""

    upper: Vector
    forearm: Vector
    twist_rad: float


@dataclass(frozen=True, eq=False)
class LegPosture:
    """One leg: thigh and shin ahead of straight down, the foot's pitch (toes up), and the leg's lean outwards."""

    thigh_rad: float
    shin_rad: float
    foot_rad: float
    out_rad: float


@dataclass(frozen=True, eq=False)
class Posture:
    """A whole body. Left limbs first."""

    arms: tuple[ArmPosture, ArmPosture]
    legs: tuple[LegPosture, LegPosture]
    lean: tuple[float, float]
    """Of the trunk: ahead, and to the left; radians."""
    trunk_yaw_rad: float
    head_yaw_rad: float
    head_pitch_rad: float


@dataclass(frozen=True, eq=False)
class BonePoses:
    """How each bone carries the points that are fixed to it: world = rotation · rest + translation."""

    rotations: Float64[np.ndarray, "bones 3 3"]
    translations_m: Float64[np.ndarray, "bones 3"]


def about_x(angle_rad: float) -> Rotation:
    """The turn about x (left to up)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def about_y(angle_rad: float) -> Rotation:
    """The turn about y (up to ahead)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def about_z(angle_rad: float) -> Rotation:
    """The turn about z (ahead to left)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def shortest_turn(start: Vector, end: Vector) -> Rotation:
    """The smallest rotation that carries unit vector ``start`` to unit vector ``end`` (not its opposite)."""
    axis, cosine = np.cross(start, end), float(start @ end)
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Rotation = np.eye(3) + skew + skew @ skew / max(1.0 + cosine, 1e-9)
    return turn


def pose_bones(joints: Joints, posture: Posture, place: Pose2D) -> BonePoses:
    """The bones of a body in ``posture`` that stands at ``place``, its lower foot on the floor."""
    rotations = np.empty((len(Bone), 3, 3))
    at = np.empty((len(Bone), 3))
    rest = joints.at_m

    def hang(bone: Bone, parent: Bone, rotation: Rotation) -> None:
        at[bone] = at[parent] + rotations[parent] @ (rest[bone] - rest[parent])
        rotations[bone] = rotation

    rotations[Bone.PELVIS], at[Bone.PELVIS] = np.eye(3), rest[Bone.PELVIS]
    ahead, left = posture.lean
    trunk = about_z(posture.trunk_yaw_rad) @ about_y(ahead) @ about_x(-left)
    hang(Bone.CHEST, Bone.PELVIS, trunk)
    hang(Bone.HEAD, Bone.CHEST, about_z(posture.head_yaw_rad) @ about_y(posture.head_pitch_rad))
    for side, (arm, leg) in enumerate(zip(posture.arms, posture.legs, strict=True)):
        outwards = np.array([0.0, 1.0 - 2.0 * side, 0.0])
        upper_local = shortest_turn(outwards, arm.upper)
        fore_local = shortest_turn(upper_local @ outwards, arm.forearm) @ upper_local
        # The palm turns about the forearm; half of it already in the forearm, as radius and ulna do.
        turn = about_y(arm.twist_rad)
        half = about_y(arm.twist_rad / 2)
        hang(Bone(Bone.UPPER_ARM_LEFT + side), Bone.CHEST, trunk @ upper_local)
        hang(Bone(Bone.FOREARM_LEFT + side), Bone(Bone.UPPER_ARM_LEFT + side), trunk @ fore_local @ half)
        hang(Bone(Bone.HAND_LEFT + side), Bone(Bone.FOREARM_LEFT + side), trunk @ fore_local @ turn)
        lean_out = about_x(leg.out_rad * (1 - 2 * side))
        hang(Bone(Bone.THIGH_LEFT + side), Bone.PELVIS, lean_out @ about_y(-leg.thigh_rad))
        hang(Bone(Bone.SHIN_LEFT + side), Bone(Bone.THIGH_LEFT + side), lean_out @ about_y(-leg.shin_rad))
        hang(Bone(Bone.FOOT_LEFT + side), Bone(Bone.SHIN_LEFT + side), about_y(-leg.foot_rad))
    body = BonePoses(rotations, at - np.einsum("bij,bj->bi", rotations, rest))
    return _stand(body, joints, place)


def _stand(body: BonePoses, joints: Joints, place: Pose2D) -> BonePoses:
    """``body`` with its lowest sole on the floor, turned and carried to ``place``."""
    height = float(joints.at_m[Bone.HEAD, 2]) / 0.845
    lowest = math.inf
    for foot in (Bone.FOOT_LEFT, Bone.FOOT_RIGHT):
        x, y, _ = joints.at_m[foot]
        for along in (-0.05, 0.10):
            sole = body.rotations[foot] @ np.array([x + along * height, y, 0.0]) + body.translations_m[foot]
            lowest = min(lowest, float(sole[2]))
    turn = about_z(place.yaw_rad)
    shifted = body.translations_m - (0.0, 0.0, lowest)
    return BonePoses(turn @ body.rotations, shifted @ turn.T + (place.x_m, place.y_m, 0.0))
