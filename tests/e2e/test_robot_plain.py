"""The emulated robot passes the plain scenario as the scene does."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "unit" / "control"))

from robot_rig import emulated, run

from sdt_tools.control.robot.config import RobotFile
from sdt_tools.control.robot.drive import drive_robot
from sdt_tools.control.robot.opened import open_robot
from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.evaluation.robot_truth import RobotTruth
from sdt_tools.recording.live.drivers import ExpertDriver
from sdt_tools.scene.expert import SceneExpert
from sdt_tools.scene.scenario import layout_for


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1000, 1001, 1002])
def test_the_expert_follows_with_the_emulated_robot(seed: int) -> None:
    with emulated("plain", seed) as robot:
        world = robot.world.world
        expert, truth = SceneExpert(world), RobotTruth(world, layout_for("plain", seed).timeout_s)
        expert.advise()
        file = RobotFile.model_validate(robot.config.model_dump(exclude_none=True))
        with open_robot(file, guarded=True) as opened:
            robot.begin([truth])
            drive_robot(run(file, 60.0, guarded=True), opened, ExpertDriver(expert))
    assert truth.verdict is not None
    assert truth.verdict.outcome is Outcome.OK, truth.text
