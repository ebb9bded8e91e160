"""From a checkpoint to a certificate on disk: load, judge, write whole or not at all."""

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sdt_tools.certify.certify import Progress, certify
from sdt_tools.certify.export import ExportCheck, check_export, write_export
from sdt_tools.certify.figure import margins_figure
from sdt_tools.certify.ledger import Certificate, write_ledger
from sdt_tools.certify.specification import Specification
from sdt_tools.certify.verdicts import CertifyConfig, Ledger, Verdict
from sdt_tools.errors import OutputExistsError, UsageError
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.runs.code import code_version
from sdt_tools.runs.unit import content_hash

FIGURE: Final = "margins.png"


@dataclass(frozen=True, eq=False)
class Certification:
    """What ``certify_checkpoint`` made: the folder ``out``, and that of the export where one was asked for."""

    certificate: Certificate
    ledger: Ledger
    out: Path
    export: Path | None
    export_check: ExportCheck | None


def certify_checkpoint(
    checkpoint: Path,
    specification: Specification,
    config: CertifyConfig,
    out: Path | None = None,
    export: Path | None = None,
    progress: Progress | None = None,
) -> Certification:
    """Judge every domain; write ledger, counterexamples, certificate and figure to ``out``, and an export if wanted.

    Without ``out`` the folder is ``analysis/certify/<checkpoint>-<specification>``. An export is checked before it
    appears; one that fails leaves the verdicts in place. Raises OutputExistsError, before any work, where a folder
    exists; UsageError, CheckpointError and RunError as ``certify`` and ``check_export`` do.
    """
    model = load_checkpoint(checkpoint)
    out = out or Path("analysis") / "certify" / f"{model.name}-{specification.slug}"
    if export is not None and export.resolve() == out.resolve():
        raise UsageError(f"{out}: --out and --export are one folder; choose two")
    for folder in (out, export):
        if folder is not None and folder.exists():
            raise OutputExistsError(folder)
    ledger = certify(model, specification.sets, config, progress)
    certificate = _certificate(checkpoint, model, specification, config, ledger)
    _make_folder(out, lambda folder: _write_results(folder, ledger, certificate))
    if export is None:
        return Certification(certificate, ledger, out, None, None)
    checks: list[ExportCheck] = []

    def fill(folder: Path) -> None:
        write_export(folder, model, specification.sets)
        checks.append(check_export(folder, model, specification.sets, ledger))

    _make_folder(export, fill)
    return Certification(certificate, ledger, out, export, checks[0])


def _certificate(
    checkpoint: Path, model: LoadedModel, specification: Specification, config: CertifyConfig, ledger: Ledger
) -> Certificate:
    counts = ledger.counts
    return Certificate(
        model=model.name,
        model_hash=content_hash(checkpoint),
        code_version=code_version(),
        specification=specification.name,
        level=specification.level,
        specification_hash=specification.fingerprint(),
        file_hash=content_hash(specification.file) if specification.file else None,
        domains=len(ledger.verdicts),
        certified=counts[Verdict.CERTIFIED],
        violated=counts[Verdict.VIOLATED],
        unknown=counts[Verdict.UNKNOWN],
        error=counts[Verdict.ERROR],
        min_margin=ledger.min_margin,
        required_margin=ledger.required_margin,
        numerical_error=ledger.numerical_error,
        validation_accuracy=_metric(model, "val_accuracy"),
        forward_recall=_metric(model, "val_forward_recall"),
        seconds=round(ledger.seconds, 3),
        config=config,
    )


def _metric(model: LoadedModel, name: str) -> float | None:
    value = model.card.metrics.get(name)
    return float(value) if isinstance(value, int | float) else None


def _write_results(folder: Path, ledger: Ledger, certificate: Certificate) -> None:
    write_ledger(folder, ledger, certificate)
    driving = ", ".join(
        f"{name} {'not known' if share is None else f'{share:.1%}'}"
        for name, share in (
            ("validation accuracy", certificate.validation_accuracy),
            ("forward recall", certificate.forward_recall),
        )
    )
    title = f"{certificate.model}: {certificate.certified} of {certificate.domains} domains certified ({driving})"
    margins_figure(ledger, title, folder / FIGURE)


def _make_folder(folder: Path, fill: Callable[[Path], None]) -> None:
    """``fill`` a scratch folder and give it the name ``folder``: it appears whole or not at all."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    scratch = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    shutil.rmtree(scratch, ignore_errors=True)
    try:
        scratch.mkdir()
        fill(scratch)
        if folder.exists():
            raise OutputExistsError(folder)
        scratch.rename(folder)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
