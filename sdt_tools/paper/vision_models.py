"""The networks of the vision study: how each is trained, and how it is attacked."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from sdt_tools.demo.demo import StageProgress
from sdt_tools.paper.vision_config import VisionStudyConfig
from sdt_tools.paper.vision_data import training_seeds
from sdt_tools.paper.vision_stages import attack_stage, train_vision_stage
from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit
from sdt_tools.training.vision.config import VisionTrainingConfig, vision_recipe

CONTROL: Final = "control"
"""Networks trained plainly, on the schedule of the attacked ones."""


@dataclass(frozen=True)
class TrainedVision:
    """One network: ``family`` is ``epsilon0`` and the like or ``control``; its stage's folder, and the checkpoint."""

    family: str
    epsilon: int
    seed: int
    dataset: Path
    folder: Path

    @property
    def checkpoint(self) -> Path:
        """The checkpoint's folder, named after family and seed."""
        return self.folder / self.folder.name


def train_vision_models(
    out: Path, data: Sequence[Path], config: VisionStudyConfig, workers: int, progress: StageProgress
) -> list[TrainedVision]:
    """Train every family with every seed; the first seed's networks, which drive, come first."""
    wanted = list(_wanted(out, data, config))
    units = [
        Unit(
            f"models/{one.folder.name}",
            train_vision_stage,
            {"dataset": one.dataset, "config": vision_settings(one.family, one.epsilon, one.seed, config)},
            {"name": one.folder.name, "kept": out / "unfinished"},
        )
        for one in wanted
    ]
    run_units(units, out, workers, partial(progress, "trainings"))
    return wanted


def attack_models(
    out: Path, trained: Sequence[TrainedVision], config: VisionStudyConfig, workers: int, progress: StageProgress
) -> list[Path]:
    """Attack each network on its validation images, at every ε of the study above 0; return the stages' folders."""
    units = [
        Unit(
            f"attacks/{one.folder.name}",
            attack_stage,
            {
                "model": one.checkpoint,
                "dataset": one.dataset,
                "epsilons": tuple(epsilon for epsilon in config.epsilons if epsilon),
                "config": config.attack,
                "images": config.attacked_images,
            },
        )
        for one in trained
    ]
    return run_units(units, out, workers, partial(progress, "attacks"))


def vision_settings(family: str, epsilon: int, seed: int, config: VisionStudyConfig) -> VisionTrainingConfig:
    """The recipe for ε, at the study's sizes; a control has that of the largest ε, but for the attack."""
    planned = config.attacked_epochs if epsilon or family == CONTROL else config.plain_epochs
    recipe = vision_recipe("lite0", max(config.epsilons) if family == CONTROL else epsilon, planned)
    changed: dict[str, object] = {
        "seed": seed,
        "preprocess": recipe.preprocess.model_copy(update={"width": config.width, "height": config.height}),
    }
    if family == CONTROL:
        changed["adversarial"] = recipe.adversarial.model_copy(update={"epsilon": 0})
    if planned is not None:
        changed["epochs"] = planned
    return recipe.model_copy(update=changed)


def _wanted(out: Path, data: Sequence[Path], config: VisionStudyConfig) -> Iterator[TrainedVision]:
    families = [(f"epsilon{epsilon}", epsilon) for epsilon in config.epsilons]
    if any(config.epsilons):
        families.append((CONTROL, 0))
    for seed, dataset in zip(training_seeds(config), data, strict=True):
        for family, epsilon in families:
            yield TrainedVision(family, epsilon, seed, dataset, out / "models" / f"{family}-seed{seed}")
