"""README is true: its commands run, small, and it names every verb."""

import gzip
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

from sdt_tools.cli.app import app
from sdt_tools.config import load_config
from sdt_tools.control.robot.config import RobotFile
from sdt_tools.frames import RAYS
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.domain_file import load_domains
from sdt_tools.scene.scenario import layout_for

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SMALLER = {
    "--seconds 20": "--seconds 2",
    "--from 5 --to 12.5": "--from 0.5 --to 1.5",
    "--every 7": "--every 1",
    "seq 0 39": "seq 0 9",
    "--out analysis/practice\n": "--out analysis/practice --val-share 0.5\n",
    "--out analysis/my_follow": "--out analysis/my_follow --epochs 1",
    "seq 100 159": "echo 100 132",
    "--seconds 30": "--seconds 8",
    "--out analysis/gestures": "--out analysis/gestures --val-share 0.5",
    "--out analysis/my_vision": "--out analysis/my_vision --epochs 1 --width 64 --height 48",
    "--out analysis/my_careful_vision": "--out analysis/my_careful_vision --epochs 1 --width 64 --height 48",
    "analysis/my_vision analysis/gestures": "analysis/my_vision analysis/gestures --images 6 --steps 1",
    "--record recordings/summoned.mcap": "--record recordings/summoned.mcap --seconds 2 --fast",
    "my_careful_vision --follow": "my_careful_vision --scenario summoned_plain --seeds 1000 --follow",
    "--seeds 1000-1019": "--seeds 1000-1001",
    "--out analysis/my_certified\n": "--out analysis/my_certified --epochs 2 --delta 1000\n",
    "--write-config emulated_robot.toml": "--no-camera --lidar-port 0 --base-port 0 --write-config emulated_robot.toml",
    "--seconds 10 --out recordings/robot.mcap": "--seconds 1 --out recordings/robot.mcap",
    "--export analysis/my_certified_onnx": "--export analysis/my_certified_onnx --restarts 1 --steps 1",
    "analysis/practice --level 3": "analysis/practice --level 3 --restarts 1 --steps 1 --near-scans 4",
    "--out analysis/suspects.csv": "--out analysis/suspects.csv --folds 2 --epochs 1",
    "--figures": "--figures --scenario plain --seeds 1000",
}


def blocks() -> list[str]:
    found = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
    return [block for block in found if "sdt " in block]


@pytest.fixture
def workplace(tmp_path: Path) -> Path:
    """A folder as README finds it: the demo's network and a drive in CSV are there."""
    folder = tmp_path / "readme"
    folder.mkdir()
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 0)
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    save_checkpoint(folder / "analysis/demo/model/follow-0", network, card)
    rows = np.hstack([np.arange(5)[:, None], np.zeros((5, 2)), np.full((5, RAYS), 2.5), np.zeros((5, 1))])
    with gzip.open(folder / "drive.csv.gz", "wt") as stream:
        np.savetxt(stream, rows, fmt="%g", delimiter=",")
    return folder


def test_the_commands_run_in_the_order_they_are_given(workplace: Path) -> None:
    assert len(blocks()) == 14
    script = "".join(blocks())
    for said, small in SMALLER.items():
        script = script.replace(said, small)
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    call = ["bash", "-euo", "pipefail", "-c", script]
    done = subprocess.run(call, cwd=workplace, env={**os.environ, "PATH": path}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_scenario_can_be_played(tmp_path: Path) -> None:
    (tmp_path / "my_room.toml").write_text(toml_with("mirror ="))
    assert {layout_for(str(tmp_path / "my_room.toml"), seed).name for seed in range(20)} == {"my_room"}


def test_the_yard_can_be_played(tmp_path: Path) -> None:
    (tmp_path / "my_yard.toml").write_text(toml_with("camera ="))
    assert layout_for(str(tmp_path / "my_yard.toml"), 3).camera == "video"


def test_the_robot_can_be_loaded(tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text(toml_with("[base]"))
    robot = load_config(RobotFile, tmp_path / "robot.toml")
    assert robot.base is not None
    assert (robot.base.address, robot.base.limits.forward_mps) == ("/dev/ttyUSB0", 0.5)


def test_the_domains_can_be_loaded(tmp_path: Path) -> None:
    (tmp_path / "shins.toml").write_text(toml_with("[[domain]]"))
    (boxes,) = load_domains(tmp_path / "shins.toml")
    assert len(boxes) == 240


def toml_with(key: str) -> str:
    """The one TOML example that has ``key``."""
    (example,) = [text for text in re.findall(r"```toml\n(.*?)```", README, re.DOTALL) if key in text]
    return example


def test_what_is_made_smaller_is_in_the_readme() -> None:
    text = "".join(blocks())
    assert [said for said in SMALLER if said not in text] == []


def test_every_verb_is_in_the_table() -> None:
    named = set(re.findall(r"^\| `sdt ([a-z0-9 -]+)`", README, re.MULTILINE))
    assert named == set(calls(get_command(app)))


def calls(command: object) -> Iterator[str]:
    """The words that lead to each command below ``command``."""
    for name, below in getattr(command, "commands", {}).items():
        yield from (f"{name} {words}" for words in calls(below)) if hasattr(below, "commands") else [name]


def test_links_to_files_lead_somewhere() -> None:
    targets = re.findall(r"\]\(((?!https?:)[^)]+)\)", README)
    assert targets
    assert [target for target in targets if not (ROOT / target).exists()] == []
