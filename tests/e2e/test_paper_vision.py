"""The vision study from recordings to report, as small as it can be: what is tested is that its stages fit together."""

import json
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

from sdt_tools.scene.scenario import STANDARD_VISION

pytestmark = pytest.mark.slow
SDT = Path(sys.executable).with_name("sdt")
SMALL = """
training_seeds = 1
epsilons = [0, 2]
plain_epochs = 1
attacked_epochs = 3
width = 96
height = 64
attacked_images = 6
runs = 1
[practice]
worlds = 12
seconds = 12.0
[unseen]
first_seed = 1000
worlds = 4
seconds = 12.0
[data]
kind = "gesture"
train_frames = 60
"""


def study(out: Path, config: Path) -> dict[str, object]:
    call = [SDT, "paper", "vision", "--out", out, "--config", config, "--json"]
    document: dict[str, object] = json.loads(subprocess.run(call, capture_output=True, check=True).stdout)
    return document


def test_the_study_goes_through_and_a_rerun_repeats_nothing(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    out = tmp_path / "study"

    document = study(out, tmp_path / "small.toml")
    made = {path: path.stat().st_mtime_ns for path in out.rglob("unit.json")}
    again = study(out, tmp_path / "small.toml")

    assert again == document
    assert {path: path.stat().st_mtime_ns for path in out.rglob("unit.json")} == made
    assert set(document["mode_errors"]["epsilon2"]) == set(STANDARD_VISION)  # type: ignore[index]
    assert pl.read_parquet(out / "networks.parquet")["family"].to_list() == ["epsilon0", "epsilon2", "control"]
    assert len(pl.read_parquet(out / "runs.parquet")) == 14
    assert {path.name for path in out.glob("*.png")} == {"vision_attack.png", "vision_errors.png"}
    assert not list((out / "unfinished").iterdir())
