"""Which domains a training is held to: a level of the paper's, a file of the user's, or balls around the data."""

from pathlib import Path

import numpy as np
from jaxtyping import Float32, Int64
from pydantic import Field, model_validator

from sdt_tools.config import Config
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import SafetyLevel, domains
from sdt_tools.training.safety import adversarial_domains


class SpecificationConfig(Config):
    """One source of safety domains, or none: ``level`` 0 and nothing else.

    ``domains`` is a TOML file. ``epsilon_m`` holds each training scan's label within that distance of each of its
    ranges, which is adversarial training.
    """

    level: int = Field(default=0, ge=0, le=4)
    domains: Path | None = None
    epsilon_m: float | None = Field(default=None, gt=0.0)

    @model_validator(mode="after")
    def _one_source(self) -> "SpecificationConfig":
        given = {"level": self.level > 0, "domains": self.domains is not None, "epsilon_m": self.epsilon_m is not None}
        several = [name for name, chosen in given.items() if chosen]
        if len(several) > 1:
            raise ValueError(f"{' and '.join(several)} contradict each other; give one")
        return self

    @property
    def empty(self) -> bool:
        """Whether nothing is asked for."""
        return self.level == 0 and self.domains is None and self.epsilon_m is None


def specification(
    config: SpecificationConfig, ranges_m: Float32[np.ndarray, "frames rays"], labels: Int64[np.ndarray, "frames"]
) -> tuple[DomainSet, ...]:
    """The domains that ``config`` asks for; the code-resolved training data are what ``epsilon_m`` goes around.

    Raises ConfigError for a file of domains that is missing or wrong.
    """
    if config.domains is not None:
        from sdt_tools.robustness.domain_file import load_domains

        return load_domains(config.domains)
    if config.epsilon_m is not None:
        return adversarial_domains(ranges_m, labels, config.epsilon_m)
    return (domains(SafetyLevel(config.level)),)
