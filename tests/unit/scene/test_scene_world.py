"""The world in motion: drive, collisions, and the operator's walk."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sdt_tools.frames import LIDAR_AHEAD_M, Gesture, Mode, Pose2D, Twist
from sdt_tools.scene.config import DriveConfig, SceneConfig
from sdt_tools.scene.layout import Box, GestureEvent, Layout, OperatorPlan, Post, Wall
from sdt_tools.scene.world import World

EXACT = SceneConfig(drive=DriveConfig(calibration_sd=0.0, slip_sd=0.0))
STAY = Twist(0.0, 0.0)


def plan(*path_m: tuple[float, float], **changes: object) -> OperatorPlan:
    usual = OperatorPlan(
        path_m=path_m,
        pauses_s=(0.0,) * len(path_m),
        speed_mps=0.5,
        waits_at_lead_m=2.0,
        keeps_away_m=0.4,
        patience_s=1.0,
        yaw_rad=math.pi,
        leg_radius_m=0.06,
        leg_separation_m=0.26,
        step_length_m=0.4,
        first_phase_rad=0.0,
    )
    return replace(usual, **changes)


def world(operator: OperatorPlan | None = None, config: SceneConfig = EXACT, **things: object) -> World:
    far_away = plan((0.0, 30.0))
    layout = Layout("test", 5, 60.0, Pose2D(0.0, 0.0, 0.0), far_away if operator is None else operator)
    return World(replace(layout, **things), config)


def drive(place: World, twist: Twist, seconds: float) -> World:
    for _ in range(round(seconds * 50)):
        place.step(twist)
    return place


def test_driving_straight_covers_speed_times_time_less_the_start() -> None:
    place = drive(world(), Twist(0.5, 0.0), 10.0)

    lost_m = 0.5**2 / (2 * EXACT.drive.accelerate_mps2)
    assert place.robot.x_m == pytest.approx(5.0 - lost_m, abs=0.01)
    assert place.robot.y_m == pytest.approx(0.0, abs=1e-9)
    assert place.time_s == pytest.approx(10.0)


def test_a_circle_has_the_radius_of_speed_over_turn() -> None:
    place = drive(world(), Twist(0.35, 0.9), 5.0)
    there = np.array([(place.robot.x_m, place.robot.y_m)])
    track = [there]
    for _ in range(400):
        place.step(Twist(0.35, 0.9))
        track.append(np.array([(place.robot.x_m, place.robot.y_m)]))

    points = np.concatenate(track)
    radius_m = (points.max(axis=0) - points.min(axis=0)) / 2
    np.testing.assert_allclose(radius_m, 0.35 / 0.9, atol=2e-3)


def test_braking_takes_the_distance_of_the_limit() -> None:
    place = drive(world(), Twist(0.5, 0.0), 4.0)
    before_m = place.robot.x_m

    drive(place, STAY, 3.0)

    assert place.robot.x_m - before_m == pytest.approx(0.5**2 / (2 * EXACT.drive.brake_mps2), abs=0.01)
    assert place.velocity == Twist(0.0, 0.0)


def test_speed_is_limited() -> None:
    place = drive(world(), Twist(9.0, 9.0), 5.0)

    assert place.velocity.linear_mps == pytest.approx(EXACT.drive.max_linear_mps)
    assert place.velocity.angular_radps == pytest.approx(EXACT.drive.max_turn_radps)


def test_slip_and_calibration_disturb_the_drive_by_a_few_percent() -> None:
    ends = [drive(World(replace(world().layout, seed=seed)), Twist(0.5, 0.0), 5.0).robot.x_m for seed in range(12)]

    assert 0.02 < np.std(ends) < 0.15
    assert np.mean(ends) == pytest.approx(2.3, abs=0.08)


def test_the_lidar_is_ahead_of_the_centre() -> None:
    place = drive(world(), Twist(0.0, 0.9), 2.0)

    yaw = place.robot.yaw_rad
    assert place.lidar_pose.x_m == pytest.approx(place.robot.x_m + LIDAR_AHEAD_M * math.cos(yaw))
    assert place.lidar_pose.y_m == pytest.approx(place.robot.y_m + LIDAR_AHEAD_M * math.sin(yaw))


@pytest.mark.parametrize(
    ("things", "touched", "stops_at_m"),
    [
        ({"walls": (Wall(-9.0, 9.0, 9.0, 9.0), Wall(1.0, -1.0, 1.0, 1.0))}, "wall 1", 1.0 - 0.313),
        ({"boxes": (Box(1.3, 0.0, 0.6, 0.6, 0.0),)}, "box 0", 1.0 - 0.313),
        ({"posts": (Post(-3.0, 3.0, 0.1), Post(1.05, 0.0, 0.05))}, "post 1", 1.0 - 0.313),
    ],
)
def test_a_collision_stops_the_robot_and_says_with_what(
    things: dict[str, object], touched: str, stops_at_m: float
) -> None:
    place = drive(world(**things), Twist(0.5, 0.0), 1.0)
    assert place.contact is None

    drive(place, Twist(0.5, 0.0), 3.0)

    assert place.contact == touched
    assert place.robot.x_m == pytest.approx(stops_at_m, abs=0.005)


def test_running_into_the_operator_is_a_contact_with_him() -> None:
    place = drive(world(plan((1.2, 0.0))), Twist(0.5, 0.0), 3.0)

    assert place.contact == "operator"


def test_the_operator_walks_his_path_at_his_speed_and_is_done() -> None:
    place = world(plan((0.0, 1.0), (0.0, 1.9), pauses_s=(1.0, 2.0)))

    drive(place, STAY, 0.9)
    assert place.operator_standing
    drive(place, STAY, 1.1)
    assert place.operator.y_m == pytest.approx(1.5, abs=0.02)
    drive(place, STAY, 2.5)
    assert not place.operator_done
    drive(place, STAY, 1.0)
    assert place.operator_done
    assert place.operator_standing


def test_the_operator_waits_while_he_leads_and_goes_on_when_followed() -> None:
    place = drive(world(plan((1.2, 0.0), (9.0, 0.0))), STAY, 10.0)
    lead_m = place.operator.x_m - place.lidar_pose.x_m
    assert lead_m == pytest.approx(2.0, abs=0.02)
    assert place.operator_standing

    drive(place, Twist(0.4, 0.0), 2.0)

    assert place.operator.x_m > lead_m + LIDAR_AHEAD_M + 0.2


def test_the_operator_turns_to_the_robot_while_he_waits() -> None:
    place = drive(world(plan((1.2, 0.0), (9.0, 0.0))), STAY, 10.0)

    assert abs(place.operator.yaw_rad) == pytest.approx(math.pi, abs=0.01)


def test_the_operator_does_not_walk_into_the_robot_and_goes_on_when_it_stays() -> None:
    place = world(plan((2.0, 0.0), (-2.0, 0.0), (2.0, 1.0)))

    drive(place, STAY, 3.0)
    assert place.contact is None
    assert place.operator.x_m == pytest.approx(0.313 + 0.4, abs=0.02)

    drive(place, STAY, 6.0)
    assert place.contact is None
    assert place.operator.x_m == pytest.approx(2.0, abs=0.07)


def test_legs_swing_past_each_other_while_he_walks() -> None:
    place = world(plan((1.0, 1.0), (1.0, 9.0), waits_at_lead_m=20.0))
    standing = place.legs.copy()
    ahead = []
    for _ in range(200):
        place.step(STAY)
        ahead.append(place.legs[0, 1] - place.legs[1, 1])

    assert math.dist(standing[0, :2], standing[1, :2]) == pytest.approx(0.26)
    assert max(ahead) == pytest.approx(0.4, abs=0.05)
    assert min(ahead) == pytest.approx(-0.4, abs=0.05)
    np.testing.assert_allclose(place.legs[:, :2].mean(axis=0), (place.operator.x_m, place.operator.y_m))


def test_same_seed_same_motion() -> None:
    def final() -> tuple[Pose2D, Pose2D]:
        place = drive(world(plan((1.2, 0.0), (5.0, 0.5)), SceneConfig()), Twist(0.4, 0.1), 8.0)
        return place.robot, place.operator

    assert final() == final()


def test_sight_ends_at_a_wall() -> None:
    open_world = world(plan((2.0, 0.0)))
    hidden = world(plan((2.0, 0.0)), walls=(Wall(1.0, -1.0, 1.0, 1.0),))

    assert open_world.operator_visible()
    assert not hidden.operator_visible()


def test_gestures_change_the_mode_he_has_asked_for() -> None:
    gestures = (GestureEvent(1.0, Gesture.ENABLE, 1.0), GestureEvent(4.0, Gesture.DISABLE, 1.0))
    place = world(gestures=gestures)

    seen = []
    for _ in range(6):
        seen.append((place.gesture, place.commanded_mode))
        drive(place, STAY, 1.0)

    enable, disable, idle = Gesture.ENABLE, Gesture.DISABLE, Gesture.IDLE
    assert [gesture for gesture, _ in seen] == [idle, enable, idle, idle, disable, idle]
    assert [mode for _, mode in seen] == [Mode.IDLE, Mode.ACTIVE, Mode.ACTIVE, Mode.ACTIVE, Mode.IDLE, Mode.IDLE]


def test_one_who_never_gestures_wants_the_robot_active() -> None:
    assert world().commanded_mode is Mode.ACTIVE


def test_gestures_may_be_asked_for_beside_those_that_are_planned() -> None:
    place = world(gestures=(GestureEvent(3.0, Gesture.DISABLE, 1.0),))
    drive(place, STAY, 1.0)
    place.show(Gesture.ENABLE)
    assert (place.gesture, place.commanded_mode) == (Gesture.ENABLE, Mode.ACTIVE)
    drive(place, STAY, 1.0)
    place.show(Gesture.IDLE)  # ends it; he has asked for it all the same
    assert (place.gesture, place.commanded_mode) == (Gesture.IDLE, Mode.ACTIVE)
    drive(place, STAY, 1.5)
    assert (place.gesture, place.commanded_mode) == (Gesture.DISABLE, Mode.IDLE)
    assert place.gesture_at(1.5) is Gesture.ENABLE  # what has been, has been


def test_who_shows_nothing_and_is_asked_for_nothing_goes_on_wanting_the_robot_active() -> None:
    place = world()
    place.show(Gesture.IDLE)
    assert (place.gestures, place.commanded_mode) == ([], Mode.ACTIVE)
    place.show(Gesture.DISABLE)
    drive(place, STAY, 2.5)
    assert (place.gesture, place.commanded_mode) == (Gesture.IDLE, Mode.IDLE)
