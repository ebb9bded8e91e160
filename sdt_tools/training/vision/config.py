"""All that shapes a vision network beside its data."""

from pathlib import Path
from typing import Final

from pydantic import Field, model_validator

from sdt_tools.config import Config
from sdt_tools.errors import UsageError
from sdt_tools.models.vision.config import Backbone, ImagePreprocessConfig, LiteConfig, ResNetConfig, preprocess_for
from sdt_tools.training.schedule import LearningRateConfig
from sdt_tools.training.vision.views import ViewConfig


class AdversarialConfig(Config):
    """How training images are attacked.

    ``epsilon`` counts steps of 8-bit colour; 0 is plain training. The first ``plain_epochs`` are at 0; then ε rises by
    one step every ``ramp_epochs`` epochs, or stands at once where that is 0. ``clean_share`` of every batch is left as
    it is (0 in the paper).
    """

    epsilon: int = Field(default=0, ge=0, le=255)
    plain_epochs: int = Field(default=0, ge=0)
    ramp_epochs: int = Field(default=0, ge=0)
    clean_share: float = Field(default=0.0, ge=0.0, le=1.0)

    def epsilon_in(self, epoch: int) -> int:
        """ε in ``epoch``, the first being 1."""
        attacked = epoch - self.plain_epochs
        if attacked <= 0:
            return 0
        return min(self.epsilon, -(-attacked // self.ramp_epochs)) if self.ramp_epochs else self.epsilon


class VisionTrainingConfig(Config):
    """The settings of one training.

    ``pretrained`` starts from ImageNet weights, found as ``models.vision.pretrained`` says or at ``weights``. The
    classifier is trained, and with ``last_blocks`` above 0 the head and so many blocks before it.
    """

    seed: int = Field(default=0, ge=0)
    architecture: Backbone = LiteConfig()
    preprocess: ImagePreprocessConfig = ImagePreprocessConfig()
    pretrained: bool = True
    weights: Path | None = None
    last_blocks: int = Field(default=8, ge=0)
    epochs: int = Field(default=7, ge=1)
    batch_size: int = Field(default=32, ge=1)
    adversarial: AdversarialConfig = AdversarialConfig()
    views: ViewConfig = ViewConfig()
    learning_rate: LearningRateConfig = LearningRateConfig(peak=5e-4, warm_up_share=0.1, decay_share=0.6)
    weight_decay: float = Field(default=0.01, ge=0.0)
    label_smoothing: float = Field(default=0.1, ge=0.0, lt=1.0)
    gradient_norm: float = Field(default=5.0, gt=0.0)

    @model_validator(mode="after")
    def _fits(self) -> "VisionTrainingConfig":
        if self.last_blocks > self.architecture.blocks:
            raise ValueError(f"last_blocks is {self.last_blocks}, but the network has {self.architecture.blocks}")
        if self.adversarial.plain_epochs > self.epochs:
            raise ValueError("adversarial.plain_epochs exceeds epochs")
        return self


BACKBONES: Final = ("lite0", "resnet50")
_ATTACKED_EPOCHS: Final = 9


def vision_recipe(backbone: str, epsilon: int, epochs: int | None = None) -> VisionTrainingConfig:
    """What a training without a configuration starts from; of an attacked one's nine epochs five are plain.

    Raises UsageError for an unknown backbone.
    """
    if backbone not in BACKBONES:
        raise UsageError(f"--backbone {backbone}: no such backbone; choose {' or '.join(BACKBONES)}")
    architecture = LiteConfig() if backbone == "lite0" else ResNetConfig()
    plain = VisionTrainingConfig(architecture=architecture, preprocess=preprocess_for(architecture, 256, 192))
    if epsilon == 0:
        return plain
    planned = _ATTACKED_EPOCHS if epochs is None else epochs
    return plain.model_copy(
        update={"epochs": planned, "adversarial": AdversarialConfig(epsilon=epsilon, plain_epochs=planned * 5 // 9)}
    )
