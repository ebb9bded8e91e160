"""What is shown to strangers holds no names."""

from pathlib import Path

import pytest

from sdt_tools.doctor import finding
from sdt_tools.doctor.finding import Level, anonymous, fail, finding_of, ok, warn, without_names


@pytest.fixture
def anna(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "home", staticmethod(lambda: Path("/home/anna")))
    monkeypatch.setattr(finding.getpass, "getuser", lambda: "anna")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("/home/anna/work/.venv/bin/python", "~/work/.venv/bin/python"),
        ("in /home/anna", "in ~"),
        ("/home/annabel/x", "/home/annabel/x"),
        ("/media/anna/stick", "/media/USER/stick"),
        ("/mnt/anna.old", "/mnt/anna.old"),
        ("anna says", "anna says"),
    ],
)
def test_paths_hold_no_name(anna: None, text: str, shown: str) -> None:
    assert anonymous(text) == shown
    assert without_names(warn("disk", text, text, text)) == warn("disk", shown, shown, shown)


def test_a_line_says_level_what_and_what_to_do() -> None:
    assert fail("disk", "room", "1 GB free", "make room").line() == "fail  disk      room: 1 GB free → make room"
    assert ok("disk", "room", "9 GB free").line() == "ok    disk      room: 9 GB free"


def test_a_finding_survives_its_document() -> None:
    one = warn("clock", "host", "not synchronised", "switch NTP on")
    assert finding_of(one.document()) == one
    assert one.document()["level"] == Level.WARN.value
