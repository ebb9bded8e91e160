"""The evaluation of vision networks from the command to its tables and pictures, with small networks."""

import json
from pathlib import Path

import polars as pl
import pytest
from rich.console import Console
from typer.testing import CliRunner
from vision_samples import save_small, small_network

from sdt_tools.cli import evaluate_vision as verb
from sdt_tools.cli.evaluate import app
from sdt_tools.errors import CheckpointError, UsageError
from sdt_tools.evaluation.saving import SaveRuns
from sdt_tools.evaluation.vision.evaluate import evaluate_vision
from sdt_tools.evaluation.vision.run import VisionLoopConfig
from sdt_tools.frames import CameraImage, LogEntry
from sdt_tools.recording.reader import Recording

SHORT = """
name = "short"
timeout_s = 3
camera = "video"
gestures = [
    { at_s = 0.6, gesture = "enable", lasts_s = 0.6 },
    { at_s = 1.8, gesture = "disable", lasts_s = 0.6 },
]
[operator]
path = [[1.3, 0.0]]
pauses_s = [60]
"""


@pytest.fixture(scope="module")
def scenarios(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("scenarios")
    (folder / "short.toml").write_text(SHORT)
    (folder / "rest.toml").write_text(
        SHORT.replace('"short"', '"rest"').replace('"enable"', '"idle"').replace('"disable"', '"idle"')
    )
    return [str(folder / "short.toml"), str(folder / "rest.toml")]


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("evaluation")


def call(out: Path, scenarios: list[str], *more: str) -> list[str]:
    named = [word for scenario in scenarios for word in ("--scenario", scenario)]
    return ["vision", "truth", "constant:enable", "constant:idle", *named, "--seeds", "1000", "--out", str(out), *more]


@pytest.fixture(scope="module")
def document(out: Path, scenarios: list[str]) -> dict:
    extra = ["--workers", "1", "--save-runs", "failed", "--figures", "--json"]
    done = CliRunner().invoke(app, call(out, scenarios, *extra), catch_exceptions=False)
    return json.loads(done.stdout)


def test_who_reads_what_is_shown_is_ok_and_constant_answers_fail_as_they_must(document: dict) -> None:
    found = {
        model: {name: (one["mode_errors"], one["missed"], one["runs"], one["ok"]) for name, one in by_name.items()}
        for model, by_name in document["models"].items()
    }

    # Enabled at once, it is an error; then enable is moot, and disable is missed. Who never reads any misses enable.
    assert found == {
        "truth": {"short": (0, 0, 1, 1), "rest": (0, 0, 1, 1)},
        "constant:enable": {"short": (1, 1, 1, 0), "rest": (1, 0, 1, 0)},
        "constant:idle": {"short": (0, 1, 1, 0), "rest": (0, 0, 1, 1)},
    }
    assert document["total"]["constant:enable"]["outcomes"]["switched"] == 2
    assert document["spread"]["truth"]["p_value"] is None
    assert document["paper"]["2"]["forward_backward"] == 5


def test_a_row_a_decision_says_what_was_shown_and_what_was_read(document: dict) -> None:
    decisions = pl.read_parquet(document["decisions"])
    true = decisions.filter((pl.col("model") == "truth") & (pl.col("scenario") == "short"))

    assert true["time_s"].to_list() == pytest.approx([0.2 * number for number in range(15)])
    assert (true["read"] == true["shown"]).all()
    assert true.filter(pl.col("after") == "active")["time_s"].to_list() == pytest.approx([0.6, 0.8, 1.0, 1.2, 1.4, 1.6])
    assert decisions.filter(pl.col("error"))["time_s"].to_list() == [0.0, 0.0]


def test_failed_runs_are_kept_with_their_mode_errors_marked(document: dict) -> None:
    assert len(document["recordings"]) == 3
    (path,) = [name for name in document["recordings"] if "enable" in name and "short" in Path(name).name]
    with Recording.open(Path(path)) as recording:
        messages = [received.message for received in recording.messages()]
    entries = [message.text for message in messages if isinstance(message, LogEntry)]
    assert "mode error: active, not commanded" in entries
    assert entries[-1].startswith("switched: active at 0.0 s: enable was read where it was not shown")
    assert sum(isinstance(message, CameraImage) for message in messages) == 16


def test_the_figures_are_drawn(document: dict) -> None:
    assert [Path(name).name for name in document["figures"]] == ["errors.png", "runs.png"]
    assert all(Path(name).read_bytes().startswith(b"\x89PNG") for name in document["figures"])


def test_what_is_done_is_not_done_again_and_the_table_says_all(
    document: dict, out: Path, scenarios: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def drive_again(*arguments: object) -> None:
        raise AssertionError("a run that was there")

    screen = Console(record=True, width=240)
    monkeypatch.setattr(verb, "console", screen)
    monkeypatch.setattr("sdt_tools.evaluation.vision.evaluate.drive_run", drive_again)
    more = ["--workers", "1", "--save-runs", "failed"]
    assert CliRunner().invoke(app, call(out, scenarios, *more), catch_exceptions=False).exit_code == 0

    shown = screen.export_text()
    assert "1 of 2 commands missed; 0 ok (1 switched)" in shown
    assert "constant:enable: 2 mode errors, evenly spread over scenarios: p = 1" in shown
    assert "truth: no mode errors" in shown


def test_a_small_network_reads_the_pictures_and_the_same_seed_gives_the_same_run(
    tmp_path: Path, scenarios: list[str]
) -> None:
    model = str(save_small(tmp_path / "small", small_network()))
    runs = []
    for number in range(2):
        out = tmp_path / str(number)
        done = evaluate_vision([model], "constant:stay", scenarios[:1], [3], VisionLoopConfig(), out, SaveRuns.NONE)
        runs.append(pl.read_parquet(done.decisions).drop("took_ms"))

    assert runs[0].equals(runs[1])
    assert set(runs[0]["read"]) <= {"idle", "enable", "disable"}
    assert len(runs[0]) == 15


def test_bad_calls_are_named(tmp_path: Path, scenarios: list[str]) -> None:
    def evaluate(models: list[str], follow: str = "expert", seeds: tuple[int, ...] = (1,)) -> None:
        evaluate_vision(models, follow, scenarios, seeds, VisionLoopConfig(), tmp_path)

    with pytest.raises(UsageError, match="no model given"):
        evaluate([])
    with pytest.raises(UsageError, match="seed 1 is given twice"):
        evaluate(["truth"], seeds=(1, 1))
    with pytest.raises(UsageError, match="'wave': no such gesture; the gestures are idle, enable, disable"):
        evaluate(["constant:wave"])
    with pytest.raises(CheckpointError, match="nowhere"):
        evaluate([str(tmp_path / "nowhere")])
    with pytest.raises(CheckpointError, match="nobody"):
        evaluate(["truth"], follow=str(tmp_path / "nobody"))
