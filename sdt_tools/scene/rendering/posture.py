"""From gait and gesture to a posture: legs that stride, arms that swing, rise or spread, a trunk that sways."""

import math
from typing import Final

from sdt_tools.frames import Gesture
from sdt_tools.scene.layout import AS_EVER, LIDAR_HEIGHT_M, Behaviour, Manner
from sdt_tools.scene.rendering.behaviours import Doing, doing
from sdt_tools.scene.rendering.mesh import Vector, vector
from sdt_tools.scene.rendering.person import GestureStyle, Person
from sdt_tools.scene.rendering.skeleton import ArmPosture, LegPosture, Posture, about_y

_HIP_SHARE: Final = 0.52
"""Height of the hip joint, as a share of the person's height; and how far out it is."""
_HIP_OUT_SHARE: Final = 0.05


def posture_of(
    person: Person,
    gait_phase_rad: float,
    stride_m: float,
    makes: Gesture | Behaviour,
    share: float,
    time_s: float,
    manner: Manner = AS_EVER,
) -> Posture:
    """The posture at one moment.

    The left shin is ``stride_m`` · sin(``gait_phase_rad``) ahead of the hips, the right one as far behind.
    ``share`` runs from 0 (arms as in idle) to 1 (what he ``makes`` of them is fully made).
    """
    thigh_to_plane_m = (
        _HIP_SHARE * person.height_m - LIDAR_HEIGHT_M
    )  # where the LiDAR meets the legs, they are as it sees them
    swing = math.atan2(stride_m, thigh_to_plane_m)
    does = Doing((None, None)) if isinstance(makes, Gesture) else doing(person, makes, manner, time_s)
    style, eased = person.style, _eased(share)
    sways = tuple(2 * math.pi * style.sway_hz * time_s + style.sway_phase_rad + side for side in (1.0, -1.0))
    goals = does.arms if isinstance(makes, Behaviour) else _gestured(style, makes, manner, sways)
    arms = tuple(
        _between(_idle(side, sway, gait_phase_rad, swing), goal, eased)
        for side, sway, goal in zip((1.0, -1.0), sways, goals, strict=True)
    )
    out = math.atan2(person.stance_m / 2 - _HIP_OUT_SHARE * person.height_m, thigh_to_plane_m)
    legs = (_leg(gait_phase_rad, swing, out), _leg(gait_phase_rad + math.pi, swing, out))
    breath = 2 * math.pi * person.style.sway_hz * time_s + person.style.sway_phase_rad
    return Posture(
        arms=(arms[0], arms[1]),
        legs=legs,
        lean=(0.02 + 0.10 * swing + 0.012 * math.sin(breath), 0.016 * math.sin(0.61 * breath)),
        trunk_yaw_rad=-0.35 * swing * math.sin(gait_phase_rad) + 0.03 * math.sin(0.37 * breath),
        head_yaw_rad=0.10 * math.sin(0.53 * breath + 1.0) + eased * does.head_yaw_rad,
        head_pitch_rad=0.04 * math.sin(0.29 * breath) + 0.04 + eased * does.head_pitch_rad,
    )


def _leg(phase_rad: float, swing_rad: float, out_rad: float) -> LegPosture:
    """A leg that is ahead by sin(phase): straight while it carries, bent while it comes forward."""
    thigh = swing_rad * math.sin(phase_rad)
    lifting = max(0.0, math.cos(phase_rad + 0.35))
    shin = thigh - 0.05 - 1.2 * swing_rad * lifting
    # The sole lies flat ahead of the body and rolls off the toes behind it.
    foot = min(0.0, 0.8 * shin + 0.05)
    return LegPosture(thigh + 0.5 * swing_rad * lifting, shin, foot, out_rad)


def _idle(side: float, sway_rad: float, gait_phase_rad: float, swing_rad: float) -> ArmPosture:
    """An arm that hangs, and swings against the leg of its own side."""
    back = about_y(side * 0.8 * swing_rad * math.sin(gait_phase_rad) + 0.02 * math.sin(sway_rad))
    return ArmPosture(
        back @ _unit(0.03, side * 0.17, -1.0),
        back @ _unit(0.20 + 0.5 * swing_rad, side * 0.05, -1.0),
        1.25,
    )


def _gestured(
    style: GestureStyle, gesture: Gesture, manner: Manner, sways: tuple[float, ...]
) -> tuple[ArmPosture | None, ArmPosture | None]:
    """The arms in ``gesture``, left first; None for one that hangs."""
    if gesture is Gesture.DISABLE:
        return _spread(style, manner, 1.0, sways[0]), _spread(style, manner, -1.0, sways[1])
    if gesture is Gesture.ENABLE and style.left_handed != manner.other_hand:
        return _raised(style, manner, 1.0, sways[0]), None
    return None, _raised(style, manner, -1.0, sways[1]) if gesture is Gesture.ENABLE else None


def _raised(style: GestureStyle, manner: Manner, side: float, sway_rad: float) -> ArmPosture:
    up = style.raise_rad + manner.raise_rad + 0.04 * math.sin(sway_rad)
    lean = style.elbow_in_rad + manner.elbow_rad + 0.06 * math.sin(1.7 * sway_rad)
    ahead = style.forward_rad + manner.forward_rad
    return ArmPosture(
        _unit(math.sin(ahead), side * math.cos(up), math.sin(up)),
        _unit(math.sin(ahead), -side * math.sin(lean), math.cos(lean)),
        0.0,
    )


def _spread(style: GestureStyle, manner: Manner, side: float, sway_rad: float) -> ArmPosture:
    up = style.spread_rad + manner.spread_rad + side * manner.uneven_rad / 2 + 0.03 * math.sin(sway_rad)
    ahead = 0.5 * math.sin(style.forward_rad + manner.forward_rad)
    return ArmPosture(
        _unit(ahead, side * math.cos(up), math.sin(up)),
        _unit(ahead + 0.08, side * math.cos(up), math.sin(up) + 0.03),
        style.palm_rad,
    )


def _eased(share: float) -> float:
    """``share`` within 0 and 1, slow at both ends."""
    share = min(1.0, max(0.0, share))
    return share * share * (3 - 2 * share)


def _between(start: ArmPosture, end: ArmPosture | None, share: float) -> ArmPosture:
    """From ``start`` (share 0) to ``end`` (share 1) along great circles; all of ``start`` where there is no end."""
    if end is None:
        return start
    return ArmPosture(
        _slerp(start.upper, end.upper, share),
        _slerp(start.forearm, end.forearm, share),
        start.twist_rad + (end.twist_rad - start.twist_rad) * share,
    )


def _slerp(start: Vector, end: Vector, share: float) -> Vector:
    angle = math.acos(max(-1.0, min(1.0, float(start @ end))))
    if angle < 1e-6:
        return end
    mixed: Vector = (math.sin((1 - share) * angle) * start + math.sin(share * angle) * end) / math.sin(angle)
    return _unit(*mixed.tolist())


def _unit(x: float, y: float, z: float) -> Vector:
    length = math.sqrt(x * x + y * y + z * z)
    return vector(x / length, y / length, z / length)
