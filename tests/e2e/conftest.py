"""``sdt`` in an empty folder."""

import sys
from pathlib import Path

import pytest
from refusals import Sdt

from sdt_tools.cli.app import main


@pytest.fixture
def sdt(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Sdt:
    """Runs a command in an empty folder; returns the exit code and what it said on stderr."""

    def call(*words: object) -> tuple[int, str]:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["sdt", *map(str, words)])
        with pytest.raises(SystemExit) as stop:
            main()
        return int(stop.value.code or 0), capsys.readouterr().err

    return call
