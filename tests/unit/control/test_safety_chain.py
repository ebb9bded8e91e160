"""Watchdog, guard, driver and base one beneath the other, over a real socket."""

import time
from collections.abc import Iterator

import numpy as np
import pytest

from sdt_tools.control.guard import ObstacleGuard
from sdt_tools.control.watchdog import Watchdog
from sdt_tools.emergency import EmergencyStop
from sdt_tools.emulation.p3at.ports import TcpPort
from sdt_tools.emulation.p3at.server import EmulatedP3at
from sdt_tools.frames import LidarScan, Received, Twist
from sdt_tools.robot.p3at.base import P3atBase
from sdt_tools.robot.p3at.config import P3atConfig

REST = Twist(0.0, 0.0)


class Chain:
    """A loop at 100 Hz over the chain."""

    def __init__(self, emulated: EmulatedP3at, emergency: EmergencyStop, guard: ObstacleGuard, watchdog: Watchdog):
        self.emulated, self.emergency, self.guard, self.watchdog = emulated, emergency, guard, watchdog

    def run(self, for_s: float, range_m: float = 10.0, scans: bool = True) -> Twist:
        """Drive ahead with a wall all around; how the base moves then."""
        until_s = time.monotonic() + for_s
        while time.monotonic() < until_s:
            if scans:
                scan = Received(time.time_ns(), LidarScan(0, np.full(541, range_m)))
                self.watchdog.observe(scan)
                self.guard.observe(scan)
            self.watchdog.command(Twist(0.4, 0.0))
            time.sleep(0.01)
        return self.emulated.report.velocity


@pytest.fixture
def chain() -> Iterator[Chain]:
    emergency = EmergencyStop()
    with EmulatedP3at(TcpPort("127.0.0.1", 0)) as emulated:
        config = P3atConfig(address=emulated.address, accelerate_mps2=4.0, brake_mps2=4.0, command_lasts_s=30.0)
        with P3atBase(config, emergency) as base:
            guard = ObstacleGuard(base)
            with Watchdog(guard, emergency=emergency) as watchdog:
                yield Chain(emulated, emergency, guard, watchdog)


def stands(chain: Chain) -> bool:
    until_s = time.monotonic() + 3.0
    while chain.emulated.report.velocity != REST and time.monotonic() < until_s:
        time.sleep(0.005)
    return chain.emulated.report.velocity == REST


def test_it_drives_and_a_loop_that_hangs_stops_it(chain: Chain) -> None:
    assert chain.run(0.3) == Twist(0.4, 0.0)
    assert stands(chain)
    assert "no " in chain.watchdog.entries()[0].text


def test_a_lidar_that_is_silent_stops_it(chain: Chain) -> None:
    assert chain.run(0.3) == Twist(0.4, 0.0)
    assert chain.run(0.5, scans=False) == REST


def test_a_wall_stops_it(chain: Chain) -> None:
    assert chain.run(0.3) == Twist(0.4, 0.0)
    assert chain.run(0.4, range_m=0.3) == REST


def test_the_emergency_stop_stops_it_whoever_commands(chain: Chain) -> None:
    assert chain.run(0.3) == Twist(0.4, 0.0)
    chain.emergency.pull("Esc")
    assert chain.run(0.3) == REST
    chain.emergency.release()
    assert chain.run(0.4) == Twist(0.4, 0.0)
