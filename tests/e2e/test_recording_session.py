"""``sdt record scene --session`` at a terminal, and how signals and a hang-up end a recording."""

import json
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader
from terminal_rig import LONGEST_S, Terminal
from typer.testing import CliRunner

from sdt_tools.cli.app import app
from sdt_tools.errors import SdtError
from sdt_tools.recording.inspect import inspect_recording
from sdt_tools.recording.live.session_folder import ChangedConfigError
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.repair import repair_recording

SDT = [sys.executable, "-c", "from sdt_tools.cli.app import main; main()"]
SHORT = ["record", "scene", "--scenario", "plain", "--seed", "7", "--no-camera"]


def until(happens: Callable[[], bool], what: str) -> None:
    """Wait until something has happened."""
    end_s = time.monotonic() + LONGEST_S
    while not happens():
        assert time.monotonic() < end_s, what
        time.sleep(0.02)


def takes(folder: Path) -> list[dict[str, object]]:
    """What ``session.toml`` lists."""
    path = folder / "session.toml"
    return tomllib.loads(path.read_text()).get("takes", []) if path.exists() else []


def grows(path: Path) -> bool:
    return path.exists() and path.stat().st_size > 20_000


def messages_in(path: Path) -> int:
    with path.open("rb") as file:
        return sum(1 for _ in make_reader(file, validate_crcs=True).iter_messages())


def test_takes_under_single_keys(tmp_path: Path, at_terminal: Callable[..., Terminal]) -> None:
    folder = tmp_path / "s"
    terminal = at_terminal(*SHORT, "--realtime", "--session", folder)
    terminal.until(lambda: grows(folder / "take_001.mcap"), "no take")
    assert not terminal.restored
    assert "n next take" in terminal.look()
    terminal.press("mn")
    terminal.until(lambda: grows(folder / "take_002.mcap"), "no second take")
    terminal.press("x")
    terminal.until(lambda: len(takes(folder)) == 2 and bool(takes(folder)[1].get("trash")), "not discarded")
    terminal.press("q")
    assert terminal.end() == 0
    assert terminal.restored
    assert "take_001.mcap" in terminal.look()
    first, second = takes(folder)
    assert first["ending"] == "stopped"
    assert messages_in(folder / "take_001.mcap") == first["messages"]
    assert messages_in(folder / str(second["trash"]) / "take_002.mcap") == second["messages"]
    with Recording.open(folder / "take_001.mcap") as recording:
        assert "mark 1" in [m.message.text for m in recording.messages(["/session/log"])]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_gives_the_terminal_back(
    tmp_path: Path, at_terminal: Callable[..., Terminal], number: signal.Signals
) -> None:
    folder = tmp_path / "s"
    terminal = at_terminal(*SHORT, "--realtime", "--session", folder)
    terminal.until(lambda: grows(folder / "take_001.mcap"), "no take")
    terminal.process.send_signal(number)
    assert terminal.end() == (0 if number == signal.SIGINT else 128 + number)
    assert terminal.restored
    assert takes(folder)[0]["ending"] == ("interrupted" if number == signal.SIGINT else "terminated")


def test_a_terminal_that_hangs_up_leaves_a_whole_take(tmp_path: Path, at_terminal: Callable[..., Terminal]) -> None:
    folder = tmp_path / "s"
    terminal = at_terminal(*SHORT, "--realtime", "--session", folder)
    terminal.until(lambda: grows(folder / "take_001.mcap"), "no take")
    terminal.hang_up()
    assert terminal.process.wait(LONGEST_S) == 128 + signal.SIGHUP
    (take,) = takes(folder)
    assert take["ending"] == "hangup"
    assert messages_in(folder / "take_001.mcap") == take["messages"]


