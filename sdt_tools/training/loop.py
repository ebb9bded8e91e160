"""The one training loop: every training runs through it, with or without a safety term.

A step minimises the cross-entropy of a batch plus, where one is given, a safety term: Algorithm 1 of the paper.
Training without safety domains is the case without a term.
"""

import copy
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import torch
from jaxtyping import Float, Float32, Int64
from pydantic import Field
from torch import Tensor, nn
from torch.nn import functional

from sdt_tools.config import Config
from sdt_tools.errors import RunError
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.training.schedule import LearningRateConfig, learning_rate


class LoopConfig(Config):
    """How long and how carefully: Adam with decoupled weight decay, its steps bounded by ``gradient_norm``."""

    epochs: int = Field(default=80, ge=1)
    learning_rate: LearningRateConfig = LearningRateConfig()
    weight_decay: float = Field(default=0.05, ge=0.0)
    label_smoothing: float = Field(default=0.1, ge=0.0, lt=1.0)
    gradient_norm: float = Field(default=5.0, gt=0.0)


@dataclass(frozen=True, eq=False)
class Batch:
    """Code-resolved scans in metres, and their classes."""

    ranges_m: Float32[Tensor, "batch rays"]
    labels: Int64[Tensor, "batch"]


@runtime_checkable
class Batches(Protocol):
    """One epoch of batches after the other."""

    def __len__(self) -> int:
        """Batches in an epoch."""
        ...

    def __iter__(self) -> Iterator[Batch]:
        """The next epoch."""
        ...


@runtime_checkable
class SafetyTerm(Protocol):
    """What is added to the loss of a step, λ included."""

    def __call__(self, network: nn.Module, progress: float) -> Float[Tensor, ""]:
        """The term for ``network`` when the share ``progress`` of all steps is done."""
        ...


@dataclass(frozen=True)
class EpochRecord:
    """One epoch: means over its batches as they were trained on (varied, with dropout), and the validation after it.

    Both losses are plain cross-entropies, without label smoothing and safety term.
    """

    epoch: int
    learning_rate: float
    train_loss: float
    train_accuracy: float
    val_loss: float
    val_accuracy: float
    seconds: float


@dataclass(frozen=True)
class LoopResult:
    """``kept_epoch`` is the epoch whose weights the network has now: the last, or the best where it was interrupted."""

    history: tuple[EpochRecord, ...]
    kept_epoch: int
    interrupted: bool


def run_loop(
    network: nn.Module,
    batches: Batches,
    validation: Batch,
    config: LoopConfig,
    seed: int,
    on_epoch: Callable[[EpochRecord], None],
    safety_term: SafetyTerm | None = None,
) -> LoopResult:
    """Train ``network`` in place, on one thread; the same inputs give the same weights on the same machine.

    The weights of the last epoch stand: the learning rate has run out by then, and choosing an epoch by its validation
    accuracy would make that accuracy too good to be true. When interrupted (KeyboardInterrupt) after a whole epoch, the
    best epoch on validation so far is kept, and the result says so; before that, the interruption is passed on.
    Raises RunError when the loss is no longer finite.
    """
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=config.learning_rate.peak, weight_decay=config.weight_decay, foreach=True
    )
    history: list[EpochRecord] = []
    best_weights: dict[str, Tensor] = {}
    best = -math.inf
    with one_torch_thread(), torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        try:
            for epoch in range(1, config.epochs + 1):
                record = _train_epoch(network, batches, validation, config, optimizer, epoch, safety_term)
                history.append(record)
                if record.val_accuracy > best:
                    best, best_weights = record.val_accuracy, copy.deepcopy(network.state_dict())
                on_epoch(record)
        except KeyboardInterrupt:
            if not history:
                raise
            network.load_state_dict(best_weights)
            kept = max(history, key=lambda record: record.val_accuracy)
            return LoopResult(tuple(history), kept.epoch, interrupted=True)
        finally:
            network.eval()
    return LoopResult(tuple(history), len(history), interrupted=False)


def _train_epoch(
    network: nn.Module,
    batches: Batches,
    validation: Batch,
    config: LoopConfig,
    optimizer: torch.optim.Optimizer,
    epoch: int,
    safety_term: SafetyTerm | None,
) -> EpochRecord:
    started = time.monotonic()
    network.train()
    total_loss, correct, frames, rate = 0.0, 0, 0, 0.0
    for place, batch in enumerate(batches):
        progress = (epoch - 1 + place / len(batches)) / config.epochs
        rate = learning_rate(config.learning_rate, progress)
        for group in optimizer.param_groups:
            group["lr"] = rate
        logits = network(batch.ranges_m)
        loss = functional.cross_entropy(logits, batch.labels, label_smoothing=config.label_smoothing)
        if safety_term is not None:
            loss = loss + safety_term(network, progress)
        optimizer.zero_grad()
        torch.autograd.backward(loss)
        nn.utils.clip_grad_norm_(network.parameters(), config.gradient_norm)
        optimizer.step()
        size = len(batch.labels)
        total_loss += float(functional.cross_entropy(logits.detach(), batch.labels)) * size
        correct += int((logits.argmax(1) == batch.labels).sum())
        frames += size
    if not math.isfinite(total_loss):
        raise RunError(f"training diverged in epoch {epoch}: the loss is not finite; lower learning_rate.peak")
    val_loss, val_accuracy = _validate(network, validation)
    seconds = time.monotonic() - started
    return EpochRecord(epoch, rate, total_loss / frames, correct / frames, val_loss, val_accuracy, seconds)


def _validate(network: nn.Module, validation: Batch) -> tuple[float, float]:
    network.eval()
    with torch.inference_mode():
        logits = network(validation.ranges_m)
        loss = functional.cross_entropy(logits, validation.labels)
    return float(loss), float((logits.argmax(1) == validation.labels).float().mean())
