"""Verdicts on disk: a ledger, the counterexamples beside it, and a certificate that says where they are from."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import polars as pl

from sdt_tools.certify.verdicts import CertifyConfig, DomainVerdict, Ledger
from sdt_tools.config import Config
from sdt_tools.frames import MotionClass

LEDGER: Final = "ledger.parquet"
COUNTEREXAMPLES: Final = "counterexamples.parquet"
CERTIFICATE: Final = "certificate.json"

_LEDGER_SCHEMA: Final[Mapping[str, type[pl.DataType]]] = {
    "set": pl.String,
    "domain": pl.Int64,
    "ray": pl.Int64,
    "verdict": pl.String,
    "margin": pl.Float64,
    "required_margin": pl.Float64,
    "bound_loss": pl.Float64,
    "winner": pl.String,
    "method": pl.String,
    "restarts": pl.Int64,
    "violation": pl.Float64,
    "answer": pl.String,
    "seconds": pl.Float64,
    "error": pl.String,
}
_COUNTEREXAMPLE_SCHEMA: Final[Mapping[str, pl.DataType | type[pl.DataType]]] = {
    "set": pl.String,
    "domain": pl.Int64,
    "ray": pl.Int64,
    "verdict": pl.String,
    "answer": pl.String,
    "violation": pl.Float64,
    "ranges_m": pl.List(pl.Float64),
}


class Certificate(Config):
    """The content of ``certificate.json``: what was asked of which network, what came of it, and how.

    ``model_hash`` is the SHA-256 of the checkpoint's files, ``specification_hash`` that of all bounds and allowed
    classes, ``file_hash`` that of the domain file. ``validation_accuracy`` and ``forward_recall`` are the model card's:
    a network that never drives is certified with ease, so a certified share is not told without them.
    """

    model: str
    model_hash: str
    code_version: str
    specification: str
    level: int | None
    specification_hash: str
    file_hash: str | None
    domains: int
    certified: int
    violated: int
    unknown: int
    error: int
    min_margin: float | None
    required_margin: float | None
    numerical_error: float | None
    validation_accuracy: float | None
    forward_recall: float | None
    seconds: float
    config: CertifyConfig


def ledger_table(ledger: Ledger) -> pl.DataFrame:
    """One row a domain, in the order of the specification."""
    rows = [
        {
            "set": one.set_name,
            "domain": one.domain,
            "ray": one.ray,
            "verdict": one.verdict.value,
            "margin": one.margin,
            "required_margin": one.required_margin,
            "bound_loss": one.bound_loss,
            "winner": _label(one.winner),
            "method": one.method,
            "restarts": one.restarts,
            "violation": one.violation,
            "answer": _label(one.answer),
            "seconds": one.seconds,
            "error": one.error,
        }
        for one in ledger.verdicts
    ]
    return pl.DataFrame(rows, schema=_LEDGER_SCHEMA)


def counterexample_table(ledger: Ledger) -> pl.DataFrame:
    """One row a scan that is kept: those of violated domains, and those that contradict bounds."""
    rows = [_counterexample(one) for one in ledger.verdicts if one.scan_m is not None]
    return pl.DataFrame(rows, schema=_COUNTEREXAMPLE_SCHEMA)


def write_ledger(folder: Path, ledger: Ledger, certificate: Certificate) -> None:
    """Write the three files into ``folder``, which exists."""
    ledger_table(ledger).write_parquet(folder / LEDGER)
    counterexample_table(ledger).write_parquet(folder / COUNTEREXAMPLES)
    (folder / CERTIFICATE).write_text(certificate.model_dump_json(indent=2) + "\n", encoding="utf-8")


def _counterexample(verdict: DomainVerdict) -> dict[str, object]:
    assert verdict.scan_m is not None
    return {
        "set": verdict.set_name,
        "domain": verdict.domain,
        "ray": verdict.ray,
        "verdict": verdict.verdict.value,
        "answer": _label(verdict.answer),
        "violation": verdict.violation,
        "ranges_m": verdict.scan_m.tolist(),
    }


def _label(motion: MotionClass | None) -> str | None:
    return None if motion is None else motion.label
