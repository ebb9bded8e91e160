"""What is said of a claim."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from sdt_tools.error_analysis.resampling import UNKNOWN, Estimate


class Finding(StrEnum):
    """Supported: the interval excludes the contrary. Contradicted: it excludes the claim. Undecided: neither."""

    SUPPORTED = "supported"
    CONTRADICTED = "contradicted"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Premise:
    """Something the claim rests on: whether it holds in the material (None: cannot be known), and the numbers."""

    name: str
    holds: bool | None
    text: str

    def document(self) -> dict[str, Any]:
        """As a part of the report."""
        return dict(vars(self))


@dataclass(frozen=True)
class ClaimVerdict:
    """One claim about one family of networks.

    ``estimate`` is the number that decides, of what ``measure`` says; ``reason`` says in words why. ``frames`` and
    ``recordings`` are its support. ``numbers`` is everything else that was measured, JSON-ready. ``picture`` names the
    figure in which it is drawn.
    """

    claim: str
    about: str
    statement: str
    finding: Finding
    reason: str
    measure: str
    estimate: Estimate
    frames: int
    recordings: int
    picture: str
    numbers: Mapping[str, Any] = field(default_factory=dict)
    premises: tuple[Premise, ...] = ()

    def document(self) -> dict[str, Any]:
        """As a part of the report."""
        return {
            "claim": self.claim,
            "about": self.about,
            "statement": self.statement,
            "verdict": str(self.finding),
            "reason": self.reason,
            "measure": self.measure,
            "estimate": self.estimate.document(),
            "frames": self.frames,
            "recordings": self.recordings,
            "picture": self.picture,
            "premises": [premise.document() for premise in self.premises],
            "numbers": dict(self.numbers),
        }


def undecided(
    claim: str,
    about: str,
    statement: str,
    reason: str,
    measure: str = "",
    frames: int = 0,
    recordings: int = 0,
    picture: str = "",
) -> ClaimVerdict:
    """A claim of which nothing can be said, and why."""
    return ClaimVerdict(
        claim, about, statement, Finding.UNDECIDED, reason, measure, UNKNOWN, frames, recordings, picture
    )


def at_most(estimate: Estimate, bound: float) -> Finding:
    """The claim that the number is at most ``bound``."""
    if not np.isfinite([estimate.low, estimate.high]).all():
        return Finding.UNDECIDED
    if estimate.high <= bound:
        return Finding.SUPPORTED
    return Finding.CONTRADICTED if estimate.low > bound else Finding.UNDECIDED


def at_least(estimate: Estimate, bound: float) -> Finding:
    """The claim that the number is at least ``bound``."""
    return at_most(Estimate(-estimate.value, -estimate.high, -estimate.low), -bound)


def reason_of(finding: Finding, supported: str, contradicted: str) -> str:
    """The words for a finding."""
    return {
        Finding.SUPPORTED: supported,
        Finding.CONTRADICTED: contradicted,
        Finding.UNDECIDED: "the interval holds both the claim and its contrary",
    }[finding]
