"""Unplugging a device while its driver is checked: the person is asked, and the driver's remark is timed."""

import numpy as np
import pytest

from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.frames import RAYS
from sdt_tools.robot.contract.check import Plan, check
from sdt_tools.robot.contract.verdict import Outcome
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.plugins import lidar_named


class Wall:
    def ranges_at(self, host_ns: int) -> np.ndarray:
        return np.full(RAYS, 2.0)


@pytest.mark.slow  # in real time: where a machine is busy the remark can pass by unseen
def test_a_cable_is_pulled_and_plugged_in_again() -> None:
    asked = []
    with EmulatedLms1xx(Wall(), EmulatedConfig(port=0)) as emulator:

        def person(line: str) -> None:
            asked.append(line)
            emulator.unplug(line.startswith("unplug"))

        config = Lms1xxConfig(host="127.0.0.1", port=emulator.port, protocol="a")
        verdicts = list(check(lidar_named("lms1xx"), config, Plan(seconds=0.3, unplug=person)))
    assert asked == ["unplug the device now (its power or its cable)", "plug it in again"]
    (silence,) = [one for one in verdicts if one.rule.startswith("silence is told within 200 ms")]
    assert silence.outcome is not Outcome.OPEN
    assert silence.seen.startswith("told after ")
    assert float(silence.seen.split()[2]) < 500  # a busy machine adds to its 160 ms
