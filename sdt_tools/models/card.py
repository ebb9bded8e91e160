"""What a checkpoint says of itself: enough to rebuild the network, and to know what it was made from."""

from collections.abc import Mapping
from typing import Annotated, Final

import tomli_w
from pydantic import Discriminator, Field, JsonValue, Tag

from sdt_tools import __version__
from sdt_tools.config import Config
from sdt_tools.frames import Gesture, MotionClass
from sdt_tools.models.follow_net import FollowNetConfig
from sdt_tools.models.gated_net import GatedNetConfig
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.models.vision.config import Backbone, ImagePreprocessConfig

FORMAT: Final = 1


def _shape_of(architecture: object) -> str:
    gated = "trunk" in architecture if isinstance(architecture, Mapping) else isinstance(architecture, GatedNetConfig)
    return "gate" if gated else "plain"


Architecture = Annotated[
    Annotated[FollowNetConfig, Tag("plain")] | Annotated[GatedNetConfig, Tag("gate")], Discriminator(_shape_of)
]
"""Shape of a follow network; that of a gated one has a ``trunk``."""


class Card(Config):
    """What the content of every ``model.toml`` has in common.

    ``training`` is the resolved configuration of the training, ``dataset_hash`` that of the data set's manifest,
    ``metrics`` numbers by name, as in ``val_accuracy``; tables and lists of them are allowed.
    """

    format: int = FORMAT
    kind: str
    code_version: str = __version__
    seed: int
    dataset: str = ""
    dataset_hash: str = ""
    training: Mapping[str, JsonValue] = Field(default_factory=dict)
    metrics: Mapping[str, JsonValue] = Field(default_factory=dict)


class ModelCard(Card):
    """The card of a follow network."""

    classes: tuple[str, ...] = tuple(motion.label for motion in MotionClass)
    architecture: Architecture
    preprocess: PreprocessConfig


class VisionCard(Card):
    """The card of a vision network."""

    classes: tuple[str, ...] = tuple(gesture.label for gesture in Gesture)
    architecture: Backbone
    preprocess: ImagePreprocessConfig


def card_to_toml(card: Card) -> str:
    """The card as TOML text."""
    return tomli_w.dumps(card.model_dump(mode="json", exclude_none=True))
