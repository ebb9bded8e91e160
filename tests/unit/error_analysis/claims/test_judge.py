import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from prediction_samples import frames_table, write_predictions
from replay_samples import label, write_drive

from sdt_tools.cli import app
from sdt_tools.error_analysis.claims.judge import Sources, judge_claims
from sdt_tools.error_analysis.claims.material import read_network
from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.errors import CheckpointError, OutputExistsError, UsageError
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import load_checkpoint, save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.replay.replay import replay

OPTIONS = ClaimOptions(resamples=200, locality_frames=200)
CLAIMS = [
    "theorem_1",
    "implication_1",
    "nested_scenarios",
    "nested_frames",
    "conditional",
    "forward",
    "transient",
    "uniform",
    "proposition_1",
    "proposition_2_transient",
    "proposition_2_systematic",
]


def checkpoint(folder: Path, seed: int, **training: object) -> Path:
    """An untrained network whose card tells of a training."""
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed)
    card = ModelCard(
        kind=FollowNet.kind,
        seed=seed,
        architecture=network.architecture,
        preprocess=network.preprocess,
        training={"safety": {"delta": 0.2}, **training},
        metrics={"bound": 0.05} if training.get("level") else {},
    )
    save_checkpoint(folder, network, card, {"curve.csv": b"epoch,train_loss\n1,2.5\n2,0.7\n"})
    return folder


@dataclass(frozen=True)
class Given:
    """Networks of levels 0 and 2, replayed over labelled drives."""

    sources: Sources
    predictions: tuple[Path, ...]


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Given:
    folder = tmp_path_factory.mktemp("claims")
    drives = [write_drive(folder / "recordings", f"drive_{seed}", seed=seed) for seed in range(9)]
    for drive in drives:
        label(drive, folder / "labels")
    models = (checkpoint(folder / "standard", 0, level=0), checkpoint(folder / "safe", 1, level=2))
    predictions = tuple(folder / f"{model.name}.parquet" for model in models)
    for model, path in zip(models, predictions, strict=True):
        replay(load_checkpoint(model), drives, folder / "labels", path)
    return Given(Sources(predictions, models, recordings=(folder / "recordings",)), predictions)


def test_a_card_tells_level_bound_and_training_loss(given: Given) -> None:
    network = read_network(given.sources.models[1])
    assert (network.level, network.delta, network.bound, network.train_loss) == (2, 0.2, 0.05, 0.7)
    assert read_network(given.sources.models[0]).delta is None


def test_a_network_of_other_domains_has_no_level(tmp_path: Path) -> None:
    network = read_network(checkpoint(tmp_path / "balls", 0, epsilon_m=0.05))
    assert (network.level, network.adversarial) == (None, True)


def test_every_claim_has_a_verdict_and_the_folder_holds_all(given: Given, tmp_path: Path) -> None:
    report = judge_claims(given.sources, OPTIONS, tmp_path / "out")
    assert list(dict.fromkeys(verdict.claim for verdict in report.verdicts)) == CLAIMS
    found = {verdict.claim: verdict for verdict in report.verdicts}
    assert found["theorem_1"].reason == "0 frames of 0 recordings lie inside; 200 of 8 are needed"
    assert found["proposition_1"].finding == "supported"
    document = json.loads((tmp_path / "out/claims.json").read_text())
    assert [claim["claim"] for claim in document["claims"]] == [verdict.claim for verdict in report.verdicts]
    assert document["options"]["resamples"] == 200
    table = pl.read_parquet(tmp_path / "out/claims.parquet")
    assert table["verdict"].to_list() == [str(verdict.finding) for verdict in report.verdicts]
    page = (tmp_path / "out/claims.md").read_text()
    drawn = {path.name for path in (tmp_path / "out").glob("*.png")}
    assert "locality.png" in drawn
    assert all(f"({name})" in page for name in drawn)
    with pytest.raises(OutputExistsError):
        judge_claims(given.sources, OPTIONS, tmp_path / "out")


def test_the_verb_prints_one_document(
    given: Given, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    models = [word for model in given.sources.models for word in ("--model", str(model))]
    words = ["sdt", "errors", "claims", *map(str, given.predictions), *models, "--out", str(tmp_path / "out"), "--json"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as ended:
        app.main()
    assert ended.value.code == 0
    document = json.loads(capsys.readouterr().out)
    found = {claim["claim"]: claim for claim in document["claims"]}
    assert found["proposition_1"]["reason"] == "needs the scans of the frames; add --recordings"


def test_predictions_of_a_network_that_is_not_given_are_not_asked(given: Given, tmp_path: Path) -> None:
    sources = Sources(given.predictions, given.sources.models[:1])
    report = judge_claims(sources, OPTIONS, tmp_path / "out")
    assert [network["name"] for network in report.summary["networks"]] == ["standard"]


def test_a_network_without_predictions_is_refused(given: Given, tmp_path: Path) -> None:
    sources = Sources(given.predictions[:1], given.sources.models)
    with pytest.raises(UsageError, match="no predictions of model 'safe'; there are standard"):
        judge_claims(sources, OPTIONS, tmp_path / "out")


def test_a_missing_checkpoint_is_refused(given: Given, tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match="no such checkpoint"):
        judge_claims(Sources(given.predictions, (tmp_path / "none",)), OPTIONS, tmp_path / "out")


@pytest.mark.parametrize("what", ["tags", "evaluations"])
def test_tables_of_another_kind_are_refused(given: Given, what: str, tmp_path: Path) -> None:
    other = write_predictions(tmp_path / "other.parquet", frames_table(2, 5), "a", np.zeros(10, bool))
    sources = Sources(given.predictions, given.sources.models, **{what: (other,)})
    with pytest.raises(UsageError, match=r"other\.parquet: (not a table of tags|no evaluation runs)"):
        judge_claims(sources, OPTIONS, tmp_path / "out")


def test_a_model_named_as_adversarial_must_have_predictions(given: Given, tmp_path: Path) -> None:
    sources = Sources(given.predictions, given.sources.models, adversarial=("vision",))
    with pytest.raises(UsageError, match="--adversarial vision: no predictions of such a model"):
        judge_claims(sources, OPTIONS, tmp_path / "out")
