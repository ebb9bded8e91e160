"""What hands do that is no gesture: scratching, a phone, pointing, carrying; where they are, and the head with them.

Places are shares of the person's height in the chest's axes (x ahead, y out to the arm's side, z up from the floor).
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sdt_tools.scene.layout import Behaviour, Manner
from sdt_tools.scene.rendering.mesh import Vector, vector
from sdt_tools.scene.rendering.person import Person
from sdt_tools.scene.rendering.skeleton import ArmPosture

_UPPER: Final = 0.178
_TO_PALM: Final = 0.186
"""Lengths of the upper arm, and of the forearm with half the hand."""
_SHOULDER_UP: Final = 0.793
_SHOULDER_OUT: Final = 0.106

_ELBOW_DOWN: Final = (-0.1, 0.45, -1.0)
_ELBOW_OUT: Final = (0.25, 1.0, 0.15)


@dataclass(frozen=True, eq=False)
class Doing:
    """The arms (None: as in idle), left first, and how far the head is turned with them."""

    arms: tuple[ArmPosture | None, ArmPosture | None]
    head_pitch_rad: float = 0.0
    head_yaw_rad: float = 0.0


def doing(person: Person, does: Behaviour, manner: Manner, time_s: float) -> Doing:
    """How ``person`` holds himself while he ``does`` that, his hand moving with time where it does."""
    left = person.style.left_handed != manner.other_hand  # what takes one hand is done with the stronger one
    beat = 2 * math.pi * 1.8 * time_s + manner.phase_rad
    if does in _ONE_HANDED:
        arm = _one_arm(person, does, manner, 1.0 if left else -1.0, beat)
        pitch, yaw = _HEAD.get(does, (0.0, 0.0))
        turned = yaw if left else -yaw
        return Doing((arm, None) if left else (None, arm), pitch, turned)
    arms = (_of_two(person, does, manner, 1.0, beat), _of_two(person, does, manner, -1.0, beat))
    pitch, _ = _HEAD.get(does, (0.0, 0.0))
    return Doing(arms, pitch)


_ONE_HANDED: Final = frozenset(
    {
        Behaviour.SCRATCH_HEAD,
        Behaviour.RUB_NECK,
        Behaviour.TOUCH_FACE,
        Behaviour.DRINK,
        Behaviour.PHONE_CALL,
        Behaviour.POINT_AHEAD,
        Behaviour.POINT_ASIDE,
        Behaviour.WAVE_LOW,
    }
)
_HEAD: Final = {
    Behaviour.SCRATCH_HEAD: (0.12, 0.0),
    Behaviour.RUB_NECK: (0.18, -0.15),
    Behaviour.PHONE_CALL: (0.05, 0.2),
    Behaviour.PHONE_TEXT: (0.45, 0.0),
    Behaviour.POINT_ASIDE: (0.0, 0.6),
    Behaviour.DRINK: (-0.12, 0.0),
    Behaviour.CARRY_BOX: (0.12, 0.0),
}
"""Pitch down, and yaw towards the hand's side."""


