"""The paper's non-conflict assumption, asked of data: no label may be one that a safety domain forbids."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float, Integer

from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes
from sdt_tools.robustness.domains import SafetyLevel, conflicts

ConflictCheck = Callable[[Float[np.ndarray, "frames rays"], Integer[np.ndarray, "frames"]], Bool[np.ndarray, "frames"]]


def conflict_check(level: int) -> ConflictCheck:
    """A check of scans as the sensor gave them, and their labels, against the domains of ``level``.

    Domains speak of scans whose codes are resolved, so that is done first.
    """
    return lambda ranges_m, labels: conflicts(resolve_codes(ranges_m, PreprocessConfig()), labels, SafetyLevel(level))
