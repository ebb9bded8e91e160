import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sdt_tools.certify import certification as room
from sdt_tools.certify.certification import certify_checkpoint
from sdt_tools.certify.certify import certify
from sdt_tools.certify.figure import margins_figure
from sdt_tools.certify.ledger import Certificate
from sdt_tools.certify.specification import Specification, specification_of
from sdt_tools.certify.verdicts import CertifyConfig, Ledger
from sdt_tools.errors import OutputExistsError, UsageError
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.robustness.attacks import AttackConfig
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import SafetyLevel, domains
from sdt_tools.runs.unit import content_hash

QUICK = CertifyConfig(attack=AttackConfig(restarts=2, steps=20))


@pytest.fixture
def checkpoint(careful: LoadedModel, tmp_path: Path) -> Path:
    save_checkpoint(tmp_path / "careful", careful.network, careful.card)
    return tmp_path / "careful"


@pytest.fixture
def three(boxes: DomainSet) -> Specification:
    return Specification((boxes,), "three domains", "three")


def test_the_ledger_has_a_row_a_domain(checkpoint: Path, three: Specification, tmp_path: Path) -> None:
    certify_checkpoint(checkpoint, three, QUICK, tmp_path / "out")
    rows = pq.read_table(tmp_path / "out" / "ledger.parquet").to_pylist()
    assert [row["verdict"] for row in rows] == ["violated", "certified", "violated"]
    assert [row["ray"] for row in rows] == [150, 270, 389]
    beside, ahead, _ = rows
    assert (ahead["margin"], ahead["winner"], ahead["answer"]) == (pytest.approx(7.5), "stay", None)
    assert (beside["answer"], beside["method"], beside["restarts"]) == ("forward", "pgd", 2)
    assert ahead["bound_loss"] < 0.01 < beside["bound_loss"]
    assert {row["required_margin"] for row in rows} == {0.001}
    assert {row["error"] for row in rows} == {""}


def test_counterexamples_are_kept_exactly(
    checkpoint: Path, three: Specification, boxes: DomainSet, careful: LoadedModel, tmp_path: Path
) -> None:
    done = certify_checkpoint(checkpoint, three, QUICK, tmp_path / "out")
    rows = pq.read_table(tmp_path / "out" / "counterexamples.parquet").to_pylist()
    assert [(row["set"], row["domain"], row["ray"]) for row in rows] == [
        ("three of level 4", 0, 150),
        ("three of level 4", 2, 389),
    ]
    scans_m = np.array([row["ranges_m"] for row in rows])
    assert np.array_equal(scans_m[0], done.ledger.verdicts[0].scan_m)
    assert np.all((boxes.lower_m[[0, 2]] <= scans_m) & (scans_m <= boxes.upper_m[[0, 2]]))


def test_the_certificate_says_what_it_is_about(checkpoint: Path, three: Specification, tmp_path: Path) -> None:
    before = content_hash(checkpoint)
    certify_checkpoint(checkpoint, three, QUICK, tmp_path / "out")
    found = Certificate.model_validate_json((tmp_path / "out" / "certificate.json").read_text())
    assert (found.model, found.model_hash, found.specification) == ("careful", before, "three domains")
    assert (found.domains, found.certified, found.violated, found.unknown, found.error) == (3, 1, 2, 0, 0)
    assert (found.validation_accuracy, found.forward_recall) == (0.5, 0.25)
    assert found.min_margin == pytest.approx(-2.0)
    assert found.config == QUICK
    assert (tmp_path / "out" / "margins.png").stat().st_size > 1000


def test_a_level_is_fingerprinted_by_its_domains() -> None:
    three, four = (specification_of(level, None) for level in (3, 4))
    assert three.fingerprint() == specification_of(3, None).fingerprint() != four.fingerprint()
    assert (four.name, four.slug, four.domains) == ("level 4", "level-4", 240)


def test_nothing_is_written_over(checkpoint: Path, three: Specification, tmp_path: Path) -> None:
    for taken in ("out", "export"):
        (tmp_path / taken).mkdir()
    for out, export in (("out", "new"), ("new", "export")):
        with pytest.raises(OutputExistsError):
            certify_checkpoint(checkpoint, three, QUICK, tmp_path / out, tmp_path / export)
    assert {path.name for path in tmp_path.iterdir()} == {"careful", "out", "export"}


def test_a_failure_on_the_way_leaves_nothing_half_written(
    checkpoint: Path, three: Specification, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full_disk(ledger: Ledger, title: str, out: Path) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(room, "margins_figure", full_disk)
    with pytest.raises(OSError, match="no space left"):
        certify_checkpoint(checkpoint, three, QUICK, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["careful"]


def test_the_export_is_checked_before_it_appears(checkpoint: Path, three: Specification, tmp_path: Path) -> None:
    done = certify_checkpoint(checkpoint, three, QUICK, tmp_path / "out", tmp_path / "export")
    assert done.export_check is not None
    assert (done.export_check.instances, done.export_check.counterexamples) == (3, 2)
    assert {path.name for path in (tmp_path / "export").iterdir()} == {"model.onnx", "instances.csv", "vnnlib"}


def test_one_folder_cannot_be_both(checkpoint: Path, three: Specification, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="one folder; choose two"):
        certify_checkpoint(checkpoint, three, QUICK, tmp_path / "out", tmp_path / "out")


def test_without_a_folder_results_are_named_after_model_and_specification(
    checkpoint: Path, three: Specification, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = certify_checkpoint(checkpoint, three, CertifyConfig(attack=None))
    assert done.out == Path("analysis/certify/careful-three")
    certificate = json.loads((done.out / "certificate.json").read_text())
    assert (certificate["unknown"], certificate["config"]["attack"]) == (2, None)


def test_more_sets_than_fit_are_drawn_in_one_row(careful: LoadedModel, boxes: DomainSet, tmp_path: Path) -> None:
    """Errors and missing searches are no hindrance: a set without margins, and none with an attack."""
    broken = replace(boxes, name="broken", upper_m=boxes.upper_m - 1.0)
    many = [replace(boxes, name=f"set {number}") for number in range(8)]
    for name, sets in (("few.png", [broken]), ("many.png", many)):
        margins_figure(certify(careful, sets, CertifyConfig(attack=None)), name, tmp_path / name)
    assert (tmp_path / "many.png").stat().st_size > 1000
    assert (tmp_path / "few.png").stat().st_size > 1000


@pytest.mark.parametrize("level", [1, 2, 3, 4])
def test_a_specification_of_a_level_has_its_domains(level: int) -> None:
    assert specification_of(level, None).sets == (domains(SafetyLevel(level)),)
