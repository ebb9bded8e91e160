"""The follow study from recordings to report, as small as it can be: what is tested is that its stages fit together."""

import json
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

pytestmark = pytest.mark.slow
SDT = Path(sys.executable).with_name("sdt")
SMALL = """
training_seeds = 2
large_epochs = 1
paper_epochs = 2
runs = 1
swept_weights = [0.3]
sweep_seeds = 1
[practice]
worlds = 40
too_close = 10
world_seconds = 6.0
courses = 6
[unseen]
first_seed = 1000
worlds = 40
too_close = 10
world_seconds = 6.0
courses = 6
[aggregation]
rounds = 1
epochs = 1
seconds = 10.0
frames = 70
[paper_data]
train_frames = 70
val_frames = 14
[large_data]
train_frames = 140
val_frames = 28
[certify.attack]
restarts = 1
steps = 2
[searched_hard.attack]
restarts = 2
steps = 2
"""


def study(out: Path, config: Path) -> dict[str, object]:
    call = [SDT, "paper", "follow", "--out", out, "--config", config, "--json"]
    document: dict[str, object] = json.loads(subprocess.run(call, capture_output=True, check=True).stdout)
    return document


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, dict[str, object]]:
    folder = tmp_path_factory.mktemp("study")
    config = folder / "small.toml"
    config.write_text(SMALL)
    return folder / "out", config, study(folder / "out", config)


def test_a_small_study_runs_from_recordings_to_report_and_resumes(made: tuple[Path, Path, dict[str, object]]) -> None:
    out, config, document = made
    networks = pl.read_parquet(out / "networks.parquet")
    assert len(networks) == 2 * 7 + 3
    assert set(networks.filter(pl.col("level") > 0)["domains"]) == {240}
    runs = pl.read_parquet(out / "runs.parquet")
    assert len(runs) == 14 * 7
    assert runs["seed"].min() >= 2000
    assert {path.name for path in out.glob("*.png")} == {f"follow_{n}.png" for n in ("scenarios", "lambda", "trade")}
    written = {path: path.stat().st_mtime_ns for path in out.glob("models/*/unit.json")}
    again = study(out, config)
    assert again["levels"] == document["levels"]
    assert {path: path.stat().st_mtime_ns for path in out.glob("models/*/unit.json")} == written


def test_validation_frames_come_from_worlds_that_nothing_learns_from(
    made: tuple[Path, Path, dict[str, object]],
) -> None:
    out, _, _ = made
    for frames in out.glob("data/*/data/frames.parquet"):
        seeds = pl.read_parquet(frames, columns=["split", "recording"]).with_columns(
            pl.col("recording").str.extract(r"_(\d{4})").cast(int).alias("seed")
        )
        if "pilot" in str(frames):
            assert seeds["seed"].max() < 1000
        else:
            assert set(seeds.filter(pl.col("split") == "val")["seed"] >= 1000) == {True}
            assert set(seeds.filter(pl.col("split") == "train")["seed"] < 1000) == {True}
