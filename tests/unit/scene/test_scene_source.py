"""The scene as a source: what comes, when, and when it ends."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS
from sdt_tools.config import MotionConfig, RateConfig, parse_config
from sdt_tools.errors import ConfigError
from sdt_tools.frames import (
    CameraCalibration,
    FrameTransform,
    Gesture,
    LidarScan,
    LogEntry,
    Message,
    Mode,
    MotionClass,
    Odometry,
    OperatorPose,
    OperatorState,
    RawPicture,
    Received,
    Twist,
)
from sdt_tools.protocols import Actuator, Expert, Gesturing, Source
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource

STEP_NS = SECOND_NS // 50


def played(source: SceneSource, seconds: float, motion: MotionClass | None = None) -> list[Received | RawPicture]:
    """Everything of the first ``seconds``, driven by ``motion`` or by the expert at 10 Hz."""
    received: list[Received | RawPicture] = []
    for tick in range(round(seconds * 50) + 1):
        received += source.read(source.start_ns + tick * STEP_NS)
        if tick % 5 == 0:
            source.command(MotionConfig().twist(source.expert.advise() if motion is None else motion))
    return received


def sensed(received: list[Received | RawPicture]) -> list[Message | RawPicture]:
    return [item.message if isinstance(item, Received) else item for item in received]


def stamps(received: list[Received | RawPicture], kind: type) -> list[int]:
    return [item.stamp_ns - FAST_EPOCH_NS for item in sensed(received) if isinstance(item, kind)]


def test_it_is_a_source_an_actuator_and_has_an_expert() -> None:
    source = SceneSource(layout_for("plain", 1))

    assert isinstance(source, Source)
    assert isinstance(source, Actuator)
    assert isinstance(source.expert, Expert)
    assert source.info.scenario == "plain"
    assert source.info.seed == 1


def test_scans_and_poses_come_fifty_times_a_second() -> None:
    received = played(SceneSource(layout_for("plain", 1)), 2.0)

    expected = [tick * STEP_NS for tick in range(101)]
    assert stamps(received, LidarScan) == expected
    assert stamps(received, Odometry) == expected
    assert stamps(received, OperatorPose) == expected


def test_scans_come_at_25_hertz_where_asked() -> None:
    config = SceneConfig(rates=RateConfig(scan_hz=25.0))

    received = played(SceneSource(layout_for("plain", 1), config), 1.0)

    assert stamps(received, LidarScan) == [tick * 2 * STEP_NS for tick in range(26)]


def test_everything_is_received_in_order_at_its_stamp() -> None:
    received = played(SceneSource(layout_for("plain", 1)), 2.0)

    assert [item.received_ns for item in received] == sorted(item.received_ns for item in received)
    assert all(item.received_ns == item.message.stamp_ns for item in received)


def test_reading_once_or_often_gives_the_same() -> None:
    often, once = SceneSource(layout_for("plain", 1)), SceneSource(layout_for("plain", 1))
    by_steps = [item for tick in range(51) for item in often.read(often.start_ns + tick * STEP_NS)]

    at_once = list(once.read(once.start_ns + SECOND_NS))

    assert len(at_once) == len(by_steps)
    for one, other in zip(at_once, by_steps, strict=True):
        if isinstance(one.message, LidarScan):
            np.testing.assert_array_equal(one.message.ranges_m, other.message.ranges_m)
        else:
            assert one == other


def test_a_scan_shows_the_operator_where_he_is() -> None:
    source = SceneSource(layout_for("plain", 1))
    first = next(item.message for item in played(source, 0.0) if isinstance(item.message, LidarScan))

    front = first.ranges_m[240:301]
    assert 0.9 < front[front > 0.01].min() < 1.2  # he starts 1.1 m ahead of the LiDAR


def test_where_the_lidar_is_comes_first() -> None:
    first, *_ = played(SceneSource(layout_for("plain", 1)), 0.0)

    assert isinstance(first.message, FrameTransform)
    assert first.message.translation_m[0] == pytest.approx(0.197)


def test_the_operators_state_comes_when_it_changes_and_every_second() -> None:
    received = played(SceneSource(layout_for("plain", 1)), 4.0)

    assert stamps(received, OperatorState) == [round(s * SECOND_NS) for s in (0.0, 1.0, 1.5, 2.5, 3.5)]
    states = [item for item in sensed(received) if isinstance(item, OperatorState)]
    assert [state.gesture for state in states][:3] == [Gesture.ENABLE, Gesture.ENABLE, Gesture.IDLE]


def test_a_contact_ends_the_scene_and_is_logged() -> None:
    source = SceneSource(layout_for("plain", 1))

    received = played(source, 6.0, MotionClass.FORWARD)

    entries = [item for item in sensed(received) if isinstance(item, LogEntry)]
    assert [entry.text for entry in entries] == ["the robot touched operator"]
    assert source.finished
    assert list(source.read(source.start_ns + 60 * SECOND_NS)) == []


def test_a_contact_may_be_ignored() -> None:
    source = SceneSource(layout_for("plain", 1), SceneConfig(stop_at_contact=False))

    received = played(source, 6.0, MotionClass.FORWARD)

    assert not source.finished
    assert len(stamps(received, LidarScan)) == 301


def test_the_scene_ends_some_time_after_the_operators_path() -> None:
    layout = layout_for("plain", 1)
    short = replace(layout, operator=replace(layout.operator, path_m=layout.operator.path_m[:1], pauses_s=(1.0,)))
    source = SceneSource(short, SceneConfig(linger_s=2.0))

    received = played(source, 10.0)

    assert source.finished
    assert stamps(received, LidarScan)[-1] == pytest.approx(3.0 * SECOND_NS, abs=3 * STEP_NS)


def test_the_scene_ends_at_its_timeout() -> None:
    source = SceneSource(replace(layout_for("plain", 1), timeout_s=1.0))

    received = played(source, 5.0)

    assert source.finished
    assert stamps(received, LidarScan)[-1] == SECOND_NS


def test_a_rate_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ConfigError, match="scan_hz = 30 does not divide the scene's 50 steps a second"):
        parse_config(SceneConfig, {"rates": {"scan_hz": 30}}, "test")


def test_with_a_camera_images_and_gestures_come_in_step() -> None:
    source = SceneSource(layout_for("plain", 1), camera=True)

    received = played(source, 0.2)

    expected = [round(i * SECOND_NS / 30) for i in range(7)]
    assert stamps(received, RawPicture) == expected
    assert set(expected) <= set(stamps(received, OperatorState))
    assert len(stamps(received, CameraCalibration)) == 1
    assert [item.received_ns for item in received] == sorted(item.received_ns for item in received)
    assert Counter(type(item) for item in sensed(received))[FrameTransform] == 2


def test_closing_twice_is_fine() -> None:
    source = SceneSource(layout_for("plain", 1))

    source.command(Twist(0.1, 0.0))
    source.close()
    source.close()


def test_a_gesture_that_is_asked_for_is_shown_at_the_next_tick_and_told() -> None:
    source = SceneSource(layout_for("plain", 1))
    assert isinstance(source, Gesturing)
    states = [one for one in sensed(played(source, 0.5)) if isinstance(one, OperatorState)]
    assert {state.gesture for state in states} == {Gesture.ENABLE}  # as the scenario has it
    source.show(Gesture.DISABLE)
    later = [one for one in sensed(list(source.read(source.start_ns + SECOND_NS))) if isinstance(one, OperatorState)]
    assert (later[0].gesture, later[0].commanded_mode) == (Gesture.DISABLE, Mode.IDLE)
    assert later[0].stamp_ns - source.start_ns <= SECOND_NS // 2 + 2 * STEP_NS


def test_gestures_asked_for_move_neither_robot_nor_operator() -> None:
    """They have no random numbers of their own: whoever is not asked walks the same way."""
    quiet, asked = SceneSource(layout_for("plain", 1)), SceneSource(layout_for("plain", 1))
    asked.show(Gesture.ENABLE)
    for source in (quiet, asked):
        played(source, 2.0)
    assert (quiet.world.robot, quiet.world.operator) == (asked.world.robot, asked.world.operator)
