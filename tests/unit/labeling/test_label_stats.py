import json
from pathlib import Path

import pytest
from labeling_samples import record, say
from typer.testing import CliRunner

from sdt_tools.cli.label import app
from sdt_tools.labeling.acts import HEADER
from sdt_tools.labeling.stats import label_stats
from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelKind, LabelSource


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    drive = record(tmp_path / "drive.mcap", 50, camera=False)
    say(tmp_path, drive, "anna", range(20), "forward")
    say(tmp_path, drive, "ben", range(15), "forward")
    say(tmp_path, drive, "ben", range(15, 25), "stay")
    say(tmp_path, drive, SETTLED_BY + "carol", range(18, 20), "stay")
    say(tmp_path, drive, "scene", range(0, 50, 5), "forward", LabelSource.TRUTH)
    return drive


def test_people_and_prelabels_are_counted_apart(drive: Path, tmp_path: Path) -> None:
    found = label_stats(drive, LabelKind.MOTION, tmp_path)
    assert (found.frames, found.human, found.resolved, found.conflicts, found.settled) == (50, 25, 27, 3, 2)
    assert (found.human_counts["forward"], found.human_counts["stay"]) == (15, 7)
    assert found.prelabel_counts["forward"] == 10
    assert (found.against_prelabels, found.both) == (1, 4)  # frame 20: ben stays, the truth goes
    assert found.words == {"anna (human)": 20, "ben (human)": 25, "settled:carol (human)": 2, "scene (truth)": 10}
    (pair,) = found.agreement.pairs
    assert (pair.frames, pair.agreed, pair.kappa) == (20, 15, 0.0)


def test_a_recording_that_nobody_has_labelled(tmp_path: Path) -> None:
    found = label_stats(record(tmp_path / "new.mcap", 5), LabelKind.GESTURE, tmp_path)
    assert (found.frames, found.human, found.resolved, found.agreement.pairs) == (3, 0, 0, ())


def test_people_read_a_table_and_machines_one_document(drive: Path, tmp_path: Path) -> None:
    call = ["stats", str(drive), "--labels", str(tmp_path)]
    result = CliRunner().invoke(app, call)
    assert result.stdout == ""
    for words in ("25 (50%)", "1 of 4", "anna and ben: 15 of 20 frames alike, Cohen's κ 0.000", "Krippendorff's α"):
        assert words in result.stderr
    document = json.loads(CliRunner().invoke(app, [*call, "--json"]).stdout)
    assert document["recordings"][0]["agreement"]["pairs"][0]["kappa"] == 0.0


def test_strange_and_broken_lines_are_told(drive: Path, tmp_path: Path) -> None:
    journal = tmp_path / "drive.motion.csv"
    recording_id = journal.read_text().splitlines()[1].split(",")[1]
    journal.write_bytes(HEADER + f"1,{recording_id},77,stay,anna,human,0\n2,{recording_id},8".encode())
    result = CliRunner().invoke(app, ["stats", str(drive), "--labels", str(tmp_path)])
    assert "1 acts are about no frame of the recording" in result.stderr
    assert "drive.motion.csv:3: the line is broken off" in result.stderr
