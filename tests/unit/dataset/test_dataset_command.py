import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from labelled_recordings import MS, START_NS, make_labelled, make_labels, recording_id
from typer.testing import CliRunner

from sdt_tools.cli.dataset import app
from sdt_tools.dataset.load import load_dataset
from sdt_tools.errors import ConfigError, DatasetError
from sdt_tools.frames import RAYS, LidarScan, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter


def build(folder: Path, *options: str) -> Result:
    recordings = sorted(str(path) for path in folder.glob("*.mcap"))
    places = ["--labels", str(folder / "labels"), "--out", str(folder / "set")]
    return CliRunner().invoke(app, ["build", *recordings, *places, *options])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for seed in range(4):
        make_labelled(tmp_path, seed)
    return tmp_path


def test_options_go_before_the_file_and_the_document_says_what_was_built(folder: Path) -> None:
    (folder / "config.toml").write_text("train_frames = 21\nval_frames = 7\nspacing_s = 0.5\n")
    result = build(
        folder, "--config", str(folder / "config.toml"), "--train-frames", "14", "--val-share", "0.5", "--json"
    )
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    dataset = load_dataset(folder / "set")
    assert document["train_frames"] == len(dataset.train) == 14
    assert document["val_frames"] == len(dataset.val) == 7
    assert document["hash"] == dataset.hash
    assert document["conflicts"] == 0
    assert dataset.manifest["config"]["spacing_s"] == 0.5
    assert dataset.manifest["conflicts"]["checked"]


def test_people_get_counts_by_class(folder: Path) -> None:
    result = build(folder, "--as-recorded")
    assert result.stdout == ""
    assert "right_backward" in result.stderr
    assert "set from 4 recordings, hash" in result.stderr


@pytest.mark.parametrize(
    ("file", "options", "message"),
    [
        ("spacing = 1", [], r"config\.toml: unknown key 'spacing'; did you mean 'spacing_s'"),
        ("", ["--val-share", "1.5"], "--val-share: input should be less than 1"),
        ("", ["--conflict-level", "7"], "--conflict-level: input"),
    ],
)
def test_a_wrong_setting_is_named_with_its_place(folder: Path, file: str, options: list[str], message: str) -> None:
    (folder / "config.toml").write_text(file)
    result = build(folder, "--config", str(folder / "config.toml"), *options)
    assert isinstance(result.exception, ConfigError)
    with pytest.raises(ConfigError, match=message):
        raise result.exception


def too_close(folder: Path, seed: int, near_m: float, label: str) -> None:
    """A recording with one front ray at ``near_m``, the others at two metres."""
    ranges_m = np.full(RAYS, 2.0)
    ranges_m[200] = near_m
    path = folder / f"r{seed}.mcap"
    with RecordingWriter(path, SourceInfo("scene", "plain", seed), "") as writer:
        writer.write(Received(START_NS, LidarScan(START_NS, ranges_m)))
        writer.write(Received(START_NS + 400 * MS, LidarScan(START_NS + 400 * MS, np.full(RAYS, 2.0))))
    make_labels(path, recording_id(path), [(START_NS, label), (START_NS + 400 * MS, "forward")])


def test_a_near_object_with_a_forward_label_is_a_conflict(tmp_path: Path) -> None:
    too_close(tmp_path, 0, 0.1, "left_forward")
    too_close(tmp_path, 1, 0.1, "backward")
    result = build(tmp_path, "--as-recorded")
    assert isinstance(result.exception, DatasetError)
    refusal = f"in a safety domain of level 3 that forbids their label: 1 (r0 at {START_NS} ns (left_forward))"
    assert refusal in str(result.exception)
    allowed = build(tmp_path, "--as-recorded", "--allow-conflicts")
    assert "frames in a safety domain with a label that it forbids, listed in the manifest: 1" in allowed.stderr
    conflict = {"recording": "r0", "stamp_ns": START_NS, "label": "left_forward"}
    assert load_dataset(tmp_path / "set").manifest["conflicts"]["frames"] == [conflict]


def test_a_code_is_no_near_object(tmp_path: Path) -> None:
    for seed in (0, 1):
        too_close(tmp_path, seed, 0.0, "forward")
    result = build(tmp_path, "--as-recorded", "--json")
    assert json.loads(result.stdout)["conflicts"] == 0


def test_level_0_forbids_nothing(tmp_path: Path) -> None:
    for seed in (0, 1):
        too_close(tmp_path, seed, 0.1, "forward")
    result = build(tmp_path, "--as-recorded", "--conflict-level", "0", "--json")
    assert json.loads(result.stdout)["conflicts"] == 0
