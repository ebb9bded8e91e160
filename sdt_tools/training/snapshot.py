"""A training under way, as a file: what is needed to go on after the last whole epoch as if nothing had happened.

Randomness needs no keeping, since every epoch draws from the seed and its own number.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Generic, TypeVar

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from sdt_tools.errors import ConfigError, RunError
from sdt_tools.training.record import Record

_RecordT = TypeVar("_RecordT", bound=Record)


def unfinished(out: Path) -> Path:
    """Where the state of a training is kept that is to become the checkpoint ``out``."""
    return out.with_name(f"{out.name}.unfinished.safetensors")


@dataclass(frozen=True)
class SnapshotFile(Generic[_RecordT]):
    """Where a training keeps its state, and what it is a training of; another's state is not gone on with.

    ``record`` makes what is noted of an epoch from its values by name.
    """

    path: Path
    settings: Mapping[str, object]
    record: Callable[..., _RecordT]

    def save(self, network: nn.Module, optimizer: torch.optim.Optimizer, history: Sequence[_RecordT]) -> None:
        """Replace the state by that after the last epoch of ``history``."""
        tensors = {f"weights.{name}": value.contiguous() for name, value in network.state_dict().items()}
        for place, state in optimizer.state_dict()["state"].items():
            tensors |= {f"optimizer.{place}.{name}": value.contiguous() for name, value in state.items()}
        about = {"settings": json.dumps(self.settings), "history": json.dumps([asdict(record) for record in history])}
        scratch = self.path.with_name(f".{self.path.name}.{os.getpid()}")
        save_file(tensors, scratch, about)
        scratch.replace(self.path)

    def restore(self, network: nn.Module, optimizer: torch.optim.Optimizer) -> list[_RecordT]:
        """Give ``network`` and ``optimizer`` the kept state and return the epochs that led to it; none without a file.

        Raises ConfigError where the file is of a training with other settings, RunError where it is damaged.
        """
        if not self.path.exists():
            return []
        try:
            with safe_open(self.path, "pt") as kept:
                about: dict[str, str] = kept.metadata() or {}
                tensors = {name: kept.get_tensor(name) for name in kept.keys()}  # noqa: SIM118
            settings, history = json.loads(about["settings"]), json.loads(about["history"])
        except (SafetensorError, KeyError, ValueError) as error:
            raise RunError(
                f"{self.path}: the unfinished training is damaged ({error}); delete it to begin anew"
            ) from None
        self._refuse_other(settings)
        network.load_state_dict(_below("weights", tensors))
        groups = optimizer.state_dict()["param_groups"]
        places = range(sum(len(group["params"]) for group in groups))
        state = {place: _below(f"optimizer.{place}", tensors) for place in places}
        optimizer.load_state_dict({"state": state, "param_groups": groups})
        return [self.record(**row) for row in history]

    def discard(self) -> None:
        """The training is done."""
        self.path.unlink(missing_ok=True)

    def _refuse_other(self, settings: Mapping[str, object]) -> None:
        mine = json.loads(json.dumps(self.settings))
        changed = sorted(
            f"{name} {_brief(settings.get(name))} to {_brief(mine.get(name))}"
            for name in mine.keys() | settings.keys()
            if mine.get(name) != settings.get(name)
        )
        if changed:
            raise ConfigError(
                f"{self.path}: an unfinished training with other settings ({', '.join(changed)}); "
                "ask for the same ones to go on with it, or delete it"
            )


def _below(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name.removeprefix(f"{prefix}."): value for name, value in tensors.items() if name.startswith(f"{prefix}.")}


def _brief(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}…"
