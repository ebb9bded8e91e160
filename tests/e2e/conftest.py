"""``sdt`` in an empty folder, and in a terminal."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from refusals import Sdt
from terminal_rig import Terminal, start_sdt

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


@pytest.fixture
def at_terminal() -> Iterator[Callable[..., Terminal]]:
    """Starts ``sdt`` in the foreground of a new terminal, each of which is closed in the end."""
    started: list[Terminal] = []

    def start(*arguments: object, before: str = "", columns: int = 80, lines: int = 24) -> Terminal:
        started.append(start_sdt(*arguments, before=before, columns=columns, lines=lines))
        return started[-1]

    yield start
    for terminal in started:
        terminal.close()
