"""The words of a certificate: verdicts on domains, and the ledger they stand in."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from jaxtyping import Float64
from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.frames import MotionClass
from sdt_tools.robustness.attacks import AttackConfig
from sdt_tools.robustness.intervals import MARGIN


class Verdict(StrEnum):
    """What is known of a domain.

    ``certified``: bounds prove that every forbidden class is beaten by some allowed one in all its scans. ``violated``:
    one of its scans is known that is answered with a forbidden class. ``unknown``: neither. ``error``: it could not be
    found out; the reason is kept.
    """

    CERTIFIED = "certified"
    VIOLATED = "violated"
    UNKNOWN = "unknown"
    ERROR = "error"


class CertifyConfig(Config):
    """How verdicts are come by.

    ``margin``: logits by which an allowed class has to win at least; more is asked of a network that loses more in
    float32. ``attack``: the search for violations in domains that are not certified; None searches none.
    ``attack_certified`` searches certified domains too, to check the bounds. ``error_scans``: scans of each domain on
    which the numerical error is measured, beside its two extreme ones. ``seed`` is that of those scans.
    """

    margin: float = Field(default=MARGIN, ge=0.0)
    attack: AttackConfig | None = AttackConfig(restarts=4, steps=40)
    attack_certified: bool = False
    error_scans: int = Field(default=8, ge=1)
    seed: int = Field(default=0, ge=0)


@dataclass(frozen=True, eq=False)
class DomainVerdict:
    """One domain of one set, and what was found.

    ``margin`` is the provable one: by how many logits each forbidden class is beaten at worst. ``winner`` is the class
    that provably beats them all, where there is such a one.
    ``bound_loss`` is the worst-case loss. ``method`` names what the verdict rests on: ``ibp``, ``pgd`` (a search, with
    which the domain's two extreme scans are tried), or both where neither decided. ``violation`` is the best forbidden
    logit minus the best allowed one, in float64, at the worst scan found, and ``answer`` what the float32 network says
    there; ``scan_m`` is that scan, kept where it is evidence. ``seconds`` is the domain's share of the work, which is
    done for several at once. What does not apply is None.
    """

    set_name: str
    domain: int
    ray: int
    verdict: Verdict
    required_margin: float | None
    seconds: float
    margin: float | None = None
    bound_loss: float | None = None
    winner: MotionClass | None = None
    method: str = "ibp"
    restarts: int = 0
    violation: float | None = None
    answer: MotionClass | None = None
    scan_m: Float64[np.ndarray, "rays"] | None = field(default=None, repr=False)
    error: str = ""


@dataclass(frozen=True, eq=False)
class Ledger:
    """All verdicts on one network, in the order of the specification.

    ``numerical_error`` is the largest difference found between logits of ONNX Runtime in float32 and of torch in
    float64, in the domains; None where answers were not finite.
    """

    model: str
    verdicts: tuple[DomainVerdict, ...]
    numerical_error: float | None
    required_margin: float | None
    seconds: float

    @property
    def counts(self) -> Mapping[Verdict, int]:
        """How many domains have each verdict; the four add up to all domains."""
        given = [verdict.verdict for verdict in self.verdicts]
        return {verdict: given.count(verdict) for verdict in Verdict}

    @property
    def min_margin(self) -> float | None:
        """The smallest provable margin, None without any."""
        return min((one.margin for one in self.verdicts if one.margin is not None), default=None)
