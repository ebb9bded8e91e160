"""Shapes of vision networks, and what is done with a picture before it is seen."""

from typing import Annotated, Final, Literal

from pydantic import Field

from sdt_tools.config import Config

IMAGENET_MEAN: Final = (123.675, 116.28, 103.53)
IMAGENET_STD: Final = (58.395, 57.12, 57.375)
"""Statistics of ImageNet's colours, red, green, blue, that ResNet's weights were trained with."""


class LiteStage(Config):
    """Blocks of one width: each widens ``expand``-fold, convolves every channel by itself, and narrows again.

    The first block has the ``stride``.
    """

    blocks: int = Field(ge=1)
    kernel: Literal[3, 5]
    stride: Literal[1, 2]
    expand: int = Field(ge=1)
    width: int = Field(ge=1)


class LiteConfig(Config):
    """An EfficientNet-Lite; by default Lite0 (efficientnet_lite_builder.py of the TPU models, 2020)."""

    family: Literal["efficientnet_lite"] = "efficientnet_lite"
    stem: int = Field(default=32, ge=1)
    stages: tuple[LiteStage, ...] = Field(
        default=(
            LiteStage(blocks=1, kernel=3, stride=1, expand=1, width=16),
            LiteStage(blocks=2, kernel=3, stride=2, expand=6, width=24),
            LiteStage(blocks=2, kernel=5, stride=2, expand=6, width=40),
            LiteStage(blocks=3, kernel=3, stride=2, expand=6, width=80),
            LiteStage(blocks=3, kernel=5, stride=1, expand=6, width=112),
            LiteStage(blocks=4, kernel=5, stride=2, expand=6, width=192),
            LiteStage(blocks=1, kernel=3, stride=1, expand=6, width=320),
        ),
        min_length=1,
    )
    head: int = Field(default=1280, ge=1)
    dropout: float = Field(default=0.2, ge=0.0, lt=1.0)

    @property
    def blocks(self) -> int:
        """How many blocks stand between stem and head."""
        return sum(stage.blocks for stage in self.stages)

    @property
    def features(self) -> int:
        """How many numbers the classifier sees."""
        return self.head


class ResNetConfig(Config):
    """A residual network of bottlenecks (He et al. 2016, with the stride in the 3×3 convolution); by default ResNet-50.

    One entry of ``depths`` and ``widths`` a stage.
    """

    family: Literal["resnet"] = "resnet"
    stem: int = Field(default=64, ge=1)
    depths: tuple[int, ...] = Field(default=(3, 4, 6, 3), min_length=1)
    widths: tuple[int, ...] = Field(default=(256, 512, 1024, 2048), min_length=1)
    dropout: float = Field(default=0.0, ge=0.0, lt=1.0)

    @property
    def blocks(self) -> int:
        """How many bottlenecks there are."""
        return sum(self.depths)

    @property
    def features(self) -> int:
        """How many numbers the classifier sees."""
        return self.widths[-1]


Backbone = Annotated[LiteConfig | ResNetConfig, Field(discriminator="family")]
"""Shape of a vision network; its ``family`` says which."""


class ImagePreprocessConfig(Config):
    """What is done with a picture: blue-green-red to red-green-blue, then resized, then (colour − mean) / std.

    A picture of another shape than ``width`` : ``height`` is stretched. ``mean`` and ``std`` are in steps of 8 bits, in
    the order red, green, blue. The defaults are EfficientNet-Lite's.
    """

    width: int = Field(default=256, ge=8, le=4096)
    height: int = Field(default=192, ge=8, le=4096)
    mean: tuple[float, float, float] = (127.0, 127.0, 127.0)
    std: tuple[Annotated[float, Field(gt=0)], Annotated[float, Field(gt=0)], Annotated[float, Field(gt=0)]] = (
        128.0,
        128.0,
        128.0,
    )


def preprocess_for(architecture: LiteConfig | ResNetConfig, width: int, height: int) -> ImagePreprocessConfig:
    """The preprocessing that the ImageNet weights of ``architecture`` were trained with, at another size."""
    if isinstance(architecture, ResNetConfig):
        return ImagePreprocessConfig(width=width, height=height, mean=IMAGENET_MEAN, std=IMAGENET_STD)
    return ImagePreprocessConfig(width=width, height=height)