def _one_arm(person: Person, does: Behaviour, manner: Manner, side: float, beat_rad: float) -> ArmPosture:
    up, ahead = 0.05 * manner.raise_rad, 0.05 * manner.forward_rad
    wave = math.sin(beat_rad)
    if does is Behaviour.SCRATCH_HEAD:
        return _reach(person, side, (ahead + 0.012 * wave, 0.045 + up, 1.0 + up), _ELBOW_OUT, 0.9)
    if does is Behaviour.RUB_NECK:
        return _reach(person, side, (-0.055, 0.02 + 0.012 * wave, 0.875 + up), (0.4, 1.0, 0.35), 0.6)
    if does is Behaviour.TOUCH_FACE:
        return _reach(person, side, (0.085 + ahead, 0.012, 0.885 + up + 0.004 * wave), _ELBOW_DOWN, 0.3)
    if does is Behaviour.PHONE_CALL:
        return _reach(person, side, (0.012 + ahead, 0.068, 0.92 + up), (0.35, 0.6, -1.0), 1.0)
    if does is Behaviour.DRINK:
        lifted = 0.5 + 0.5 * math.sin(0.15 * beat_rad)
        place = (0.17 - 0.07 * lifted, 0.05 - 0.03 * lifted, 0.74 + 0.13 * lifted + up)
        return _reach(person, side, place, _ELBOW_DOWN, 0.9)
    if does is Behaviour.WAVE_LOW:
        height = 0.66 + 0.5 * manner.raise_rad
        return _reach(person, side, (0.17, 0.20 + 0.045 * wave, min(0.76, max(0.56, height))), _ELBOW_DOWN, 0.2)
    aside = 0.3 * manner.elbow_rad / 0.11 if does is Behaviour.POINT_AHEAD else 1.15 + manner.forward_rad
    rise = (-0.12 if does is Behaviour.POINT_AHEAD else -0.02) + 0.9 * manner.raise_rad
    direction = _unit(math.cos(aside) * math.cos(rise), side * math.sin(aside) * math.cos(rise), math.sin(rise))
    bent = _unit(float(direction[0]) + 0.08, float(direction[1]), float(direction[2]) + 0.06)
    return ArmPosture(direction, bent, 1.1)


def _of_two(person: Person, does: Behaviour, manner: Manner, side: float, beat_rad: float) -> ArmPosture:
    up, ahead = 0.05 * manner.raise_rad, 0.05 * manner.forward_rad
    if does is Behaviour.PHONE_TEXT:
        return _reach(person, side, (0.19 + ahead, 0.025, 0.72 + up), (-0.2, 1.0, -1.0), 0.6)
    if does is Behaviour.CARRY_BOX:
        return _reach(person, side, (0.17, 0.105, 0.655), (-0.4, 0.8, -1.0), 0.4)
    if does is Behaviour.FOLD_ARMS:
        over = side * (1.0 if manner.other_hand else -1.0)
        return _reach(person, side, (0.095 + 0.018 * over, -0.055, 0.705 + 0.012 * over + up), (0.2, 1.0, -0.9), 0.9)
    if does is Behaviour.HANDS_ON_HIPS:
        return _reach(person, side, (0.03 + ahead, 0.115, 0.585 + up), (-0.3 + ahead, 1.0, 0.15), 0.9)
    lifted = 0.02 * math.sin(0.5 * beat_rad) + 0.2 * side * 0.1 * manner.uneven_rad
    return _reach(person, side, (0.11 + ahead, 0.29, 0.70 + up + lifted), (-0.3, 0.25, -1.0), -0.9)


def _reach(
    person: Person,
    side: float,
    palm: tuple[float, float, float],
    elbow: tuple[float, float, float],
    twist_rad: float,
) -> ArmPosture:
    """The arm whose palm is at ``palm``, or as near as it reaches, its elbow towards ``elbow`` (law of cosines)."""
    way = vector(palm[0], side * (palm[1] - _SHOULDER_OUT * person.shoulders), palm[2] - _SHOULDER_UP)
    length = float(np.linalg.norm(way))
    reach = min(max(length, abs(_TO_PALM - _UPPER) + 0.02), _UPPER + _TO_PALM - 0.004)
    towards = way / max(length, 1e-9)
    hint = vector(elbow[0], side * elbow[1], elbow[2])
    across = hint - towards * float(hint @ towards)
    across /= max(float(np.linalg.norm(across)), 1e-9)
    cosine = (_UPPER**2 + reach**2 - _TO_PALM**2) / (2 * _UPPER * reach)
    sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
    upper: Vector = towards * cosine + across * sine
    forearm: Vector = (towards * reach - upper * _UPPER) / _TO_PALM
    return ArmPosture(_unit(*upper.tolist()), _unit(*forearm.tolist()), twist_rad)


def _unit(x: float, y: float, z: float) -> Vector:
    length = math.sqrt(x * x + y * y + z * z)
    return vector(x / length, y / length, z / length)
