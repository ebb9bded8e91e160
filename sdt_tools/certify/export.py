"""A network and its domains as other verifiers take them: an ONNX file, VNN-LIB files, and the list of both.

What is exported is read back and compared with what it was made from, before anyone relies on it.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from sdt_tools.certify.judges import judges_of, numerical_error
from sdt_tools.certify.onnx_answers import OnnxNetwork
from sdt_tools.certify.onnx_export import onnx_model, write_onnx
from sdt_tools.certify.verdicts import DomainVerdict, Ledger, Verdict
from sdt_tools.certify.vnnlib import Query, read_vnnlib, vnnlib_text
from sdt_tools.errors import ConfigError, RunError
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.intervals import MARGIN, split_classes

ONNX_FILE: Final = "model.onnx"
INSTANCES_FILE: Final = "instances.csv"
QUERIES: Final = "vnnlib"
TIMEOUT_S: Final = 60
"""How long a verifier may take for one domain; of the size usual in VNN-COMP."""


@dataclass(frozen=True)
class ExportCheck:
    """What was compared: query files with their domains, and counterexamples with their files.

    ``max_logit_difference`` is the largest one between the ONNX file and torch in float64.
    """

    instances: int
    counterexamples: int
    max_logit_difference: float


def write_export(folder: Path, model: LoadedModel, specification: Sequence[DomainSet]) -> None:
    """Fill ``folder``, which exists, with the network, one VNN-LIB file a domain, and ``instances.csv``.

    A row of the list is network, query and timeout in seconds, without heading, its paths relative to the list.
    """
    write_onnx(onnx_model(model), folder / ONNX_FILE)
    (folder / QUERIES).mkdir()
    with (folder / INSTANCES_FILE).open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        for number, boxes in enumerate(specification, start=1):
            for domain, ray in enumerate(boxes.rays.tolist()):
                path = f"{QUERIES}/set{number}-domain{domain:03d}-ray{ray}.vnnlib"
                (folder / path).write_text(vnnlib_text(boxes, domain), encoding="utf-8")
                rows.writerow([ONNX_FILE, path, TIMEOUT_S])


def check_export(
    folder: Path, model: LoadedModel, specification: Sequence[DomainSet], ledger: Ledger, tolerance: float = MARGIN / 2
) -> ExportCheck:
    """Read an export back and compare it with what it was made from.

    Bounds have to be those of the domains, to the last bit. The network in the file has to answer as torch does, within
    ``tolerance`` or the error that the ledger was made with. Each counterexample has to be one by its file; in a
    certified domain, neither of the two extreme scans may be. Raises RunError, naming the file, where something is not
    so.
    """
    network = OnnxNetwork((folder / ONNX_FILE).read_bytes())
    difference = numerical_error(replace(judges_of(model), onnx=network), specification, scans=2, seed=0)
    if not difference <= max(tolerance, ledger.numerical_error or 0.0):
        raise RunError(f"{folder / ONNX_FILE}: its logits are off by {difference:.3g} from the network's; export again")
    with (folder / INSTANCES_FILE).open(newline="", encoding="utf-8") as stream:
        listed = [folder / row[1] for row in csv.reader(stream)]
    domains = [(boxes, domain) for boxes in specification for domain in range(len(boxes))]
    if not len(listed) == len(domains) == len(ledger.verdicts):
        raise RunError(f"{folder / INSTANCES_FILE}: {len(listed)} rows for {len(domains)} domains; export again")
    checked = 0
    for path, (boxes, domain), verdict in zip(listed, domains, ledger.verdicts, strict=True):
        query = _read_back(path)
        _check_query(path, query, boxes, domain)
        checked += _check_polarity(path, query, verdict, network)
    return ExportCheck(len(listed), checked, difference)


def _read_back(path: Path) -> Query:
    try:
        return read_vnnlib(path)
    except ConfigError as error:
        raise RunError(str(error)) from None


def _check_query(path: Path, query: Query, boxes: DomainSet, domain: int) -> None:
    same = np.array_equal(query.lower_m, boxes.lower_m[domain]) and np.array_equal(query.upper_m, boxes.upper_m[domain])
    if not same:
        raise RunError(f"{path}: its bounds are not those of domain {domain} of {boxes.name}; export again")
    kept, forbidden = split_classes(boxes.allowed)
    if query.cases != tuple(tuple((wrong, right) for right in kept) for wrong in forbidden):
        raise RunError(f"{path}: its classes are not those of {boxes.name}; export again")


def _check_polarity(path: Path, query: Query, verdict: DomainVerdict, network: OnnxNetwork) -> int:
    """Compare what the file asks for with the verdict; how many counterexamples were there to compare."""
    if verdict.verdict is Verdict.VIOLATED:
        assert verdict.scan_m is not None
        if not query.asks_for(verdict.scan_m, network.logits(verdict.scan_m[None])[0]):
            raise RunError(f"{path}: the known counterexample is none by this file; its polarity or network is wrong")
        return 1
    if verdict.verdict is Verdict.CERTIFIED:
        for scan_m in (query.lower_m, query.upper_m):
            if query.asks_for(scan_m, network.logits(scan_m[None])[0]):
                raise RunError(f"{path}: a counterexample by this file, though the domain is certified")
    return 0
