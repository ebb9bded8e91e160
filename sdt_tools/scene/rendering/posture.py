"""From gait and gesture to a posture: legs that stride, arms that swing, rise or spread, a trunk that sways."""

import math
from typing import Final

from sdt_tools.frames import Gesture
from sdt_tools.scene.layout import LIDAR_HEIGHT_M
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
    gesture: Gesture,
    gesture_share: float,
    time_s: float,
) -> Posture:
    """The posture at one moment.

    The left shin is ``stride_m`` · sin(``gait_phase_rad``) ahead of the hips, the right one as far behind.
    ``gesture_share`` runs from 0 (arms as in idle) to 1 (gesture fully made).
    """
    thigh_to_plane_m = (
        _HIP_SHARE * person.height_m - LIDAR_HEIGHT_M
    )  # where the LiDAR meets the legs, they are as it sees them
    swing = math.atan2(stride_m, thigh_to_plane_m)
    arms = (
        _arm(person.style, True, gait_phase_rad, swing, gesture, gesture_share, time_s),
        _arm(person.style, False, gait_phase_rad, swing, gesture, gesture_share, time_s),
    )
    out = math.atan2(person.stance_m / 2 - _HIP_OUT_SHARE * person.height_m, thigh_to_plane_m)
    legs = (_leg(gait_phase_rad, swing, out), _leg(gait_phase_rad + math.pi, swing, out))
    breath = 2 * math.pi * person.style.sway_hz * time_s + person.style.sway_phase_rad
    return Posture(
        arms=arms,
        legs=legs,
        lean=(0.02 + 0.10 * swing + 0.012 * math.sin(breath), 0.016 * math.sin(0.61 * breath)),
        trunk_yaw_rad=-0.35 * swing * math.sin(gait_phase_rad) + 0.03 * math.sin(0.37 * breath),
        head_yaw_rad=0.10 * math.sin(0.53 * breath + 1.0),
        head_pitch_rad=0.04 * math.sin(0.29 * breath) + 0.04,
    )


def _leg(phase_rad: float, swing_rad: float, out_rad: float) -> LegPosture:
    """A leg that is ahead by sin(phase): straight while it carries, bent while it comes forward."""
    thigh = swing_rad * math.sin(phase_rad)
    lifting = max(0.0, math.cos(phase_rad + 0.35))
    shin = thigh - 0.05 - 1.2 * swing_rad * lifting
    # The sole lies flat ahead of the body and rolls off the toes behind it.
    foot = min(0.0, 0.8 * shin + 0.05)
    return LegPosture(thigh + 0.5 * swing_rad * lifting, shin, foot, out_rad)


def _arm(
    style: GestureStyle,
    left: bool,
    gait_phase_rad: float,
    swing_rad: float,
    gesture: Gesture,
    gesture_share: float,
    time_s: float,
) -> ArmPosture:
    side = 1.0 if left else -1.0
    sway = 2 * math.pi * style.sway_hz * time_s + style.sway_phase_rad + side
    # Arms swing against the leg of their own side.
    back = about_y(side * 0.8 * swing_rad * math.sin(gait_phase_rad) + 0.02 * math.sin(sway))
    idle = ArmPosture(
        back @ _unit(0.03, side * 0.17, -1.0),
        back @ _unit(0.20 + 0.5 * swing_rad, side * 0.05, -1.0),
        1.25,
    )
    if gesture is Gesture.ENABLE and left is style.left_handed:
        return _between(idle, _raised(style, side, sway), gesture_share)
    if gesture is Gesture.DISABLE:
        return _between(idle, _spread(style, side, sway), gesture_share)
    return idle


def _raised(style: GestureStyle, side: float, sway_rad: float) -> ArmPosture:
    up = style.raise_rad + 0.04 * math.sin(sway_rad)
    lean = style.elbow_in_rad + 0.06 * math.sin(1.7 * sway_rad)
    return ArmPosture(
        _unit(math.sin(style.forward_rad), side * math.cos(up), math.sin(up)),
        _unit(math.sin(style.forward_rad), -side * math.sin(lean), math.cos(lean)),
        0.0,
    )


def _spread(style: GestureStyle, side: float, sway_rad: float) -> ArmPosture:
    up = style.spread_rad + 0.03 * math.sin(sway_rad)
    ahead = 0.5 * math.sin(style.forward_rad)
    return ArmPosture(
        _unit(ahead, side * math.cos(up), math.sin(up)),
        _unit(ahead + 0.08, side * math.cos(up), math.sin(up) + 0.03),
        style.palm_rad,
    )


def _between(start: ArmPosture, end: ArmPosture, share: float) -> ArmPosture:
    """From ``start`` (share 0) to ``end`` (share 1) along great circles, slow at both ends."""
    share = min(1.0, max(0.0, share))
    eased = share * share * (3 - 2 * share)
    return ArmPosture(
        _slerp(start.upper, end.upper, eased),
        _slerp(start.forearm, end.forearm, eased),
        start.twist_rad + (end.twist_rad - start.twist_rad) * eased,
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
