"""A source that hangs in the middle of a read: the robot stands, signals are heard, the file is whole."""

import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from recording_rig import HandClock, Rig, TapeSource, Wheels
from recording_samples import scan

from sdt_tools.errors import RunError
from sdt_tools.frames import LidarScan, MotionClass, MotionCommand, Received, Twist
from sdt_tools.recording.live import loop
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.recording.live.outcome import Ending
from sdt_tools.recording.live.reading import WatchedReading

HANGS_AT = 20
STAND = Twist(0.0, 0.0)


@dataclass
class HangingSource(TapeSource):
    """Hangs before a scan, until it is told to go on."""

    goes_on: threading.Event = field(default_factory=threading.Event)

    def read(self, until_ns: int) -> Iterator[Received]:
        for received in super().read(until_ns):
            if received.message.stamp_ns == scan(HANGS_AT).message.stamp_ns:
                self.goes_on.wait(30.0)
            yield received


@pytest.fixture
def hanging(tmp_path: Path) -> Iterator[Rig]:
    source = HangingSource([scan(n) for n in range(50)])
    yield Rig(tmp_path / "r.mcap", source)
    source.goes_on.set()


def run(setup: Rig, interrupt: Interrupt | None = None) -> Ending:
    clock = HandClock()

    def sleep(seconds: float) -> None:
        time.sleep(seconds)
        clock.sleep(seconds)

    return setup.run(realtime=True, clock=clock, sleep_s=sleep, interrupt=interrupt).ending


def last_commands(setup: Rig) -> list[tuple[str, MotionClass]]:
    return [(m.message.driver, m.message.motion) for m in setup.read() if isinstance(m.message, MotionCommand)][-2:]


def test_the_robot_stands_and_in_the_end_the_source_is_given_up(hanging: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loop, "DEAD_S", 0.4)
    with pytest.raises(RunError, match=r"r\.mcap: the scene has not answered for 0 s; what was recorded before is"):
        run(hanging)
    assert hanging.wheels.twists[-1] == STAND
    assert last_commands(hanging) == [(hanging.driver.name, MotionClass.FORWARD), (STOP, MotionClass.STAY)]
    asleep, given_up = hanging.log()
    assert asleep == "the scene does not answer: the robot stands until it does"
    assert given_up.startswith("the recording stopped: RunError: the scene has not answered")
    assert hanging.stats()["ending"] == Ending.FAILED
    assert hanging.source.closed == 1


def test_a_signal_is_heard_meanwhile(hanging: Rig) -> None:
    interrupt = Interrupt()

    class HangsUp(Wheels):
        def command(self, twist: Twist) -> None:
            super().command(twist)
            if twist == STAND:
                interrupt.signal = signal.SIGHUP

    hanging.wheels = HangsUp()
    assert run(hanging, interrupt) is Ending.HANGUP
    assert last_commands(hanging)[-1] == (STOP, MotionClass.STAY)


def test_it_drives_on_when_the_source_answers_again_and_no_scan_is_lost(hanging: Rig) -> None:
    source = hanging.source
    assert isinstance(source, HangingSource)

    class Wakes(Wheels):
        def command(self, twist: Twist) -> None:
            super().command(twist)
            if twist == STAND:
                source.goes_on.set()

    hanging.wheels = Wakes()
    assert run(hanging) is Ending.SOURCE
    assert hanging.log() == ["the scene does not answer: the robot stands until it does", "the scene answers again"]
    received = hanging.read()
    assert [m.message.stamp_ns for m in received if isinstance(m.message, LidarScan)] == [
        scan(n).message.stamp_ns for n in range(50)
    ]
    drivers = [m.message.driver for m in received if isinstance(m.message, MotionCommand)]
    assert hanging.driver.name in drivers[drivers.index(STOP) :]


class Busy(HangingSource):
    """Computes for a while where the other hangs."""

    busy_s = 0.0

    def read(self, until_ns: int) -> Iterator[Received]:
        end_s = time.thread_time() + self.busy_s
        while time.thread_time() < end_s:
            pass
        yield from TapeSource.read(self, until_ns)


def test_a_source_that_computes_is_waited_for_longer() -> None:
    source = Busy([scan(n) for n in range(3)])
    source.busy_s = 0.15
    reading = WatchedReading(source, lambda: False, silent_after_s=0.04)
    part = reading.read(scan(2).received_ns)
    assert (len(part.sensed), part.read_to_ns, reading.silent_s) == (3, scan(2).received_ns, 0.0)
    reading.close()
    assert source.closed == 1


def test_but_not_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sdt_tools.recording.live.reading.TOILING_S", 0.08)
    source = Busy([scan(n) for n in range(3)])
    source.busy_s = 0.3
    reading = WatchedReading(source, lambda: False, silent_after_s=0.04)
    assert reading.read(scan(2).received_ns).sensed == ()
    assert reading.silent_s > 0
    reading.close()


def test_closing_does_not_wait_for_a_source_that_hangs_in_close_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sdt_tools.recording.live.reading._CLOSE_S", 0.05)
    let_go = threading.Event()

    class Stuck(HangingSource):
        def close(self) -> None:
            let_go.wait(30.0)

    source = Stuck([scan(n) for n in range(50)])
    reading = WatchedReading(source, lambda: False, silent_after_s=0.05)
    part = reading.read(scan(49).received_ns)
    assert (part.sensed, part.read_to_ns) == ((), None)
    assert reading.silent_s >= 0.05
    began_s = time.monotonic()
    reading.close()
    assert time.monotonic() - began_s < 10.0
    let_go.set()
    source.goes_on.set()
