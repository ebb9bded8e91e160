import numpy as np
import pytest

from sdt_tools.frames import MotionClass, MotionCommand, Twist
from sdt_tools.replay.tracks import COMMAND_HOLDS_NS, POSE_HOLDS_NS, PoseTrack, Tracks

MS = 1_000_000
EPOCH_NS = 1_735_689_600_000_000_000
NOTHING = PoseTrack(np.empty(0, np.int64), np.empty((3, 0)))


def track(stamps_ms: list[int], poses: list[tuple[float, float, float]]) -> PoseTrack:
    return PoseTrack(EPOCH_NS + np.array(stamps_ms) * MS, np.array(poses, float).T)


def at(*stamps_ms: float) -> np.ndarray:
    return EPOCH_NS + np.array([round(stamp * MS) for stamp in stamps_ms])


def test_poses_between_two_lie_on_the_line_between_them() -> None:
    poses = track([0, 20], [(0, 0, 0), (1, 2, 0.4)]).at(at(5, 20))
    np.testing.assert_allclose(poses.T, [(0.25, 0.5, 0.1), (1, 2, 0.4)], atol=1e-12)


def test_a_pose_is_unknown_where_none_was_measured_near() -> None:
    hold_ms = POSE_HOLDS_NS // MS
    known = ~np.isnan(track([0, 1000], [(0, 0, 0), (1, 0, 0)]).at(at(-hold_ms - 1, -hold_ms, hold_ms, 500, 1000))[0])
    assert known.tolist() == [False, True, True, False, True]


def test_without_poses_nothing_is_known() -> None:
    assert np.isnan(NOTHING.at(at(0, 1))).all()
    assert np.isnan(NOTHING.speed_mps(at(0, 1))).all()


def test_speed_is_signed_along_the_heading() -> None:
    stamps_ms = list(range(0, 1000, 20))
    backwards = track(stamps_ms, [(0.0, 0.4 * ms / 1000, -np.pi / 2) for ms in stamps_ms])
    np.testing.assert_allclose(backwards.speed_mps(at(0, 300, 980)), -0.4, atol=1e-9)


def test_turning_in_place_is_no_speed() -> None:
    stamps_ms = list(range(0, 1000, 20))
    assert abs(track(stamps_ms, [(1.0, 2.0, 0.9 * ms / 1000) for ms in stamps_ms]).speed_mps(at(500))).max() < 1e-12


def test_the_operator_is_seen_from_the_lidar() -> None:
    robot = track([0], [(1.0, 1.0, np.pi / 2)])
    operator = track([0], [(0.0, 1.197, 0.0)])
    range_m, bearing_rad = Tracks(robot, operator, ()).operator_from_lidar(at(0))
    assert range_m[0] == pytest.approx(1.0)
    assert bearing_rad[0] == pytest.approx(np.pi / 2)  # to the left


def test_bearings_stay_within_half_a_turn() -> None:
    robot = track([0], [(0.0, 0.0, 7 * np.pi - 0.1)])
    _, bearing_rad = Tracks(robot, track([0], [(5.0, 0.0, 0.0)]), ()).operator_from_lidar(at(0))
    assert abs(bearing_rad[0]) <= np.pi


def test_a_command_holds_until_the_next_or_until_it_runs_out() -> None:
    commands = tuple(
        MotionCommand(EPOCH_NS + ms * MS, motion, Twist(0.0, 0.0), "x")
        for ms, motion in ((0, MotionClass.STAY), (100, MotionClass.FORWARD))
    )
    out_ms = 100 + COMMAND_HOLDS_NS // MS
    found = Tracks(NOTHING, NOTHING, commands).commands_at(at(-1, 0, 99, 100, out_ms, out_ms + 1))
    assert [command and command.motion.label for command in found] == [
        None,
        "stay",
        "stay",
        "forward",
        "forward",
        None,
    ]
