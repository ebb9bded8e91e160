import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import numpy_helper

from sdt_tools.certify.certify import certify
from sdt_tools.certify.export import check_export, write_export
from sdt_tools.certify.verdicts import CertifyConfig, Ledger, Verdict
from sdt_tools.errors import RunError
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.robustness.attacks import AttackConfig
from sdt_tools.robustness.boxes import DomainSet

QUICK = CertifyConfig(attack=AttackConfig(restarts=2, steps=20))


@pytest.fixture
def ledger(careful: LoadedModel, boxes: DomainSet) -> Ledger:
    """Ray 150 violated, ray 270 certified, ray 389 violated."""
    return certify(careful, [boxes], QUICK)


@pytest.fixture
def exported(careful: LoadedModel, boxes: DomainSet, tmp_path: Path) -> Path:
    write_export(tmp_path, careful, [boxes])
    return tmp_path


def test_the_list_names_network_and_query_of_each_domain(exported: Path) -> None:
    with (exported / "instances.csv").open(newline="") as stream:
        rows = list(csv.reader(stream))
    assert [row[0] for row in rows] == ["model.onnx"] * 3
    assert rows[1] == ["model.onnx", "vnnlib/set1-domain001-ray270.vnnlib", "60"]
    assert all((exported / row[1]).is_file() for row in rows)


def test_a_whole_export_is_confirmed(exported: Path, careful: LoadedModel, boxes: DomainSet, ledger: Ledger) -> None:
    found = check_export(exported, careful, [boxes], ledger)
    assert (found.instances, found.counterexamples) == (3, 2)
    assert found.max_logit_difference < 1e-5


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("(assert (<= X_5 20.0))", "(assert (<= X_5 20.000000000000004))", "bounds are not those of domain 0"),
        ("(>= Y_1 Y_0)", "(>= Y_0 Y_1)", "classes are not those"),
        ("(>= Y_1 Y_0)", "(> Y_1 Y_0)", "no '(>= Y_a Y_b)'"),
    ],
)
def test_a_changed_query_is_found_out(
    exported: Path, careful: LoadedModel, boxes: DomainSet, ledger: Ledger, old: str, new: str, said: str
) -> None:
    path = exported / "vnnlib" / "set1-domain000-ray150.vnnlib"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(RunError) as refused:
        check_export(exported, careful, [boxes], ledger)
    assert said in str(refused.value)
    assert path.name in str(refused.value)


def test_a_changed_network_is_found_out(exported: Path, careful: LoadedModel, boxes: DomainSet, ledger: Ledger) -> None:
    network = onnx.load(exported / "model.onnx")
    bias = next(weight for weight in network.graph.initializer if weight.name == "full2.bias")
    bias.CopyFrom(numpy_helper.from_array(numpy_helper.to_array(bias) + np.float32(0.01), "full2.bias"))
    onnx.save(network, exported / "model.onnx")
    with pytest.raises(RunError, match=r"logits are off by 0\.01"):
        check_export(exported, careful, [boxes], ledger)


def test_a_scan_that_is_no_counterexample_is_found_out(
    exported: Path, careful: LoadedModel, boxes: DomainSet, ledger: Ledger
) -> None:
    """With ray 270 at 0 m the network stays; a ledger that calls this scan a violation is wrong, or the file is."""
    first, *others = ledger.verdicts
    wrong = replace(ledger, verdicts=(replace(first, scan_m=boxes.lower_m[0]), *others))
    with pytest.raises(RunError, match="the known counterexample is none"):
        check_export(exported, careful, [boxes], wrong)


def test_a_certified_domain_with_a_counterexample_is_found_out(
    exported: Path, careful: LoadedModel, boxes: DomainSet, ledger: Ledger
) -> None:
    first, *others = ledger.verdicts
    wrong = replace(ledger, verdicts=(replace(first, verdict=Verdict.CERTIFIED), *others))
    with pytest.raises(RunError, match="though the domain is certified"):
        check_export(exported, careful, [boxes], wrong)


def test_a_missing_row_is_found_out(exported: Path, careful: LoadedModel, boxes: DomainSet, ledger: Ledger) -> None:
    rows = (exported / "instances.csv").read_text().splitlines()
    (exported / "instances.csv").write_text("\n".join(rows[:2]))
    with pytest.raises(RunError, match="2 rows for 3 domains"):
        check_export(exported, careful, [boxes], ledger)
