"""The watchdog, its thread and its clock real, its times short."""

import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from actuator_samples import Remembers

from sdt_tools.control.limited import LimitedActuator
from sdt_tools.control.watchdog import Watchdog, WatchdogConfig
from sdt_tools.emergency import EmergencyStop
from sdt_tools.errors import RunError
from sdt_tools.frames import LidarScan, Received, Twist
from sdt_tools.protocols import Actuator, Observer
from sdt_tools.robot.limits import SpeedLimits

AHEAD, REST = Twist(0.5, 0.0), Twist(0.0, 0.0)
SCAN = Received(0, LidarScan(0, np.ones(541)))
CONFIG = WatchdogConfig(scan_s=0.08, decision_s=0.08, look_s=0.005)


@pytest.fixture
def below() -> Remembers:
    return Remembers()


@pytest.fixture
def emergency() -> EmergencyStop:
    return EmergencyStop()


@pytest.fixture
def watchdog(below: Remembers, emergency: EmergencyStop) -> Iterator[Watchdog]:
    with Watchdog(below, CONFIG, emergency) as watchdog:
        yield watchdog


def wait_for(condition: Callable[[], bool], each: Callable[[], None] = lambda: None) -> bool:
    until_s = time.monotonic() + 5.0
    while not condition() and time.monotonic() < until_s:
        each()
        time.sleep(0.002)
    return condition()


def test_while_scans_and_decisions_come_all_passes(watchdog: Watchdog, below: Remembers) -> None:
    assert isinstance(watchdog, Actuator)
    assert isinstance(watchdog, Observer)
    until_s = time.monotonic() + 0.25
    while time.monotonic() < until_s:
        watchdog.observe(SCAN)
        watchdog.command(AHEAD)
        time.sleep(0.005)
    assert set(below.commanded) == {AHEAD}
    assert watchdog.entries() == []


def test_no_decision_stops_it_and_the_next_one_drives_on(watchdog: Watchdog, below: Remembers) -> None:
    watchdog.command(AHEAD)
    assert wait_for(lambda: below.now == REST, lambda: watchdog.observe(SCAN))
    (entry,) = watchdog.entries()
    assert entry.text.startswith("no decision for 0.0")
    assert entry.text.endswith(": the robot stops")
    watchdog.command(AHEAD)
    assert below.now == AHEAD


def test_no_scan_stops_it_whatever_is_decided(watchdog: Watchdog, below: Remembers) -> None:
    assert wait_for(lambda: bool(below.commanded) and below.now == REST, lambda: watchdog.command(AHEAD))
    assert watchdog.entries()[0].text.startswith("no scan for 0.0")
    watchdog.command(AHEAD)
    assert below.now == REST
    watchdog.observe(SCAN)
    watchdog.command(AHEAD)
    assert below.now == AHEAD


def test_a_robot_that_stands_is_left_alone(watchdog: Watchdog, below: Remembers) -> None:
    watchdog.command(REST)
    time.sleep(0.12)
    assert below.commanded == [REST]
    assert watchdog.entries() == []


def test_the_emergency_stop_holds_until_it_is_released(
    watchdog: Watchdog, below: Remembers, emergency: EmergencyStop
) -> None:
    watchdog.command(AHEAD)
    emergency.pull("a child on the stairs")
    assert below.now == REST
    watchdog.observe(SCAN)
    watchdog.command(AHEAD)
    assert below.now == REST
    assert watchdog.entries()[0].text == "a child on the stairs: the robot stops"
    emergency.release()
    assert below.now == REST
    watchdog.command(AHEAD)
    assert below.now == AHEAD


def test_without_an_operator_it_stands(watchdog: Watchdog, below: Remembers) -> None:
    watchdog.command(AHEAD)
    watchdog.operator_gone("the terminal has hung up")
    watchdog.observe(SCAN)
    watchdog.command(AHEAD)
    assert below.now == REST
    watchdog.operator_back()
    watchdog.command(AHEAD)
    assert below.now == AHEAD


def test_an_exception_stops_it(below: Remembers) -> None:
    watchdog = Watchdog(below, CONFIG)

    def drive() -> None:
        with watchdog:
            watchdog.command(AHEAD)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        drive()
    assert below.now == REST
    count = len(below.commanded)
    watchdog.close()
    assert len(below.commanded) == count


def test_a_robot_that_cannot_be_stopped_is_told_to_whoever_commands() -> None:
    class Broken:
        def command(self, twist: Twist) -> None:
            if twist == REST and not self.mended:
                raise OSError("no wire")

        mended = False

    broken = Broken()
    with Watchdog(broken, CONFIG) as watchdog:
        watchdog.command(AHEAD)

        def told() -> bool:
            try:
                watchdog.command(AHEAD)
            except RunError as error:
                return "could not be stopped (no wire)" in str(error)
            time.sleep(0.12)
            return False

        assert wait_for(told)
        broken.mended = True


def test_limits_for_a_base_that_has_none(below: Remembers) -> None:
    limited = LimitedActuator(below, SpeedLimits(forward_mps=0.3, backward_mps=0.2, turn_radps=1.0))
    limited.command(Twist(0.5, -2.0))
    limited.command(Twist(-0.5, 0.5))
    assert below.commanded == [Twist(0.3, -1.0), Twist(-0.2, 0.5)]
