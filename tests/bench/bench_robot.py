"""From a scan's arrival to its command on the wire to the base, with a follow network, over real sockets.

The emulated robot runs in a process of its own. ``SDT_SOAK_S`` sets the seconds; without it, twenty.
"""

import multiprocessing
import os
import sys
from multiprocessing.connection import Connection
from pathlib import Path

from pytest_benchmark.fixture import BenchmarkFixture

sys.path.append(str(Path(__file__).parents[1] / "unit" / "control"))

from robot_rig import emulated, run

from sdt_tools.control.latency import Latency
from sdt_tools.control.policy import PolicyDriver
from sdt_tools.control.robot.config import RobotFile
from sdt_tools.control.robot.drive import drive_robot, warm_up
from sdt_tools.control.robot.opened import open_robot
from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig

SECONDS = float(os.environ.get("SDT_SOAK_S", "20"))


def be_robot(pipe: Connection) -> None:
    with emulated() as robot:
        robot.begin()
        pipe.send(robot.config)
        pipe.recv()


def test_scan_to_wire(benchmark: BenchmarkFixture) -> None:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    device = context.Process(target=be_robot, args=(theirs,), daemon=True)
    device.start()
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 0)
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    driver = PolicyDriver(LoadedModel("bench", network, card))
    file = RobotFile.model_validate(ours.recv().model_dump(exclude_none=True))
    warm_up(driver)

    def drive() -> Latency:
        with open_robot(file, guarded=True) as opened:
            return drive_robot(run(file, SECONDS, guarded=True), opened, driver).latency

    latency = benchmark.pedantic(drive, rounds=1)
    ours.send("end")
    device.join()
    benchmark.extra_info.update(
        count=latency.count, p50_ms=latency.p50_ms, p99_ms=latency.p99_ms, max_ms=latency.max_ms
    )
    assert latency.p99_ms is not None
    assert latency.p99_ms <= 10
