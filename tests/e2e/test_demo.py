import json
import subprocess
import sys
from pathlib import Path

import pytest
import rerun.chunk
from mcap.reader import make_reader

pytestmark = pytest.mark.xdist_group("demo")  # one demo for all of them
SDT = Path(sys.executable).with_name("sdt")
SMALL = """
practice_recordings = 24
practice_seconds = 6.0
camera_recordings = 1
camera_seconds = 2.0
closed_loop_runs = 2
[dataset]
val_share = 0.3
[training.loop]
epochs = 2
"""
KEYS = {
    "recordings",
    "frames",
    "dropped_frames",
    "train_frames",
    "val_frames",
    "val_accuracy",
    "closed_loop",
    "real_time_factor",
    "replay_frames_per_s",
    "tags",
    "rrd",
    "report",
    "seconds",
}


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, object]]:
    folder = tmp_path_factory.mktemp("demo")
    config = folder / "small.toml"
    config.write_text(SMALL)
    return folder / "out", run(folder / "out", config)


def run(out: Path, config: Path) -> dict[str, object]:
    call = [SDT, "demo", "--out", out, "--config", config, "--workers", "1", "--json"]
    document: dict[str, object] = json.loads(subprocess.run(call, capture_output=True, check=True).stdout)
    return document


def scans_in(recording: Path) -> int:
    with recording.open("rb") as stream:
        return sum(1 for _ in make_reader(stream).iter_messages(topics=["/lidar/scan"]))


def test_the_summary_holds_what_is_promised_and_lies_beside_the_report(demo: tuple[Path, dict[str, object]]) -> None:
    out, summary = demo
    assert set(summary) >= KEYS
    assert json.loads((out / "summary.json").read_text()) == summary
    recordings = list((out / "recordings").rglob("*.mcap"))
    assert summary["recordings"] == len(recordings) == 25
    assert summary["frames"] == sum(scans_in(path) for path in recordings)
    assert summary["closed_loop"]["plain"]["runs"] == 2
    tags = summary["tags"]
    assert isinstance(tags, dict)
    assert set(tags) == {"systematic", "conditional", "transient", "isolated", "unexplained", "correct"}


def test_every_picture_that_the_report_shows_is_there(demo: tuple[Path, dict[str, object]]) -> None:
    out, _ = demo
    lines = (out / "report.md").read_text().splitlines()
    links = [line.split("](")[1].rstrip(")") for line in lines if line.startswith("![")]
    assert len(links) == 4
    assert all((out / link).read_bytes().startswith(b"\x89PNG") for link in links)


def test_the_view_holds_scans_images_and_predictions(demo: tuple[Path, dict[str, object]]) -> None:
    _, summary = demo
    rows: dict[str, int] = {}
    for chunk in rerun.chunk.RrdReader(str(summary["rrd"])).stream():
        rows[chunk.entity_path] = rows.get(chunk.entity_path, 0) + chunk.num_rows
    assert any("scan" in path or "lidar" in path for path, count in rows.items() if count >= 100)
    assert any("camera" in path for path, count in rows.items() if count >= 60)


def test_a_second_run_does_nothing_again(demo: tuple[Path, dict[str, object]]) -> None:
    out, first = demo
    made = {path: path.stat().st_mtime_ns for path in out.rglob("unit.json")}
    second = run(out, out.parent / "small.toml")
    assert {path: path.stat().st_mtime_ns for path in out.rglob("unit.json")} == made
    assert {**second, "seconds": 0} == {**first, "seconds": 0}
