"""The whole doctor, as a user runs it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = "from sdt_tools.cli.app import main; main()"


@pytest.mark.slow
def test_all_is_looked_at_and_what_was_asked_for_fails(tmp_path: Path) -> None:
    command = [sys.executable, "-c", PROGRAM, "doctor", "--json", "--lidar", "127.0.0.1:9"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    document = json.loads(done.stdout)
    assert done.returncode == 1
    sections = {one["section"] for one in document["findings"]}
    assert {
        "system",
        "packages",
        "disk",
        "clock",
        "lidar",
        "base",
        "serial",
        "gamepad",
        "rerun",
        "terminal",
    } <= sections
    (lidar,) = [one for one in document["findings"] if one["section"] == "lidar"]
    assert (lidar["level"], lidar["do"]) == ("fail", "an LMS1xx listens at 2111 and 2112, once it has started")
    assert str(Path.home()) + "/" not in done.stdout
    assert list(tmp_path.iterdir()) == []
