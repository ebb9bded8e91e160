"""Checkpoints: a folder with ``weights.safetensors`` and ``model.toml``, written whole or not at all.

Loading reads numbers and text; nothing in the folder is ever executed.
"""

import os
import shutil
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, TypeVar

import torch
from safetensors import SafetensorError
from safetensors.torch import load as parse_safetensors
from safetensors.torch import save as dump_safetensors
from torch import Tensor

from sdt_tools.config import parse_config
from sdt_tools.errors import CheckpointError, ConfigError, OutputExistsError
from sdt_tools.frames import MotionClass
from sdt_tools.models.card import FORMAT, ModelCard, card_to_toml
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig
from sdt_tools.models.gated_net import GatedFollowNet, GatedNetConfig
from sdt_tools.models.loaded import LoadedModel

WEIGHTS: Final = "weights.safetensors"
CARD: Final = "model.toml"

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


def reserve(folder: Path) -> None:
    """Make sure, before long work, that a checkpoint can be put at ``folder``; its parent is made.

    Raises OutputExistsError where it exists, CheckpointError where the parent cannot be made.
    """
    if folder.exists():
        raise OutputExistsError(folder)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CheckpointError(_cannot_write(folder, error)) from None


def save_checkpoint(
    folder: Path, network: FollowNet, card: ModelCard, attachments: Mapping[str, bytes] | None = None
) -> None:
    """Write ``folder`` with weights, card and ``attachments`` (content by file name), whole or not at all.

    Raises OutputExistsError where the folder exists and CheckpointError where it cannot be written.
    """
    reserve(folder)
    weights = {name: tensor.detach().contiguous() for name, tensor in network.state_dict().items()}
    files = {WEIGHTS: dump_safetensors(weights), CARD: card_to_toml(card).encode(), **(attachments or {})}
    scratch = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    shutil.rmtree(scratch, ignore_errors=True)
    try:
        scratch.mkdir()
        for name, content in files.items():
            _write_durably(scratch / name, content)
        scratch.rename(folder)
    except OSError as error:
        raise CheckpointError(_cannot_write(folder, error)) from None
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def load_checkpoint(folder: Path) -> LoadedModel:
    """The network in ``folder``, in inference mode.

    Raises CheckpointError, naming the folder and what is wrong with it: missing, incomplete, of another format or
    architecture, with weights that do not fit or are not finite.
    """
    if not folder.exists():
        raise CheckpointError(f"{folder}: no such checkpoint; train one with 'sdt train'")
    if not folder.is_dir():
        raise CheckpointError(f"{folder}: is a file; a checkpoint is a folder with {CARD} and {WEIGHTS}")
    card = _read_card(folder)
    network = ARCHITECTURES[card.kind](card)
    weights = _read_weights(folder)
    _check_weights(folder, weights, network.state_dict())
    network.load_state_dict(weights)
    return LoadedModel(folder.resolve().name, network.eval(), card)


def _cannot_write(folder: Path, error: OSError) -> str:
    return f"{folder}: cannot be written: {error.strerror or error}; choose another --out"


def _read_card(folder: Path) -> ModelCard:
    path = folder / CARD
    try:
        values = tomllib.loads(_read_bytes(path).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CheckpointError(f"{path}: not valid TOML: {error}") from None
    if values.get("format") != FORMAT:
        raise CheckpointError(f"{path}: format {values.get('format')!r}, but this version reads {FORMAT}")
    if values.get("kind") not in ARCHITECTURES:
        known = ", ".join(sorted(ARCHITECTURES))
        raise CheckpointError(f"{path}: a network of kind {values.get('kind')!r}; this version knows {known}")
    try:
        card = parse_config(ModelCard, values, str(path))
    except ConfigError as error:
        raise CheckpointError(str(error)) from None
    expected = tuple(motion.label for motion in MotionClass)
    if card.classes != expected:
        raise CheckpointError(
            f"{path}: answers {', '.join(card.classes)}, not the motion classes {', '.join(expected)}"
        )
    return card


def _read_weights(folder: Path) -> dict[str, Tensor]:
    path = folder / WEIGHTS
    try:
        return parse_safetensors(_read_bytes(path))
    except (SafetensorError, ValueError, KeyError) as error:
        raise CheckpointError(f"{path}: not a whole safetensors file: {error}") from None


def _check_weights(folder: Path, weights: Mapping[str, Tensor], expected: Mapping[str, Tensor]) -> None:
    path = folder / WEIGHTS
    for name in sorted(expected.keys() - weights.keys()):
        raise CheckpointError(f"{path}: lacks '{name}', which the architecture in {CARD} has")
    for name in sorted(weights.keys() - expected.keys()):
        raise CheckpointError(f"{path}: holds '{name}', which the architecture in {CARD} does not have")
    for name in expected:
        tensor = weights[name]
        if tensor.shape != expected[name].shape or tensor.dtype != expected[name].dtype:
            raise CheckpointError(
                f"{path}: '{name}' is {_shape(tensor)}, but the architecture in {CARD} needs {_shape(expected[name])}"
            )
        if not bool(torch.isfinite(tensor).all()):
            raise CheckpointError(f"{path}: '{name}' has values that are not finite; the training must have diverged")


def _shape(tensor: Tensor) -> str:
    return f"{str(tensor.dtype).removeprefix('torch.')} {list(tensor.shape)}"


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise CheckpointError(f"{path}: missing, so {path.parent} is not a whole checkpoint") from None
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read: {error.strerror or error}") from None


def _write_durably(path: Path, content: bytes) -> None:
    with path.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
