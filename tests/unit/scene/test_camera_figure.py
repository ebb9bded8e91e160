"""The operator's body: bones that keep their lengths, feet on the floor, hands where the gesture wants them."""

import math

import numpy as np
import pytest
from jaxtyping import Float64

from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.rendering.person import Person, draw_person
from sdt_tools.scene.rendering.posture import posture_of
from sdt_tools.scene.rendering.skeleton import Bone, BonePoses, pose_bones, rest_joints

HERE = Pose2D(0.0, 0.0, 0.0)


def someone(seed: int) -> Person:
    return draw_person(np.random.default_rng(seed), stance_m=0.24, leg_radius_m=0.06)


def joints_m(person: Person, bones: BonePoses) -> Float64[np.ndarray, "bones 3"]:
    return np.einsum("bij,bj->bi", bones.rotations, rest_joints(person).at_m) + bones.translations_m


def moved(
    person: Person, phase: float = 0.0, stride_m: float = 0.0, gesture: Gesture = Gesture.IDLE, place: Pose2D = HERE
) -> BonePoses:
    return pose_bones(rest_joints(person), posture_of(person, phase, stride_m, gesture, 1.0, 0.3), place)


@pytest.mark.parametrize("gesture", Gesture)
@pytest.mark.parametrize("phase", [0.0, 1.1, 2.9, 4.6])
def test_bones_turn_but_do_not_stretch(gesture: Gesture, phase: float) -> None:
    person = someone(3)
    bones = moved(person, phase, 0.25, gesture)

    assert np.allclose(bones.rotations @ bones.rotations.transpose(0, 2, 1), np.eye(3), atol=1e-9)
    assert np.allclose(np.linalg.det(bones.rotations), 1.0)
    before, after = rest_joints(person).at_m, joints_m(person, bones)
    for inner, outer in (
        (Bone.UPPER_ARM_LEFT, Bone.FOREARM_LEFT),
        (Bone.FOREARM_LEFT, Bone.HAND_LEFT),
        (Bone.SHIN_RIGHT, Bone.FOOT_RIGHT),
    ):
        assert np.linalg.norm(after[outer] - after[inner]) == pytest.approx(
            np.linalg.norm(before[outer] - before[inner])
        )


@pytest.mark.parametrize("phase", np.linspace(0, 2 * math.pi, 7)[:-1])
def test_one_foot_is_always_on_the_floor_and_none_below_it(phase: float) -> None:
    person = someone(5)
    bones = moved(person, float(phase), 0.2)

    alongs = np.linspace(-0.05, 0.10, 4) * person.height_m
    soles = [
        float((bones.rotations[foot] @ (rest_joints(person).at_m[foot] * (1, 1, 0) + (along, 0.0, 0.0)))[2])
        + float(bones.translations_m[foot, 2])
        for foot in (Bone.FOOT_LEFT, Bone.FOOT_RIGHT)
        for along in alongs
    ]
    assert min(soles) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_hands_are_where_the_gesture_wants_them(seed: int) -> None:
    person = someone(seed)
    height = person.height_m
    raised, resting = (
        (Bone.HAND_LEFT, Bone.HAND_RIGHT) if person.style.left_handed else (Bone.HAND_RIGHT, Bone.HAND_LEFT)
    )

    idle, enable, disable = (joints_m(person, moved(person, gesture=gesture)) for gesture in Gesture)

    assert idle[Bone.HAND_LEFT, 2] < 0.55 * height > idle[Bone.HAND_RIGHT, 2]
    assert enable[raised, 2] > 0.93 * height
    assert enable[resting, 2] < 0.55 * height
    for hand, side in ((Bone.HAND_LEFT, 1), (Bone.HAND_RIGHT, -1)):
        assert side * disable[hand, 1] > 0.38 * height
        assert 0.7 * height < disable[hand, 2] < 0.9 * height


def test_the_left_leg_leads_at_a_quarter_of_the_gait() -> None:
    after = joints_m(someone(1), moved(someone(1), math.pi / 2, 0.2))

    assert after[Bone.FOOT_LEFT, 0] > 0.15 > -0.15 > after[Bone.FOOT_RIGHT, 0]


def test_the_body_goes_where_it_is_put() -> None:
    person, place = someone(2), Pose2D(3.0, -1.0, math.pi / 2)

    here, there = joints_m(person, moved(person)), joints_m(person, moved(person, place=place))

    expected = np.column_stack([3.0 - here[:, 1], -1.0 + here[:, 0], here[:, 2]])
    assert np.allclose(there, expected)


def test_a_mask_can_be_forced_and_forbidden() -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        assert draw_person(rng, 0.24, 0.06, mask=True).mask is not None
        assert draw_person(rng, 0.24, 0.06, mask=False).mask is None
