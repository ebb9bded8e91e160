import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from sdt_tools.cli.certify import command
from sdt_tools.errors import SdtError
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.loaded import LoadedModel

app = typer.Typer()
app.command()(command)


@pytest.fixture
def checkpoint(careful: LoadedModel, tmp_path: Path) -> str:
    save_checkpoint(tmp_path / "careful", careful.network, careful.card)
    return str(tmp_path / "careful")


def refusal(*words: str) -> str:
    """What the command refuses with; the command line prints it after ``sdt:`` and exits 2."""
    error = CliRunner().invoke(app, list(words)).exception
    assert isinstance(error, SdtError)
    assert error.exit_code == 2
    return str(error)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "one of them is needed"),
        (["--level", "3", "--domains", "x.toml"], "not both"),
        (["--level", "0"], "level 0 asks for nothing: there are no domains to certify"),
        (["--level", "5"], "--level 5: no such level; choose 1, 2, 3 or 4"),
        (["--level", "-1"], "--level -1: no such level"),
        (["--level", "3", "--restarts", "0", "--attack-certified"], "--restarts 0 for none"),
        (["--domains", "none.toml"], "none.toml"),
    ],
)
def test_contradictory_options_are_refused_in_one_line(checkpoint: str, words: list[str], said: str) -> None:
    line = refusal(checkpoint, *words)
    assert said in line
    assert "\n" not in line


def test_a_missing_model_is_named(tmp_path: Path) -> None:
    assert "nowhere: no such checkpoint" in refusal(str(tmp_path / "nowhere"), "--level", "4")


def test_existing_results_are_refused(checkpoint: str, tmp_path: Path) -> None:
    assert f"{tmp_path} exists already" in refusal(checkpoint, "--level", "4", "--out", str(tmp_path))


def test_the_document_never_tells_a_certified_share_alone(checkpoint: str, tmp_path: Path) -> None:
    """The network watches ray 270 alone, so of the 240 domains one is certified."""
    words = [checkpoint, "--level", "4", "--out", str(tmp_path / "out"), "--restarts", "0", "--json"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.exception
    document = json.loads(result.stdout)
    counts = {key: document[key] for key in ("domains", "certified", "violated", "unknown", "error")}
    assert counts == {"domains": 240, "certified": 1, "violated": 0, "unknown": 239, "error": 0}
    assert (document["validation_accuracy"], document["forward_recall"]) == (0.5, 0.25)
    assert (document["level"], document["specification"], document["model"]) == (4, "level 4", "careful")
    assert document["min_margin"] == pytest.approx(-2.0)
    assert document["export"] is None
    for key in ("ledger", "counterexamples", "certificate", "figure"):
        assert Path(document[key]).is_file()


OWN_DOMAINS = """
[[domain]]
name = "ahead"
rays = [269, 271]
width = 1
near = { lower_m = 0.0, upper_m = 0.2 }
others = { lower_m = 0.0, upper_m = 20.0 }
allowed = ["stay", "backward", "left_backward", "right_backward"]
"""


def test_domains_of_a_file_are_judged_and_exported(checkpoint: str, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(OWN_DOMAINS)
    words = [checkpoint, "--domains", str(tmp_path / "own.toml"), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, [*words, "--export", str(tmp_path / "export"), "--json"])
    assert result.exit_code == 0, result.exception
    document = json.loads(result.stdout)
    assert (document["level"], document["specification"]) == (None, str(tmp_path / "own.toml"))
    assert (document["domains"], document["certified"], document["violated"]) == (3, 1, 2)
    assert (document["export"]["instances"], document["export"]["counterexamples"]) == (3, 2)


def test_people_read_a_table(checkpoint: str, tmp_path: Path) -> None:
    words = [checkpoint, "--level", "4", "--out", str(tmp_path / "out"), "--restarts", "1"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.exception
    for told in ("certified", "1 (0.4%)", "violated", "239 (99.6%)", "validation accuracy", "50.0%", "25.0%"):
        assert told in result.output
