"""Data sets from what people did when they took over."""

import tomllib
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from labelled_recordings import CLASSES, SCAN_PERIOD_NS, START_NS, make_labels, ranges_m, recording_id

from sdt_tools.cli.app import app
from sdt_tools.config import MotionConfig
from sdt_tools.dataset.build import build_dataset
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.interventions import read_interventions, with_interventions
from sdt_tools.dataset.load import load_dataset
from sdt_tools.errors import DatasetError, UsageError
from sdt_tools.frames import LidarScan, Mode, MotionClass, MotionCommand, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter


def stamp_ns(scan: int) -> int:
    return START_NS + scan * SCAN_PERIOD_NS


def make_drive(path: Path, seed: int, taken_over: range, scans: int = 300) -> Path:
    """A policy that drives forward, ten commands a second; in ``taken_over`` a person drives back."""
    with RecordingWriter(path, SourceInfo("scene", "plain", seed), "") as writer:
        for scan in range(scans):
            at_ns = stamp_ns(scan)
            writer.write(Received(at_ns, LidarScan(at_ns, ranges_m(seed, scan))))
            if scan % 5 == 0:
                by_hand = scan in taken_over
                motion = MotionClass.BACKWARD if by_hand else MotionClass.FORWARD
                driver = "keyboard" if by_hand else "policy:follow-0"
                twist = MotionConfig().twist(motion)
                writer.write(Received(at_ns, MotionCommand(at_ns, motion, twist, driver, intervention=by_hand)))
    return path


@pytest.fixture
def drives(tmp_path: Path) -> list[Path]:
    return [make_drive(tmp_path / f"d{seed}.mcap", seed, range(100, 200)) for seed in range(4)]


def test_only_the_frames_of_the_takeover_are_taken_and_no_journal_is_needed(drives: list[Path], tmp_path: Path) -> None:
    config = DatasetConfig(interventions="only", balanced=False, spacing_s=0.1, per_recording_cap=None, val_share=0.3)
    summary = build_dataset(drives, tmp_path / "labels", config, tmp_path / "set")
    assert summary.interventions == 4 * 20
    dataset = load_dataset(tmp_path / "set")
    for frames in (dataset.train, dataset.val):
        assert {CLASSES[label] for label in frames.labels} == {"backward"}
        assert set(frames.stamps_ns) == {stamp_ns(scan) for scan in range(100, 200, 5)}
    manifest = tomllib.loads((tmp_path / "set" / "manifest.toml").read_text())
    assert manifest["config"]["interventions"] == "only"
    assert {(entry["journal"], entry["interventions"]) for entry in manifest["recordings"]} == {("", 20)}
    np.testing.assert_array_equal(
        dataset.train.ranges_m[0],
        ranges_m(
            int(str(dataset.train.recordings[0])[1:]), int(dataset.train.stamps_ns[0] - START_NS) // SCAN_PERIOD_NS
        ),
    )


def test_beside_labels_people_go_first_then_interventions_then_the_rest(tmp_path: Path) -> None:
    drive = make_drive(tmp_path / "d.mcap", 1, range(100, 120))
    make_labels(drive, recording_id(drive), [(stamp_ns(scan), "stay") for scan in range(90, 130, 5)])
    make_labels(drive, recording_id(drive), [(stamp_ns(105), "left_forward")], source="human")
    from sdt_tools.dataset.candidates import read_labelled

    config = DatasetConfig(interventions="also")
    pool = read_labelled(drive, tmp_path / "labels", config).pool
    said = {
        (int(at) - START_NS) // SCAN_PERIOD_NS: CLASSES[label]
        for at, label in zip(pool.stamps_ns, pool.labels, strict=True)
    }
    assert said == {
        90: "stay",
        95: "stay",
        100: "backward",
        105: "left_forward",
        110: "backward",
        115: "backward",
        120: "stay",
        125: "stay",
    }
    pool = read_labelled(drive, tmp_path / "labels", DatasetConfig()).pool
    assert {CLASSES[label] for label in pool.labels} == {"stay", "left_forward"}


def test_disputed_stamps_stay_out() -> None:
    labels = pl.DataFrame({"stamp_ns": [1], "label": ["stay"], "source": ["truth"]})
    interventions = pl.DataFrame({"stamp_ns": [1, 2], "label": ["forward", "forward"]})
    disputed = pl.DataFrame({"stamp_ns": [2], "labeler": ["anna"], "label": ["stay"]})
    assert with_interventions(labels, interventions, disputed).rows() == [(1, "forward")]


def test_stops_and_idle_commands_are_no_interventions_to_learn_from(tmp_path: Path) -> None:
    path, twist = tmp_path / "d.mcap", MotionConfig().twist(MotionClass.STAY)
    with RecordingWriter(path, SourceInfo("scene", "plain", 1), "") as writer:
        for stamp, driver, mode in ((1, STOP, Mode.ACTIVE), (2, "keyboard", Mode.IDLE), (3, "keyboard", Mode.ACTIVE)):
            command = MotionCommand(stamp, MotionClass.STAY, twist, driver, mode, intervention=True)
            writer.write(Received(stamp, command))
    with Recording.open(path) as recording:
        assert read_interventions(recording).rows() == [(3, "stay")]


def test_where_nobody_took_over_one_line_says_so(tmp_path: Path) -> None:
    drives = [make_drive(tmp_path / f"d{seed}.mcap", seed, range(0)) for seed in range(2)]
    with pytest.raises(DatasetError, match="nobody took over in these recordings"):
        build_dataset(drives, tmp_path, DatasetConfig(interventions="only"), tmp_path / "set")
    assert not (tmp_path / "set").exists()


def test_the_command_builds_such_a_set(drives: list[Path], tmp_path: Path) -> None:
    from typer.testing import CliRunner

    call = ["dataset", "build", *map(str, drives), "--out", str(tmp_path / "set"), "--as-recorded", "--json"]
    told = CliRunner().invoke(app, [*call, "--interventions"]).stdout
    assert '"interventions": 80' in told
    both = CliRunner().invoke(app, [*call, "--interventions", "--with-interventions"])
    assert isinstance(both.exception, UsageError)
