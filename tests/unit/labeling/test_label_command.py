import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sdt_tools.cli.label import app
from sdt_tools.errors import LabelError
from sdt_tools.frames import RAYS, LidarScan, MotionClass, MotionCommand, Received, Twist
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter

START_NS = 1_735_689_600_000_000_000


@pytest.fixture
def recordings(tmp_path: Path) -> list[str]:
    for seed in (1, 2):
        with RecordingWriter(tmp_path / f"r{seed}.mcap", SourceInfo("scene", "plain", seed), "") as writer:
            writer.write(Received(START_NS, LidarScan(START_NS, np.ones(RAYS))))
            command = MotionCommand(START_NS, MotionClass.STAY, Twist(0.0, 0.0), "expert", expert=MotionClass.FORWARD)
            writer.write(Received(START_NS, command))
    return [str(tmp_path / f"r{seed}.mcap") for seed in (1, 2)]


def test_several_recordings_are_labelled_at_once(recordings: list[str], tmp_path: Path) -> None:
    labels = tmp_path / "labels"
    result = CliRunner().invoke(app, ["auto", *recordings, "--from", "truth", "--labels", str(labels), "--json"])
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert (document["recordings"], document["labels"], document["appended"]) == (2, 2, 2)
    assert document["counts"]["forward"] == 2
    assert document["journals"] == [str(labels / f"r{seed}.motion.csv") for seed in (1, 2)]
    assert all(Path(journal).is_file() for journal in document["journals"])


def test_people_get_a_table_and_broken_lines_are_told(recordings: list[str], tmp_path: Path) -> None:
    call = ["auto", *recordings, "--from", "command", "--labels", str(tmp_path)]
    assert CliRunner().invoke(app, call).exit_code == 0
    with (tmp_path / "r1.motion.csv").open("a") as journal:
        journal.write("2,bro")
    result = CliRunner().invoke(app, call)
    assert result.stdout == ""
    assert "stay 2, forward 0" in result.stderr
    assert "r1.motion.csv:3: the line is broken off; it is kept, and counts for nothing" in result.stderr


def test_errors_reach_the_boundary(recordings: list[str], tmp_path: Path) -> None:
    call = ["auto", *recordings, "--from", "truth", "--kind", "gesture", "--labels", str(tmp_path)]
    result = CliRunner().invoke(app, call)
    assert isinstance(result.exception, LabelError)
    assert "r1.mcap: no /operator/state in it" in str(result.exception)
