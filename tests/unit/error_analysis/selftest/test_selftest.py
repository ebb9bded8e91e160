import json
from pathlib import Path

import pytest
from replay_samples import NearestAhead, label, write_drive
from typer.testing import CliRunner

from sdt_tools.cli.app import app
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.selftest.material import Material
from sdt_tools.error_analysis.selftest.run import run_selftest
from sdt_tools.replay.replay import replay

SMALL = Material(recordings=16, frames=40)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_counts_however_many_processes() -> None:
    seen: list[tuple[int, int]] = []
    documents = [
        run_selftest(ErrorOptions(), 0, 1, True, workers, SMALL, lambda *done: seen.append(done)).document()
        for workers in (1, 2)
    ]
    for document in documents:
        assert document.pop("seconds") > 0  # type: ignore[operator]
    assert documents[0] == documents[1]
    assert seen[0] == (0, 1 + 1 + 4 * 2)
    assert seen[-1] == (10, 10)


def test_errors_are_planted_into_predictions_at_hand(tmp_path: Path) -> None:
    drives = [write_drive(tmp_path / "recordings", f"drive_{seed}", seed=seed) for seed in range(10)]
    for drive in drives:
        label(drive, tmp_path / "labels")
    replay(NearestAhead(stops_at_m=0.0), drives, tmp_path / "labels", tmp_path / "predictions.parquet")
    files = ["--predictions", str(tmp_path / "predictions.parquet"), "--recordings", str(tmp_path / "recordings")]
    result = CliRunner().invoke(app, ["errors", "selftest", *files, "--trials", "1", "--workers", "1", "--json"])
    assert result.exit_code == 0, result.exception
    document = json.loads(result.stdout)
    assert {"alone", "mixed", "conditions", "null", "seconds"} <= set(document)
    assert document["alone"]["systematic"] == {"precision": 1.0, "recall": 1.0, **counted(document, "systematic")}
    assert document["conditions"].keys() >= {"planted", "features_right", "bounds_right", "false"}
    assert document["conditions"]["planted"] >= 1
    assert document["null"] == {}


def counted(document: dict[str, dict[str, dict[str, int]]], kind: str) -> dict[str, int]:
    score = document["alone"][kind]
    assert score["planted"] == score["tagged"] > 0
    return {"planted": score["planted"], "tagged": score["tagged"]}


def test_predictions_need_their_recordings(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["errors", "selftest", "--predictions", str(tmp_path / "p.parquet")])
    assert "go together" in str(result.exception)


@pytest.mark.slow
def test_the_whole_self_test_reaches_its_targets() -> None:
    document = run_selftest(ErrorOptions(), 1000, 100, True, 2).document()
    for kind, score in document["alone"].items():  # type: ignore[attr-defined]
        assert score["precision"] >= 0.95
        assert score["recall"] >= (0.90 if kind == "isolated" else 0.95)
    for kind, score in document["mixed"].items():  # type: ignore[attr-defined]
        assert score["precision"] >= 0.93
        assert score["recall"] >= (0.85 if kind == "isolated" else 0.93)
    conditions = document["conditions"]
    assert conditions["features_right"] >= 0.95 * conditions["planted"]  # type: ignore[index]
    sharp = conditions["sharp"]  # type: ignore[index]
    assert sharp["bounds_right"] >= 0.9 * sharp["planted"]
    for null in document["null"].values():  # type: ignore[attr-defined]
        assert null["trials"] == 200
        assert null["with_false_condition"] <= 10
