"""Checkpoints of follow networks; those of vision networks are in ``vision.checkpoint``."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, TypeVar

from sdt_tools.errors import CheckpointError
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint_folder import CARD, fill_network, read_card, write_folder
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig
from sdt_tools.models.gated_net import GatedFollowNet, GatedNetConfig
from sdt_tools.models.loaded import LoadedModel

_ShapeT = TypeVar("_ShapeT", FollowNetConfig, GatedNetConfig)


def _plain(card: ModelCard) -> FollowNet:
    return FollowNet(_architecture(card, FollowNetConfig), card.preprocess)


def _gated(card: ModelCard) -> FollowNet:
    return GatedFollowNet(_architecture(card, GatedNetConfig), card.preprocess)


def _architecture(card: ModelCard, expected: type[_ShapeT]) -> _ShapeT:
    if not isinstance(card.architecture, expected):
        raise CheckpointError(f"{CARD}: the architecture is not that of a network of kind {card.kind!r}")
    return card.architecture


ARCHITECTURES: Final[Mapping[str, Callable[[ModelCard], FollowNet]]] = {
    FollowNet.kind: _plain,
    GatedFollowNet.kind: _gated,
}
"""How a network is built from its card, by the card's ``kind``."""


def save_checkpoint(
    folder: Path, network: FollowNet, card: ModelCard, attachments: Mapping[str, bytes] | None = None
) -> None:
    """Write ``folder`` with weights, card and ``attachments`` (content by file name), whole or not at all.

    Raises OutputExistsError where the folder exists and CheckpointError where it cannot be written.
    """
    write_folder(folder, network, card, attachments)


def load_checkpoint(folder: Path) -> LoadedModel:
    """The follow network in ``folder``, in inference mode.

    Raises CheckpointError, naming the folder and what is wrong with it: missing, incomplete, of another format or
    architecture, a vision network, with weights that do not fit or are not finite.
    """
    card = read_card(folder, ModelCard, ARCHITECTURES)
    network = ARCHITECTURES[card.kind](card)
    fill_network(folder, network)
    return LoadedModel(folder.resolve().name, network, card)
