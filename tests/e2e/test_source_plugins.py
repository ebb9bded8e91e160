"""Drivers of another package, installed as any package is, found and held against the contract."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from refusals import Sdt, assert_refused

from sdt_tools.cli.app import main
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.emulation.lms1xx.supply import SceneScans
from sdt_tools.emulation.p3at.ports import TcpPort
from sdt_tools.emulation.p3at.server import EmulatedP3at

PACKAGE = Path(__file__).parent / "third_party"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package, installed into a folder of its own."""
    source, target = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("site")
    for path in PACKAGE.glob("*.*"):
        (source / path.name).write_bytes(path.read_bytes())
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--target", str(target)]
    subprocess.run([sys.executable, "-m", "pip", "install", *options, str(source)], check=True, capture_output=True)
    return target


@pytest.fixture
def third_party(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(installed)


def check(sdt: Sdt, *words: object) -> tuple[int, str]:
    code, said = sdt("robot", "check", *words, "--seconds", 1)
    return code, said


def test_a_good_lidar_of_another_package_keeps_every_rule(third_party: None, sdt: Sdt) -> None:
    code, said = check(sdt, "whirl")
    assert code == 0, said
    assert "LiDAR driver whirl of third-party 0.3, third_party_devices" in said
    assert "broken  " not in said
    assert "0.000: 0.18%, 0.002: 0.18%" in said
    assert "the nearest thing is at 0.70 m, 45° to the left" in said
    assert said.endswith("13 kept, 0 broken, 1 not judged\n")


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("whirl_blocking", "read does not raise and does not wait: 2"),
        ("whirl_greedy", "all up to until_ns, in order of receipt: "),
        ("whirl_millimetres", "ranges are finite metres: the greatest is 2"),
        ("whirl_clinging", "close lets it go, and may be called twice: it raised ValueError: closed already"),
        ("whirl_failing", "it opens, or says in one line why not: it raised ZeroDivisionError: division by zero"),
    ],
)
def test_a_bad_one_is_told_which_rule_it_breaks(third_party: None, sdt: Sdt, name: str, rule: str) -> None:
    code, said = check(sdt, name)
    assert code == 1
    assert f"broken      {rule}" in said


def test_a_rate_that_is_not_the_one_asked_for(third_party: None, sdt: Sdt) -> None:
    code, said = check(sdt, "whirl", "--set", "scan_hz=20", "--hz", 50)
    assert code == 1
    assert "broken      scans come at 50 Hz, none 0.2 s late: " in said


def test_what_a_driver_says_when_it_cannot_open_is_the_line(third_party: None, sdt: Sdt) -> None:
    code, said = check(sdt, "whirl", "--set", "plugged=false")
    assert code == 1
    assert said.splitlines()[-1] == "sdt: whirl: nothing is plugged in; plug it in"


def test_wrong_settings_and_names(third_party: None, sdt: Sdt) -> None:
    assert_refused(check(sdt, "whirl", "--set", "scan_hs=20"), "unknown key 'scan_hs'; did you mean 'scan_hz'?")
    assert_refused(check(sdt, "whirl", "--set", "scan_hz"), "--set 'scan_hz': write KEY=VALUE")
    assert_refused(check(sdt, "whirl", "--set", "scan_hz=fast"), "--set scan_hz: ", "not 'fast'")
    assert_refused(check(sdt, "wirl"), "no driver is called so", "lms1xx", "did you mean 'whirl'?")
    assert_refused(check(sdt, "whirl", "--move"), "--move is for a base; whirl is a LiDAR")


def test_a_base_that_may_not_move_is_judged_by_its_poses(third_party: None, sdt: Sdt) -> None:
    code, said = check(sdt, "cart")
    assert code == 0, said
    assert "not judged  it drives and stands as it is told: lift its wheels off the ground, and give --move" in said


@pytest.mark.slow
def test_a_good_base_keeps_every_rule_and_a_bad_one_does_not(third_party: None, sdt: Sdt) -> None:
    code, said = check(sdt, "cart", "--move")
    assert code == 0, said
    assert " 0 broken, 0 not judged" in said
    code, said = check(sdt, "cart_runaway", "--move")
    assert code == 1
    assert "broken      left is counter-clockwise: " in said
    assert "broken      what nobody commands again ends within a second: it moves" in said
    assert "kept        forward is ahead: " in said


@pytest.mark.slow
def test_our_base_keeps_every_rule(sdt: Sdt) -> None:
    with EmulatedP3at(TcpPort("127.0.0.1", 0)) as emulated:
        code, said = check(sdt, "p3at", "--set", f"address={emulated.address}", "--move")
    assert code == 0, said
    assert " 0 broken, 0 not judged" in said


def test_our_lidar_keeps_every_rule_and_json_says_it_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with EmulatedLms1xx(SceneScans("plain", 0), EmulatedConfig(port=0)) as emulator:
        settings = ["--set", "host=127.0.0.1", "--set", f"port={emulator.port}", "--set", "protocol=a"]
        words = ["sdt", "robot", "check", "lms1xx", *settings, "--seconds", "1", "--json"]
        monkeypatch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as stop:
            main()
    document = json.loads(capsys.readouterr().out)
    assert [one for one in document["verdicts"] if one["outcome"] == "broken"] == []
    assert (stop.value.code, document["broken"], document["kind"]) == (0, 0, "lidar")
    assert document["settings"]["port"] == emulator.port
