"""One recording under somebody's controls, and drivers that say more than a class."""

from dataclasses import dataclass, field
from pathlib import Path

import pytest
from recording_rig import Rig, Watcher, rig
from recording_samples import PERIOD_NS, T0

from sdt_tools.config import MotionConfig
from sdt_tools.errors import RunError
from sdt_tools.frames import LidarScan, LogEntry, MotionClass, MotionCommand, Received, Twist
from sdt_tools.protocols import Choice, Observation
from sdt_tools.recording.live.control import Control, Wish
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.recording.live.outcome import Ending


@dataclass
class Fingers(Watcher):
    """Wants something when a scan of some number passes."""

    control: Control = field(default_factory=Control)
    keys: dict[int, tuple[Wish, str]] = field(default_factory=dict)

    def observe(self, received: Received) -> None:
        super().observe(received)
        if isinstance(received.message, LidarScan):
            wish = self.keys.get((received.message.stamp_ns - T0) // PERIOD_NS)
            if wish is not None:
                self.control.want(*wish)


def run(setup: Rig, keys: dict[int, tuple[Wish, str]]) -> Ending:
    fingers = Fingers(keys=keys)
    setup.watcher = fingers
    return setup.run(seconds=2.0, control=fingers.control).ending


def test_it_is_ended_marked_and_noted_at_a_wish(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    keys = {10: (Wish.MARK, ""), 20: (Wish.MARK, "the door"), 25: (Wish.NOTE, "slower"), 40: (Wish.QUIT, "")}
    assert run(setup, keys) is Ending.STOPPED
    entries = [m.message for m in setup.read() if isinstance(m.message, LogEntry)]
    assert [(entry.name, entry.text) for entry in entries] == [
        ("mark", "mark 1"),
        ("mark", "the door"),
        ("note", "slower"),
    ]
    assert setup.stats()["ending"] == "stopped"
    assert 40 <= len([m for m in setup.read() if isinstance(m.message, LidarScan)]) <= 42
    last = [m.message for m in setup.read() if isinstance(m.message, MotionCommand)][-1]
    assert (last.driver, last.twist) == (STOP, Twist(0.0, 0.0))


def test_it_is_paused_and_resumed(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    run(setup, {20: (Wish.TOGGLE, ""), 60: (Wish.TOGGLE, "")})
    scans = [(m.message.stamp_ns - T0) // PERIOD_NS for m in setup.read() if isinstance(m.message, LidarScan)]
    assert not set(scans) & set(range(22, 60))
    assert set(scans) >= {*range(20), *range(62, 90)}
    assert setup.log()[0].startswith("paused")
    assert setup.log()[1].startswith("resumed after a pause of 0.8")


def test_what_only_sessions_know_is_not_heard(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    assert run(setup, {20: (Wish.DISCARD, ""), 30: (Wish.NEXT, ""), 40: (Wish.START, "")}) is Ending.TIME
    assert len([m for m in setup.read() if isinstance(m.message, LidarScan)]) == 100


@dataclass
class Person:
    """Turns left at half speed, having taken over."""

    name: str = "policy:follow"

    def choose(self, observation: Observation) -> Choice:
        return Choice(MotionClass.LEFT_FORWARD, "keyboard", 0.5, intervention=True)


def test_a_choice_is_recorded_with_who_made_it_and_driven_at_its_speed(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    setup.driver = Person()  # type: ignore[assignment]
    setup.run(seconds=0.3)
    commands = [m.message for m in setup.read() if isinstance(m.message, MotionCommand)]
    full = MotionConfig().twist(MotionClass.LEFT_FORWARD)
    half = Twist(full.linear_mps / 2, full.angular_radps / 2)
    assert {(c.motion, c.twist, c.driver, c.intervention) for c in commands} == {
        (MotionClass.LEFT_FORWARD, half, "keyboard", True)
    }
    assert setup.wheels.twists[0] == half


def test_a_failure_around_the_recording_stops_the_robot_and_closes_the_file(tmp_path: Path) -> None:
    setup, interrupt = rig(tmp_path), Interrupt()

    class Trouble(Watcher):
        def observe(self, received: Received) -> None:
            if isinstance(received.message, LidarScan) and received.message.stamp_ns == T0 + 30 * PERIOD_NS:
                interrupt.failure = RunError("the cockpit failed")

    setup.watcher = Trouble()
    with pytest.raises(RunError, match="the cockpit failed"):
        setup.run(seconds=2.0, interrupt=interrupt)
    assert setup.log() == ["the recording stopped: RunError: the cockpit failed"]
    assert setup.stats()["ending"] == "failed"
    (stop_ns, stop) = [(m.received_ns, m.message) for m in setup.read() if isinstance(m.message, MotionCommand)][-1]
    assert stop.driver == STOP
    assert stop_ns <= T0 + 31 * PERIOD_NS
    assert setup.wheels.twists[-1] == Twist(0.0, 0.0)
