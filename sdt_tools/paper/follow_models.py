"""The networks of the follow study: which are trained on what, held to which level."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from sdt_tools.demo.demo import StageProgress
from sdt_tools.paper.follow_config import FollowStudyConfig
from sdt_tools.paper.training_stage import train_stage
from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit
from sdt_tools.training.follow import FollowTrainingConfig
from sdt_tools.training.recipes import recipe_for
from sdt_tools.training.specification import SpecificationConfig

Size = Literal["paper", "large"]


@dataclass(frozen=True, order=True)
class Family:
    """Networks that differ in their training seed alone. ``weight`` is the λ of a sweep, None for the recipe's."""

    size: Size
    arch: str
    level: int
    weight: float | None = None

    @property
    def name(self) -> str:
        """As in ``paper-plain-level3``."""
        swept = "" if self.weight is None else f"-lambda{self.weight:g}"
        return f"{self.size}-{self.arch}-level{self.level}{swept}"


@dataclass(frozen=True)
class Trained:
    """One network: the folder of its stage, and the checkpoint in it."""

    family: Family
    seed: int
    folder: Path
    checkpoint: Path


MAIN: Final = (
    Family("paper", "plain", 0),
    Family("paper", "plain", 1),
    Family("paper", "plain", 2),
    Family("paper", "plain", 3),
    Family("paper", "gate", 4),
    Family("large", "plain", 0),
    Family("large", "gate", 4),
)
"""What is driven and judged."""


def swept(config: FollowStudyConfig) -> list[Family]:
    """The λ sweep: plain networks at the paper's levels."""
    return [Family("paper", "plain", level, weight) for level in (1, 2, 3) for weight in config.swept_weights]


def train_models(
    out: Path,
    families: Mapping[Family, int],
    paper_data: Sequence[Path],
    large_data: Path,
    config: FollowStudyConfig,
    workers: int,
    progress: StageProgress,
) -> list[Trained]:
    """Train so many seeds of each family; the longest trainings first."""
    wanted = sorted(_wanted(families), key=lambda one: one[0].size)  # large before paper
    units = [
        Unit(
            f"models/{family.name}-seed{seed}",
            train_stage,
            {
                "dataset": large_data if family.size == "large" else paper_data[seed],
                "config": settings(family, seed, config),
                "name": f"{family.name}-seed{seed}",
            },
        )
        for family, seed in wanted
    ]
    folders = run_units(units, out, workers, lambda done, total: progress("trainings", done, total))
    return [
        Trained(family, seed, folder, folder / folder.name)
        for (family, seed), folder in zip(wanted, folders, strict=True)
    ]


def settings(family: Family, seed: int, config: FollowStudyConfig) -> FollowTrainingConfig:
    """The recipe for a family's level and architecture, with the study's sizes."""
    recipe = recipe_for(SpecificationConfig(level=family.level), family.arch)
    large = family.size == "large"
    epochs = config.large_epochs if large else config.paper_epochs
    changed: dict[str, object] = {"seed": seed, "loop": recipe.loop.model_copy(update={"epochs": epochs})}
    if large:
        changed |= {"architecture": config.large_architecture, "preprocess": config.large_preprocess}
    if family.weight is not None:
        changed["safety"] = recipe.safety.model_copy(update={"weight": family.weight})
    return recipe.model_copy(update=changed)


def _wanted(families: Mapping[Family, int]) -> Iterator[tuple[Family, int]]:
    for family, count in families.items():
        for seed in range(count):
            yield family, seed
