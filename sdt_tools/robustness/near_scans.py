"""Attacks near real scans: an object pasted ahead, and all ranges free to move a little.

A domain holds scans that no room would give. A box around a real scan with an object 10 cm ahead holds nothing but what
a sensor might well report, and a forward answer in it is the paper's Figure 3 (right).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64, Int64
from pydantic import Field, model_validator

from sdt_tools.config import Config
from sdt_tools.frames import FORWARD_CLASSES, MAX_RANGE_M, RAYS
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.robustness.attacks import AttackConfig, AttackResult, attack
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import NOT_FORWARD

_OBJECT_SLACK_M: Final = 0.01
"""How far the object's own rays may move: it stays an object at 10 cm."""

_FORWARD: Final = [int(motion) for motion in sorted(FORWARD_CLASSES)]


class NearScanConfig(Config):
    """An object of ``width`` rays around ``centre_ray`` at ``object_m``, and ``radius_m`` for every other ray."""

    centre_ray: int = Field(default=270, ge=0, lt=RAYS)
    width: int = Field(default=20, ge=1)
    object_m: float = Field(default=0.10, gt=0.0, le=MAX_RANGE_M)
    radius_m: float = Field(default=0.10, gt=0.0)

    @model_validator(mode="after")
    def _on_the_scan(self) -> "NearScanConfig":
        if self.first_ray < 0 or self.first_ray + self.width > RAYS:
            raise ValueError(f"an object of {self.width} rays around ray {self.centre_ray} is not on the scan")
        return self

    @property
    def first_ray(self) -> int:
        """The object's rightmost ray."""
        return self.centre_ray - self.width // 2


@dataclass(frozen=True, eq=False)
class NearScanResult:
    """What came of scans with an object in them: ``pasted_m`` as they were, and the answers to them.

    ``attacked`` holds the worst scan found near each.
    """

    pasted_m: Float64[np.ndarray, "scans rays"]
    answers: Int64[np.ndarray, "scans"]
    attacked: AttackResult

    @property
    def forward_before(self) -> int:
        """Scans answered with forward though nothing was moved."""
        return int(np.isin(self.answers, _FORWARD).sum())

    @property
    def forward_after(self) -> int:
        """Scans near which one is answered with forward."""
        return int((self.attacked.violated | np.isin(self.answers, _FORWARD)).sum())


def attack_near_scans(
    model: LoadedModel,
    ranges_m: Float64[np.ndarray, "scans rays"],
    near: NearScanConfig,
    config: AttackConfig,
) -> NearScanResult:
    """Search for forward answers near code-resolved scans that an object has been put into."""
    pasted_m = ranges_m.copy()
    pasted_m[:, near.first_ray : near.first_ray + near.width] = near.object_m
    answers = model.predict_logits(pasted_m).argmax(axis=1)
    return NearScanResult(pasted_m, answers, attack(model.network, near_scan_boxes(pasted_m, near), config))


def near_scan_boxes(pasted_m: Float64[np.ndarray, "scans rays"], near: NearScanConfig) -> DomainSet:
    """A box around each scan; no forward class is allowed in it. Its ``rays`` are the scans' numbers."""
    slack_m = np.full(pasted_m.shape[1], near.radius_m)
    slack_m[near.first_ray : near.first_ray + near.width] = min(_OBJECT_SLACK_M, near.radius_m)
    lower_m, upper_m = np.clip(pasted_m - slack_m, 0.0, MAX_RANGE_M), np.clip(pasted_m + slack_m, 0.0, MAX_RANGE_M)
    return DomainSet(f"within {near.radius_m:g} m", lower_m, upper_m, np.arange(len(pasted_m)), NOT_FORWARD)
