"""``sdt drive scene``: what it prints and writes, and which calls it refuses."""

import json
import re
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner
from vision_samples import save_small, small_network

from sdt_tools.cli import drive_report
from sdt_tools.cli.drive import app
from sdt_tools.errors import CheckpointError, ConfigError, OutputExistsError, SdtError, UsageError
from sdt_tools.frames import MotionCommand
from sdt_tools.recording.reader import Recording


def run(*words: str) -> str:
    return CliRunner().invoke(app, ["scene", *words], catch_exceptions=False).stdout


@pytest.fixture(scope="module")
def vision(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(save_small(tmp_path_factory.mktemp("models") / "small", small_network()))


def test_the_follow_network_alone_is_active_and_its_delays_are_counted() -> None:
    told = json.loads(run("--follow", "expert", "--scenario", "plain", "--seconds", "2", "--fast", "--json"))

    assert (told["ending"], told["seconds"], told["decisions"], told["switches"]) == ("time", 2.0, 20, [])
    assert told["scan_to_command"]["count"] == sum(told["scan_to_command"]["histogram"]["counts"]) == 20
    assert told["outcome"] == "ok"


def test_the_whole_controller_reads_pictures_and_is_recorded(vision: str, tmp_path: Path) -> None:
    out = tmp_path / "drive.mcap"
    config = tmp_path / "drive.toml"
    config.write_text("[scene.rates]\nimage_hz = 10\n[controller]\ncamera_silence_s = 0.5\n")
    words = ["--vision", vision, "--record", str(out), "--seconds", "1", "--fast", "--config", str(config), "--json"]
    told = json.loads(run(*words))

    assert told["vision"]["count"] == 5
    assert told["recording"] == str(out)
    with Recording.open(out) as recording:
        messages = [received.message for received in recording.messages(["/robot/command"])]
        assert "camera_silence_s = 0.5" in recording.config_toml
    assert sum(isinstance(message, MotionCommand) for message in messages) >= told["decisions"] == 10


def test_in_real_time_it_says_what_happens_and_how_long_commands_took(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Console(record=True, width=120)
    monkeypatch.setattr(drive_report, "console", screen)
    run("--scenario", "plain", "--seconds", "1.8")

    shown = screen.export_text()
    assert "0.0 s  the operator shows enable" in shown
    assert "1.5 s  the operator shows nothing more" in shown
    assert re.search(r"1\.8 s in \d+\.\d", shown)
    assert "from scan to command: p50 " in shown


@pytest.mark.parametrize(
    ("words", "error", "text"),
    [
        (["--follow", "nobody"], UsageError, "--follow nobody: no such driver; choose a follow network's folder"),
        (["--vision", "nowhere"], CheckpointError, "nowhere"),
        (["--scenario", "plane"], ConfigError, "did you mean 'plain'"),
        (["--cockpit"], UsageError, "--cockpit needs a terminal"),
        (["--gamepad"], UsageError, "--gamepad needs --cockpit"),
    ],
)
def test_what_cannot_be_driven_is_named(words: list[str], error: type[SdtError], text: str) -> None:
    with pytest.raises(error, match=text):
        run("--fast", "--seconds", "0.1", *words)


def test_nothing_is_written_over(tmp_path: Path) -> None:
    (tmp_path / "there.mcap").write_text("kept")
    with pytest.raises(OutputExistsError, match="choose another --record"):
        run("--record", str(tmp_path / "there.mcap"))


def test_a_wrong_setting_is_named_with_its_place(tmp_path: Path) -> None:
    config = tmp_path / "drive.toml"
    config.write_text("[controller]\ndebonce = 2\n")
    with pytest.raises(ConfigError, match=r"unknown key 'controller\.debonce'; did you mean 'debounce'"):
        run("--config", str(config))