def test_a_pause_of_a_take_that_was_killed_is_no_gap(tmp_path: Path, at_terminal: Callable[..., Terminal]) -> None:
    path = tmp_path / "s" / "take_001.mcap"
    terminal = at_terminal(*SHORT, "--realtime", "--session", path.parent)
    terminal.until(lambda: grows(path), "no take")
    terminal.press(" ")
    terminal.wait_for("paused")
    time.sleep(1.5)  # as long as the pause is to be
    size = path.stat().st_size
    terminal.press(" ")
    terminal.until(lambda: path.stat().st_size > size + 50_000, "it does not go on")
    terminal.process.kill()
    terminal.process.wait()
    cut = inspect_recording(path)
    with Recording.open(path) as recording:
        assert recording.truncated
        ((start_ns, end_ns),) = recording.pauses
    assert end_ns - start_ns > 1_400_000_000
    assert cut.timing.topics["/lidar/scan"].max_gap_ns < 1_000_000_000
    repair_recording(path, tmp_path / "new.mcap")
    repaired = inspect_recording(tmp_path / "new.mcap")
    assert not repaired.counted
    assert repaired.timing == cut.timing
    assert repaired.stats["pauses_ns"] == f"{start_ns}-{end_ns}"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_recording_cleanly(tmp_path: Path, number: signal.Signals) -> None:
    out = tmp_path / "x.mcap"
    recorder = subprocess.Popen(
        [*SDT, *SHORT, "--realtime", "--out", out, "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    try:
        until(lambda: grows(out), "nothing is recorded")
        recorder.send_signal(number)
        told = json.loads(recorder.communicate(timeout=LONGEST_S)[0])
    finally:
        recorder.kill()
        recorder.wait()
    assert recorder.returncode == 128 + number
    with Recording.open(out) as recording:
        assert not recording.truncated
        assert recording.stats["ending"] == told["ending"]
        assert len(recording.scans()) == told["frames"]["/lidar/scan"]


def test_without_a_terminal_a_session_takes_one_take_a_call(tmp_path: Path) -> None:
    call = [*SHORT, "--seconds", "1", "--session", str(tmp_path / "s"), "--json"]
    told = json.loads(CliRunner().invoke(app, call).stdout)
    assert [(take["name"], take["ending"]) for take in told["takes"]] == [("take_001.mcap", "time")]
    told = json.loads(CliRunner().invoke(app, [*call, "--resume"]).stdout)
    assert [take["name"] for take in told["takes"]] == ["take_001.mcap", "take_002.mcap"]
    with Recording.open(tmp_path / "s" / "take_002.mcap") as recording:
        assert recording.session["seed"] == "8"

    changed = CliRunner().invoke(app, [*call, "--resume", "--perturb"])
    assert "perturb.start_probability: not set before, 0.05 now" in changed.stderr.splitlines()
    assert isinstance(changed.exception, ChangedConfigError)
    assert "was begun with another config (perturb." in str(changed.exception)
    assert len(takes(tmp_path / "s")) == 2


ROOM = """
name = "my_room"
operator = { path = [[1.0, 0.0], [4.0, 0.5]], speed_mps = 0.5 }
wall = [{ from = [-2, -3], to = [8, -3] }]
gestures = [{ at_s = 3, gesture = "enable" }]
"""


def test_what_led_to_a_change_of_mode_is_kept_without_a_terminal_too(tmp_path: Path) -> None:
    (tmp_path / "room.toml").write_text(ROOM)
    call = ["record", "scene", "--no-camera", "--scenario", str(tmp_path / "room.toml"), "--seconds", "6"]
    result = CliRunner().invoke(app, [*call, "--session", str(tmp_path / "s"), "--keep-last", "2s", "--json"])
    (take,) = json.loads(result.stdout)["takes"]
    assert (take["name"], take["trigger"]) == ("event_001.mcap", "operator asks for mode: active")
    with Recording.open(tmp_path / "s" / "event_001.mcap") as recording:
        assert recording.session["trigger"] == take["trigger"]
        assert len(recording.scans()) == 100


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "name either --out, for one recording, or --session, for takes"),
        (["--out", "x.mcap", "--session", "s"], "name either --out"),
        (["--out", "x.mcap", "--resume"], "--resume needs --session"),
        (["--out", "x.mcap", "--keep-last", "30s"], "--keep-last needs --session"),
        (["--session", "s", "--keep-last", "soon"], "--keep-last soon: no length of time; write it as 30s or 2min"),
        (["--session", "s", "--driver", "policy:nowhere"], "nowhere"),
        (["--session", "s", "--scenario", "nowhere"], "nowhere"),
        (["--session", "s", "--resume"], "s: no session to resume; leave --resume out to begin one"),
    ],
)
def test_bad_calls_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, [*SHORT, *arguments])
    assert isinstance(result.exception, SdtError)
    assert message in str(result.exception)
    assert list(tmp_path.iterdir()) == []


def test_help_says_what_the_keys_do() -> None:
    output = CliRunner().invoke(app, ["record", "scene", "--help"]).output
    for words in ("space pauses", "n ends the take", "x discards it", "m marks", "q quits"):
        assert words in " ".join(output.split())
