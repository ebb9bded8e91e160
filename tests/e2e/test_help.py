import subprocess
import sys

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from sdt_tools.cli.app import VERBS, app

HEAVY = ("cv2", "matplotlib", "mcap", "numba", "numpy", "polars", "pydantic", "pymunk", "rerun", "torch")


def every_command(group: object = None) -> list[list[str]]:
    paths = []
    for name, command in getattr(group or get_command(app), "commands", {}).items():
        below = every_command(command) if hasattr(command, "commands") else []
        paths += [[name], *([name, *words] for words in below)]
    return paths


def test_every_verb_is_there() -> None:
    assert get_command(app).list_commands(None) == list(VERBS)


@pytest.mark.parametrize("path", every_command(), ids=" ".join)
def test_every_verb_explains_itself_and_takes_json(path: list[str]) -> None:
    result = CliRunner().invoke(app, [*path, "--help"])
    assert result.exit_code == 0
    is_group = any(other[: len(path)] == path and len(other) > len(path) for other in every_command())
    assert is_group or "--json" in result.output


def test_the_command_line_starts_without_heavy_imports() -> None:
    code = f"import sys, sdt_tools.cli.app; print([m for m in {HEAVY!r} if m in sys.modules])"
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert output.strip() == "[]"


@pytest.mark.parametrize("path", every_command(), ids=" ".join)
def test_help_loses_no_word_to_markup(path: list[str]) -> None:
    output = CliRunner().invoke(app, [*path, "--help"]).output
    assert ", ," not in output
    assert "with  and" not in output
