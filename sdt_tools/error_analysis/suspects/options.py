"""How suspects are looked for."""

from typing import Literal

from pydantic import Field, model_validator

from sdt_tools.config import Config
from sdt_tools.training.follow import FollowTrainingConfig
from sdt_tools.training.recipes import recipe_for
from sdt_tools.training.specification import SpecificationConfig


def _brief() -> FollowTrainingConfig:
    """Level 0, in fewer epochs than a network that is to drive: after more it learns wrong labels by heart."""
    recipe = recipe_for(SpecificationConfig(), "plain")
    return recipe.model_copy(update={"loop": recipe.loop.model_copy(update={"epochs": 30})})


class SuspectOptions(Config):
    """Every choice behind a suspect; saved with every result.

    ``folds``: parts that the recordings are split into, each answered by a network trained on the others as
    ``training`` says, without safety domains. ``method``: how cleanlab decides (its ``filter_by``; Northcutt et al.
    2021, "Confident Learning"). ``spacing_s``: where frames are taken from recordings, the least time between two of
    one. ``seed`` deals out the folds; networks begin from it, the fold, and the seed of ``training``.
    """

    folds: int = Field(default=5, ge=2, le=20)
    method: Literal["prune_by_noise_rate", "prune_by_class", "both", "confident_learning"] = "both"
    spacing_s: float = Field(default=0.1, ge=0.0)
    seed: int = Field(default=0, ge=0)
    training: FollowTrainingConfig = Field(default_factory=_brief)

    @model_validator(mode="after")
    def _plain(self) -> "SuspectOptions":
        if not self.training.specification.empty or self.training.arch != "plain":
            raise ValueError("training: suspects are found by plain networks of level 0; leave arch and domains out")
        return self
