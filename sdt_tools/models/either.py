"""A checkpoint of either network, for whoever takes both."""

from pathlib import Path

from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.models.checkpoint_folder import VISION_KIND, kind_in
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.vision.checkpoint import load_vision_checkpoint
from sdt_tools.models.vision.loaded import LoadedVisionModel


def load_either(folder: Path) -> LoadedModel | LoadedVisionModel:
    """The network in ``folder``, a follow or a vision network, ready to answer. Raises CheckpointError."""
    return load_vision_checkpoint(folder) if kind_in(folder) == VISION_KIND else load_checkpoint(folder)
