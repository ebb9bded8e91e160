"""``sdt record``, ``sdt inspect`` and ``sdt import`` as a user calls them."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sdt_tools.cli.app import main
from sdt_tools.cli.recording_progress import describe
from sdt_tools.frames import MotionCommand
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import load_checkpoint, save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.recording.live.outcome import RecordingProgress
from sdt_tools.recording.reader import Recording

SHORT = ["record", "scene", "--scenario", "plain", "--seed", "7", "--no-camera"]


def sdt(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    """The exit code of ``sdt`` with ``arguments``."""
    monkeypatch.setattr(sys, "argv", ["sdt", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    code = ended.value.code
    return code if isinstance(code, int) else 0


def test_record_then_inspect(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "x.mcap"
    assert sdt(monkeypatch, *SHORT, "--seconds", 3, "--out", out, "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["frames"]["/lidar/scan"] == 150
    assert told["frames"]["/robot/command"] == 30
    assert told["dropped"] == {"/camera/image": 0, "/lidar/scan": 0}
    assert told["size_bytes"] == out.stat().st_size

    assert sdt(monkeypatch, "inspect", out, "--json") == 0
    report = json.loads(capsys.readouterr().out)
    scans = report["topics"]["/lidar/scan"]
    assert scans.items() >= {"schema": "foxglove.LaserScan", "count": 150, "hz": 50.0, "gaps": 0, "drops": 0}.items()
    assert (scans["max_gap_ms"], report["health"], report["truncated"]) == (20.0, "good", False)
    assert report["pairs"]["count"] == 0  # without a camera
    assert report["recording_id"] == told["recording_id"]
    assert (report["session"]["scenario"], report["session"]["seed"]) == ("plain", "7")
    assert "seed = 7" in report["config"]

    assert sdt(monkeypatch, "inspect", out, "--full", "--plot", tmp_path / "timing.png") == 0
    assert (tmp_path / "timing.png").exists()
    table = capsys.readouterr().err
    assert "good (counted from the messages)" in table
    assert "/lidar/scan" in table
    assert "50.00" in table


def test_the_same_options_give_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("one", "two"):
        assert sdt(monkeypatch, *SHORT, "--seconds", 2, "--perturb", "--out", tmp_path / name) == 0
    assert sdt(monkeypatch, *SHORT, "--seconds", 2, "--out", tmp_path / "other") == 0
    one, two, other = ((tmp_path / name).read_bytes() for name in ("one", "two", "other"))
    assert one == two != other


def test_a_constant_driver_drives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "x.mcap"
    assert sdt(monkeypatch, *SHORT, "--seconds", 1, "--driver", "constant:backward", "--out", out) == 0
    with Recording.open(out) as recording:
        commands = [received.message for received in recording.messages(["/robot/command"])]
    assert {(c.motion.label, c.driver) for c in commands} == {("backward", "constant:backward")}


def test_a_network_drives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=1).eval()
    card = ModelCard(kind=FollowNet.kind, seed=1, architecture=network.architecture, preprocess=network.preprocess)
    save_checkpoint(tmp_path / "untrained", network, card)
    out = tmp_path / "x.mcap"
    driver = f"policy:{tmp_path / 'untrained'}"
    assert sdt(monkeypatch, *SHORT, "--seconds", 1, "--driver", driver, "--out", out) == 0
    with Recording.open(out) as recording:
        commands = [m.message for m in recording.messages(["/robot/command"])]
        scans = recording.scans()
    answers = load_checkpoint(tmp_path / "untrained").predict_logits(scans.ranges_m).argmax(axis=1)
    assert len(commands) == 10
    for command in commands:
        assert isinstance(command, MotionCommand)
        assert command.motion == answers[np.searchsorted(scans.stamps_ns, command.stamp_ns)]
        assert command.driver == "policy:untrained"


def test_progress_is_one_line_with_rates_and_losses() -> None:
    counts = {"/lidar/scan": 300, "/camera/image": 180, "/tf": 1}
    now = RecordingProgress(6.0, 60.0, 2.0, counts, 9_400_000, dropped=3, missed_deadlines=0)
    assert describe(now) == "6.0 s, 150 scans/s, 90 images/s, 9.4 MB, 3 dropped"


def test_progress_tells_of_pauses_of_what_is_missing_and_how_long_the_disk_lasts() -> None:
    now = RecordingProgress(6.0, None, 6.0, {}, 9_400_000, 0, 0, missing=2, disk_left_s=7200.0, state="take_001 paused")
    assert describe(now) == "take_001 paused, 6.0 s, 9.4 MB, 2 missing, disk 2.0 h"
    assert describe(replace(now, disk_left_s=150.0)).endswith("DISK FULL IN 2.5 min")


def test_ctrl_c_in_real_time_leaves_a_whole_file(tmp_path: Path) -> None:
    out = tmp_path / "x.mcap"
    command = [sys.executable, "-c", "from sdt_tools.cli.app import main; main()"]
    recorder = subprocess.Popen(
        [*command, *SHORT, "--seconds", "60", "--realtime", "--out", out, "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    try:
        while recorder.poll() is None and not (out.exists() and out.stat().st_size > 10_000):
            time.sleep(0.02)
        recorder.send_signal(signal.SIGINT)
        told = json.loads(recorder.communicate(timeout=30)[0])
    finally:
        recorder.kill()
        recorder.wait()
    assert recorder.returncode == 0
    assert told["interrupted"]
    with Recording.open(out) as recording:
        assert not recording.truncated
        assert len(recording.scans()) == told["frames"]["/lidar/scan"] > 0
        first = next(recording.messages(["/lidar/scan"]))
    assert abs(first.received_ns - time.time_ns()) < 120 * 10**9


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["inspect", "missing.mcap"], "missing.mcap: no such recording; check the path"),
        (["inspect", "text.mcap"], "text.mcap: not an MCAP file"),
        (["inspect", "."], "is a folder"),
        ([*SHORT, "--seconds", "1", "--out", "text.mcap"], "text.mcap exists already"),
        (["record", "scene", "--scenario", "plian", "--out", "x.mcap"], "unknown scenario 'plian'"),
        ([*SHORT, "--driver", "ghost", "--out", "x.mcap"], "--driver ghost: no such driver; choose expert"),
        ([*SHORT, "--driver", "constant:up", "--out", "x.mcap"], "no such motion class; the classes are stay, forward"),
        ([*SHORT, "--driver", "policy:nowhere", "--out", "x.mcap"], "nowhere: no such checkpoint"),
        ([*SHORT, "--config", "bad.toml", "--out", "x.mcap"], "unknown key 'lingers'; did you mean 'linger_s'?"),
        (["import", "lidar-csv", "text.mcap", "--hz", "25", "--out", "x.mcap"], "line 1 has 2 columns, 545 expected"),
        (["import", "lidar-csv", "no.csv", "--hz", "25", "--out", "x.mcap"], "no.csv: no such file"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("text.mcap").write_text("0,1\n")
    Path("bad.toml").write_text("lingers = 3\n")
    assert sdt(monkeypatch, *arguments) == 2
    said = capsys.readouterr().err.strip()
    assert message in said
    assert len(said.splitlines()) == 1
    assert Path("text.mcap").read_text() == "0,1\n"
    assert not Path("x.mcap").exists()


def test_a_real_drive_imports_and_opens(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    data = os.environ.get("SDT_DATA")
    if not data:
        pytest.skip("SDT_DATA is not set: the real drives are elsewhere")
    drive = Path(data) / "p3at_lms1xx" / "trace_0001.csv.gz"
    assert sdt(monkeypatch, "import", "lidar-csv", drive, "--hz", 25, "--out", tmp_path / "r.mcap", "--json") == 0
    assert json.loads(capsys.readouterr().out)["scans"] == 265
