"""A checkpoint's folder, whatever network is in it: ``weights.safetensors`` and ``model.toml``, whole or not at all.

Reading takes numbers and text; nothing in the folder is ever executed.
"""

import os
import shutil
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import torch
from safetensors import SafetensorError
from safetensors.torch import load as parse_safetensors
from safetensors.torch import save as dump_safetensors
from torch import Tensor, nn

from sdt_tools.config import parse_config
from sdt_tools.errors import CheckpointError, ConfigError, OutputExistsError
from sdt_tools.models.card import FORMAT, Card, card_to_toml

WEIGHTS: Final = "weights.safetensors"
CARD: Final = "model.toml"

VISION_KIND: Final = "vision"
FOLLOW_KINDS: Final = ("follow_gate", "follow_plain")

_CardT = TypeVar("_CardT", bound=Card)


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


def write_folder(folder: Path, network: nn.Module, card: Card, attachments: Mapping[str, bytes] | None = None) -> None:
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


def read_card(folder: Path, card: type[_CardT], kinds: Collection[str]) -> _CardT:
    """The card in ``folder``, of one of ``kinds``.

    Raises CheckpointError where there is none, it is of another format or kind, or its network answers other classes.
    """
    path = folder / CARD
    values = _read_values(folder)
    if values.get("format") != FORMAT:
        raise CheckpointError(f"{path}: format {values.get('format')!r}, but this version reads {FORMAT}")
    _check_kind(path, values.get("kind"), kinds)
    try:
        read = parse_config(card, values, str(path))
    except ConfigError as error:
        raise CheckpointError(str(error)) from None
    expected = card.model_fields["classes"].default
    if values.get("classes", list(expected)) != list(expected):
        raise CheckpointError(f"{path}: answers {', '.join(values['classes'])}, not {', '.join(expected)}")
    return read


def kind_in(folder: Path) -> object:
    """What the card in ``folder`` says of the kind of its network. Raises CheckpointError where there is no card."""
    return _read_values(folder).get("kind")


def fill_network(folder: Path, network: nn.Module) -> None:
    """Give ``network`` the weights in ``folder`` and put it in inference mode.

    Raises CheckpointError for weights that are missing, damaged, not finite, or of another architecture.
    """
    weights = _read_weights(folder)
    _check_weights(folder, weights, network.state_dict())
    network.load_state_dict(weights)
    network.eval()


def _read_values(folder: Path) -> dict[str, Any]:
    """The card in ``folder`` as it stands."""
    if not folder.exists():
        raise CheckpointError(f"{folder}: no such checkpoint; train one with 'sdt train'")
    if not folder.is_dir():
        raise CheckpointError(f"{folder}: is a file; a checkpoint is a folder with {CARD} and {WEIGHTS}")
    return _read_toml(folder / CARD)


def _check_kind(path: Path, kind: object, kinds: Collection[str]) -> None:
    if kind in kinds:
        return
    if kind == VISION_KIND:
        raise CheckpointError(
            f"{path}: a vision network, which answers images; a follow network, which answers scans, is needed here"
        )
    if kind in FOLLOW_KINDS:
        raise CheckpointError(
            f"{path}: a follow network, which answers scans; a vision network, which answers images, is needed here"
        )
    known = ", ".join([*FOLLOW_KINDS, VISION_KIND])
    raise CheckpointError(f"{path}: a network of kind {kind!r}; this version knows {known}")


def _cannot_write(folder: Path, error: OSError) -> str:
    return f"{folder}: cannot be written: {error.strerror or error}; choose another --out"


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(_read_bytes(path).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CheckpointError(f"{path}: not valid TOML: {error}") from None


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
        raise CheckpointError(
            f"{path}: missing, so {path.parent} is not a whole checkpoint; copy it again, or train it"
        ) from None
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read: {error.strerror or error}") from None


def _write_durably(path: Path, content: bytes) -> None:
    with path.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
