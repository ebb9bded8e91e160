import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from recording_rig import HandClock, Rig, TapeSource, rig
from recording_samples import PERIOD_NS, T0, image, scan

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import MotionConfig
from sdt_tools.errors import RecordingError, RunError
from sdt_tools.frames import LidarScan, MotionClass, MotionCommand, Received, Twist
from sdt_tools.protocols import Observation
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.live.gaps import GapCounter
from sdt_tools.recording.live.outcome import Ending, RecordingProgress
from sdt_tools.recording.live.perturb import Perturbation, PerturbConfig
from sdt_tools.recording.writer import RecordingWriter


def test_everything_that_the_source_says_is_recorded(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    summary = setup.run(seconds=2.0)
    assert summary.ending is Ending.TIME
    assert summary.seconds == 2.0
    assert dict(summary.frames) == {"/camera/image": 61, "/lidar/scan": 100, "/robot/command": 20}
    assert Counter(type(m.message).__name__ for m in setup.read()) == {
        "CameraImage": 61,
        "LidarScan": 100,
        "MotionCommand": 20,
    }


def test_decisions_come_ten_times_a_second_on_the_newest_scan(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    setup.run(seconds=1.0)
    commands = [m for m in setup.read() if isinstance(m.message, MotionCommand)]
    assert [m.message.stamp_ns for m in commands] == [T0 + n * 100_000_000 for n in range(10)]
    assert [m.received_ns for m in commands] == [T0 + n * 100_000_000 for n in range(10)]
    for number, observation in enumerate(setup.driver.seen):
        assert observation.scan is not None
        assert observation.image is not None
        assert observation.scan.stamp_ns == T0 + number * 100_000_000
        assert 0 <= observation.now_ns - observation.image.stamp_ns < 33_333_334


def test_a_command_holds_the_decision_its_twist_and_the_advice(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    setup.run(seconds=0.1)
    (command,) = [m.message for m in setup.read() if isinstance(m.message, MotionCommand)]
    assert command == MotionCommand(
        T0,
        MotionClass.FORWARD,
        MotionConfig().twist(MotionClass.FORWARD),
        "constant:forward",
        expert=MotionClass.BACKWARD,
    )


def test_nothing_is_decided_before_the_first_scan_or_twice_on_one(tmp_path: Path) -> None:
    setup = Rig(tmp_path / "r.mcap", TapeSource([image(0), scan(10), scan(40)]))
    setup.run(seconds=1.0)
    commands = [m for m in setup.read() if isinstance(m.message, MotionCommand)]
    assert [m.message.stamp_ns for m in commands if m.message.driver != STOP] == [T0 + 10 * PERIOD_NS]


def test_a_robot_that_drives_and_sees_nothing_is_stopped_until_it_sees_again(tmp_path: Path) -> None:
    setup = Rig(tmp_path / "r.mcap", TapeSource([scan(10), scan(40), scan(50), image(60)]))
    setup.run(seconds=60.0)
    commands = [m for m in setup.read() if isinstance(m.message, MotionCommand)]
    blind, *_ = [m for m in commands if m.message.driver == STOP]
    assert blind.received_ns == T0 + (10 + 11) * PERIOD_NS
    assert blind.message.twist == setup.wheels.twists[1] == Twist(0.0, 0.0)
    assert setup.log()[0].startswith("no scan for 0.2 s")
    assert [m.message.driver for m in commands] == [
        "constant:forward",
        STOP,
        "constant:forward",
        "constant:forward",
        STOP,
    ]


@pytest.mark.parametrize("happens", [{80: signal.SIGHUP}, {80: ConnectionResetError("gone")}, {}])
def test_whatever_ends_it_before_its_time_the_last_command_is_a_stop(
    tmp_path: Path, happens: dict[int, BaseException | int]
) -> None:
    setup = rig(tmp_path, happens=happens)
    with suppress(RunError):
        setup.run(seconds=60.0)
    commands = [m for m in setup.read() if isinstance(m.message, MotionCommand)]
    assert [(m.message.driver, m.message.twist) for m in commands[-1:]] == [(STOP, Twist(0.0, 0.0))]
    assert {m.message.driver for m in commands[:-1]} == {"constant:forward"}


def test_it_ends_when_the_source_does(tmp_path: Path) -> None:
    setup = rig(tmp_path, scans=30)
    summary = setup.run(seconds=60.0)
    assert summary.ending is Ending.SOURCE
    assert summary.frames["/lidar/scan"] == 30
    assert summary.seconds == pytest.approx(0.6)  # the last image


def test_the_robot_stands_still_in_the_end_and_all_is_closed(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    setup.run(seconds=0.5)
    assert setup.wheels.twists[0].linear_mps > 0
    assert setup.wheels.twists[-1] == Twist(0.0, 0.0)
    assert (setup.source.closed, setup.watcher.closed) == (1, 1)


def test_observers_see_what_is_written(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    setup.run(seconds=0.5)
    assert Counter(m.received_ns for m in setup.watcher.seen) == Counter(m.received_ns for m in setup.read())


@pytest.mark.parametrize("event", [KeyboardInterrupt(), signal.SIGINT], ids=["raised", "signal"])
def test_ctrl_c_closes_the_file_and_says_so(tmp_path: Path, event: BaseException | int) -> None:
    setup = rig(tmp_path, happens={50: event})
    before = signal.getsignal(signal.SIGINT)
    summary = setup.run(seconds=2.0)
    assert summary.interrupted
    assert 30 <= summary.frames["/lidar/scan"] < 40
    assert setup.log() == ["stopped by the user"]
    assert setup.stats()["ending"] == "interrupted"
    assert setup.wheels.twists[-1] == Twist(0.0, 0.0)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_second_ctrl_c_does_not_wait_for_the_tick(tmp_path: Path) -> None:
    setup = rig(tmp_path, happens={50: signal.SIGINT, 51: signal.SIGINT})
    setup.source.messages = [Received(T0, m.message) for m in setup.source.messages]  # one tick holds all
    assert setup.run(seconds=2.0).interrupted
    assert setup.source._next == 51


def test_a_sensor_that_fails_leaves_a_whole_file_and_a_word_in_it(tmp_path: Path) -> None:
    setup = rig(tmp_path, happens={80: ConnectionResetError("the LiDAR hung up")})
    with pytest.raises(
        RunError, match=r"r\.mcap: the scene failed after 1\.\d s \(the LiDAR hung up\); what was rec.* kept"
    ):
        setup.run(seconds=2.0)
    assert setup.log() == ["the recording stopped: ConnectionResetError: the LiDAR hung up"]
    assert setup.stats()["ending"] == "failed"
    assert len(setup.read()) > 80
    assert setup.wheels.twists[-1] == Twist(0.0, 0.0)
    assert setup.source.closed == 1


def test_a_bug_is_not_dressed_up_but_the_file_is_whole(tmp_path: Path) -> None:
    setup = rig(tmp_path, happens={80: ZeroDivisionError("a bug")})
    with pytest.raises(ZeroDivisionError):
        setup.run(seconds=2.0)
    assert setup.log() == ["the recording stopped: ZeroDivisionError: a bug"]


def test_a_disk_that_refuses_is_reported_as_such(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    setup = rig(tmp_path)

    def refuse(_self: RecordingWriter, _received: Received) -> None:
        raise RecordingError("the disk is full")

    monkeypatch.setattr(RecordingWriter, "write", refuse)
    with pytest.raises(RecordingError, match="the disk is full"):
        setup.run(seconds=1.0)
    assert setup.wheels.twists == [Twist(0.0, 0.0)]


def test_missing_scans_are_counted_and_logged(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    setup.source.messages = [
        m for m in setup.source.messages if not T0 + 200_000_000 <= m.received_ns < T0 + 300_000_000
    ]
    summary = setup.run(seconds=1.0)
    assert dict(summary.missing) == {"/lidar/scan": 5, "/camera/image": 3}
    assert dict(summary.dropped) == {"/lidar/scan": 0, "/camera/image": 0}
    assert (setup.stats()["missing./lidar/scan"], setup.stats()["dropped./lidar/scan"]) == ("5", "0")
    assert sorted(text.split(" before ")[0] for text in setup.log()) == [
        "/camera/image: 3 messages missing",
        "/lidar/scan: 5 messages missing",
    ]


@pytest.mark.parametrize(
    ("stamps", "missing"),
    [([0, 10, 20, 30], 0), ([0, 10, 24, 30], 0), ([0, 10, 30, 40], 1), ([0, 100], 9), ([0, 10, 10, 5, 15], 0)],
)
def test_gaps_are_counted_by_the_sensors_stamps(stamps: list[int], missing: int) -> None:
    gaps = GapCounter(10.0)
    assert sum(gaps.see(stamp) for stamp in stamps) == gaps.missing == missing


def test_in_real_time_the_source_is_read_at_the_pace_of_the_clock(tmp_path: Path) -> None:
    clock = HandClock()
    setup = rig(tmp_path)
    reads: list[int] = []
    read = setup.source.read
    setup.source.read = lambda until_ns: (reads.append(until_ns), read(until_ns))[1]
    summary = setup.run(seconds=1.0, realtime=True, clock=clock, sleep_s=clock.sleep)
    assert reads == [T0 + n * PERIOD_NS for n in range(1, 50)] + [T0 + SECOND_NS - 1]
    assert summary.missed_deadlines == 0
    assert summary.frames["/lidar/scan"] == 50


def test_a_slow_driver_in_real_time_loses_decisions_but_no_scan(tmp_path: Path) -> None:
    clock = HandClock()
    setup = rig(tmp_path)
    decide = setup.driver.decide

    def slow(observation: Observation) -> MotionClass:
        clock.sleep(0.25)
        return decide(observation)

    setup.driver.decide = slow
    summary = setup.run(seconds=1.0, realtime=True, clock=clock, sleep_s=clock.sleep)
    scans = [m for m in setup.read() if m.message.stamp_ns in {s.message.stamp_ns for s in map(scan, range(50))}]
    assert summary.frames["/lidar/scan"] >= 49
    assert len(scans) >= 49
    assert summary.decisions < 6
    assert summary.missed_deadlines > 10


class Toiling(TapeSource):
    """Takes 30 ms of the clock for each scan of 20 ms: it never keeps up."""

    clock: HandClock

    def read(self, until_ns: int) -> Iterator[Received]:
        for received in super().read(until_ns):
            self.clock.sleep(0.03)
            yield received


def toiling(tmp_path: Path, happens: dict[int, int] | None = None) -> tuple[Rig, HandClock]:
    source = Toiling([scan(n) for n in range(200)], happens or {})
    source.clock = HandClock()
    return Rig(tmp_path / "r.mcap", source), source.clock


def test_a_source_that_cannot_keep_up_is_driven_all_the_same(tmp_path: Path) -> None:
    setup, clock = toiling(tmp_path)
    summary = setup.run(seconds=3.0, realtime=True, clock=clock, sleep_s=clock.sleep)
    assert (summary.ending, summary.frames["/lidar/scan"]) == (Ending.TIME, 150)
    assert summary.missed_deadlines > 0
    passed = [m for m in setup.read() if isinstance(m.message, MotionCommand)]
    apart_ns = np.diff([m.received_ns for m in passed])
    assert len(passed) >= 25
    assert apart_ns.max() <= 8 * PERIOD_NS
    assert [m.received_ns for m in passed] == sorted(m.received_ns for m in passed)


def test_a_source_that_cannot_keep_up_does_not_keep_a_signal_waiting(tmp_path: Path) -> None:
    setup, clock = toiling(tmp_path, {100: signal.SIGTERM})
    setup.run(realtime=True, clock=clock, sleep_s=clock.sleep)
    scans = [m for m in setup.read() if isinstance(m.message, LidarScan)]
    assert 100 <= len(scans) <= 103


def test_progress_tells_where_the_recording_stands(tmp_path: Path) -> None:
    told: list[RecordingProgress] = []
    rig(tmp_path).run(seconds=1.0, progress=told.append)
    assert (told[0].recorded_s, told[0].total_s) == (0.0, 1.0)
    assert told[-1].recorded_s == 1.0
    assert told[-1].counts["/lidar/scan"] == 50


def perturbed(seed: int, decisions: int = 20_000, **config: float) -> list[MotionClass]:
    perturb = Perturbation(seed, PerturbConfig(**config), decision_hz=10.0)
    return [perturb(MotionClass.FORWARD) for _ in range(decisions)]


def runs(driven: list[MotionClass], wanted: MotionClass) -> list[int]:
    """Lengths of the runs of ``wanted``."""
    marks = np.flatnonzero(np.diff([0, *(motion is wanted for motion in driven), 0]))
    return list(np.diff(marks)[::2])


def test_forced_motions_are_the_same_for_the_same_seed() -> None:
    assert perturbed(3, 500) == perturbed(3, 500) != perturbed(4, 500)


def test_forced_motions_last_as_long_as_they_are_asked_to() -> None:
    lengths = runs(perturbed(0), MotionClass.BACKWARD)
    alone = [length for length in lengths if length <= 12]
    assert len(alone) > 0.85 * len(lengths)  # two may follow each other
    assert min(alone) == 4
    assert np.mean(alone) == pytest.approx(8.0, abs=1.0)


def test_about_one_free_decision_in_twenty_begins_a_forced_motion() -> None:
    driven = perturbed(1)
    forced = sum(motion is not MotionClass.FORWARD for motion in driven) * 9 / 8  # one forced motion in nine is forward
    free = len(driven) - forced
    assert forced / 8 / free == pytest.approx(0.05, rel=0.15)


def test_without_probability_nothing_is_forced() -> None:
    assert set(perturbed(0, 1000, start_probability=0.0)) == {MotionClass.FORWARD}


def test_forced_commands_say_so(tmp_path: Path) -> None:
    setup = rig(tmp_path)
    summary = setup.run(seconds=1.0, perturb=lambda _: MotionClass.STAY)
    commands = [m.message for m in setup.read() if isinstance(m.message, MotionCommand)]
    assert summary.forced == summary.decisions == len(commands) == 10
    assert {(c.motion, c.driver, c.intervention, c.expert) for c in commands} == {
        (MotionClass.STAY, "perturbation", False, MotionClass.BACKWARD)
    }
    assert set(setup.wheels.twists) == {Twist(0.0, 0.0)}
