"""Stages that judge a network: its domains, and the standing checks."""

from pathlib import Path

from sdt_tools.certify.certification import certify_checkpoint
from sdt_tools.certify.specification import specification_of
from sdt_tools.certify.verdicts import CertifyConfig
from sdt_tools.dataset.load import load_dataset
from sdt_tools.evaluation.standing_checks import standing_checks
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.paper.stage_folders import CERTIFICATE, DATASET, write_note


def certify_stage(out: Path, model: Path, level: int, config: CertifyConfig) -> None:
    """Judge every domain of a level."""
    certification = certify_checkpoint(model, specification_of(level, None), config, out / CERTIFICATE)
    write_note(out, certification.certificate.model_dump(mode="json"))


def check_stage(out: Path, model: Path, dataset: Path) -> None:
    """Put a network to the standing checks, on the validation frames of a data set."""
    report = standing_checks(load_checkpoint(model), load_dataset(dataset / DATASET).val)
    write_note(out, report.document())
