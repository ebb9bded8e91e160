"""What looks like a gesture: hands where they belong, things in them, arms that stay within reach."""

import math
from dataclasses import replace

import numpy as np
import pytest
from camera_layouts import ELSEWHERE, ORIGIN, camera_of, layout, room
from test_camera_figure import joints_m, someone

from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.layout import AS_EVER, Behaviour, BehaviourEvent, Manner
from sdt_tools.scene.manners import with_manners
from sdt_tools.scene.rendering.person import Person
from sdt_tools.scene.rendering.posture import posture_of
from sdt_tools.scene.rendering.skeleton import Bone, pose_bones, rest_joints

HERE = Pose2D(0.0, 0.0, 0.0)
FACING = Pose2D(1.6, 0.0, math.pi)
HAND_M = 0.04


def places(person: Person, does: Behaviour | Gesture, manner: Manner = AS_EVER, time_s: float = 0.3) -> np.ndarray:
    """Where his joints are; then each palm, left first."""
    bones = pose_bones(rest_joints(person), posture_of(person, 0.0, 0.0, does, 1.0, time_s, manner), HERE)
    at = joints_m(person, bones)
    palms = [
        at[hand] + bones.rotations[hand] @ np.array([0.0, side * HAND_M * person.height_m, 0.0])
        for hand, side in ((Bone.HAND_LEFT, 1.0), (Bone.HAND_RIGHT, -1.0))
    ]
    return np.vstack([at, palms])


def busy_palm(person: Person, does: Behaviour, manner: Manner = AS_EVER) -> np.ndarray:
    palms = places(person, does, manner)[-2:]
    return palms[0] if person.style.left_handed != manner.other_hand else palms[1]


@pytest.mark.parametrize("seed", range(6))
def test_hands_are_where_the_behaviour_has_them(seed: int) -> None:
    person = someone(seed)
    h = person.height_m
    head = places(person, Gesture.IDLE)[Bone.HEAD]

    assert np.linalg.norm(busy_palm(person, Behaviour.PHONE_CALL) - head - (0.0, 0.0, 0.07 * h)) < 0.1 * h
    assert 0.95 * h < busy_palm(person, Behaviour.SCRATCH_HEAD)[2] < 1.06 * h
    assert busy_palm(person, Behaviour.RUB_NECK)[0] < head[0]
    assert busy_palm(person, Behaviour.POINT_AHEAD)[0] > 0.25 * h
    assert abs(busy_palm(person, Behaviour.POINT_ASIDE)[1]) > 0.3 * h
    assert busy_palm(person, Behaviour.WAVE_LOW)[2] < 0.8 * h
    left, right = places(person, Behaviour.CARRY_BOX)[-2:]
    assert 0.15 * h < left[1] - right[1] < 0.27 * h
    assert min(left[0], right[0]) > 0.1 * h


@pytest.mark.parametrize("does", Behaviour)
def test_no_manner_stretches_an_arm_and_hands_stay_out_of_the_trunk(does: Behaviour) -> None:
    events = with_manners([BehaviourEvent(0.0, does, 1.0)] * 40, np.random.default_rng(3))
    for seed, event in enumerate(events):
        person = someone(seed)
        at, rest = places(person, does, event.manner, time_s=0.17 * seed), rest_joints(person).at_m
        for inner, outer in ((Bone.UPPER_ARM_LEFT, Bone.FOREARM_LEFT), (Bone.FOREARM_RIGHT, Bone.HAND_RIGHT)):
            length = np.linalg.norm(rest[outer] - rest[inner])
            assert np.linalg.norm(at[outer] - at[inner]) == pytest.approx(length, rel=1e-6)
        for palm in at[-2:]:
            in_trunk = 0.55 < palm[2] / person.height_m < 0.8
            assert not in_trunk or np.hypot(palm[0], 0.6 * palm[1]) > 0.045 * person.height_m


def test_no_behaviour_spreads_both_arms_as_disable_does() -> None:
    scene = layout(room())
    camera = camera_of(scene)

    def width(does: Gesture | Behaviour) -> int:
        seen = camera.depth(ORIGIN, FACING, gesture=does) < camera.depth(ORIGIN, ELSEWHERE) - 0.1
        return int(np.ptp(np.flatnonzero(seen.any(axis=0))))

    widest = max(width(does) for does in Behaviour)

    assert widest < 0.8 * width(Gesture.DISABLE)


def test_a_carried_box_is_seen_and_empty_hands_hold_nothing() -> None:
    carries = replace(layout(room()), behaviours=(BehaviourEvent(0.0, Behaviour.CARRY_BOX, 5.0),))
    with_box, without = SceneCamera(carries), camera_of(layout(room()))

    def nearer(does: Behaviour, share: float) -> int:
        depths = [camera.depth(ORIGIN, FACING, gesture=does, gesture_phase=share) for camera in (with_box, without)]
        return int((depths[0] < depths[1] - 0.02).sum())

    assert nearer(Behaviour.CARRY_BOX, 1.0) > 1500
    assert nearer(Behaviour.CARRY_BOX, 0.1) == 0
    assert nearer(Behaviour.FOLD_ARMS, 1.0) == 0
