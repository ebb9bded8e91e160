"""The paper's non-conflict assumption, asked of data: no label may be one that a safety domain forbids."""

from sdt_tools.dataset.build import ConflictCheck
from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes
from sdt_tools.robustness.domains import SafetyLevel, conflicts


def conflict_check(level: int) -> ConflictCheck:
    """A check of scans as the sensor gave them, and their labels, against the domains of ``level``.

    Domains speak of scans whose codes are resolved, so that is done first.
    """
    return lambda ranges_m, labels: conflicts(resolve_codes(ranges_m, PreprocessConfig()), labels, SafetyLevel(level))
