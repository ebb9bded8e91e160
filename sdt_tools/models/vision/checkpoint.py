"""Checkpoints of vision networks."""

from collections.abc import Mapping
from pathlib import Path

from sdt_tools.models.card import VisionCard
from sdt_tools.models.checkpoint_folder import fill_network, read_card, write_folder
from sdt_tools.models.vision.loaded import LoadedVisionModel, ready_to_answer
from sdt_tools.models.vision.net import VisionNet


def save_vision_checkpoint(
    folder: Path, network: VisionNet, card: VisionCard, attachments: Mapping[str, bytes] | None = None
) -> None:
    """Write ``folder`` with weights, card and ``attachments`` (content by file name), whole or not at all.

    Raises OutputExistsError where the folder exists and CheckpointError where it cannot be written.
    """
    write_folder(folder, network, card, attachments)


def load_vision_checkpoint(folder: Path) -> LoadedVisionModel:
    """The vision network in ``folder``, ready to answer.

    Raises CheckpointError, naming the folder and what is wrong with it: missing, incomplete, of another format or
    architecture, a follow network, with weights that do not fit or are not finite.
    """
    card = read_card(folder, VisionCard, (VisionNet.kind,))
    network = VisionNet(card.architecture, card.preprocess)
    fill_network(folder, network)
    network.requires_grad_(False)
    return ready_to_answer(folder.resolve().name, network, card)
