"""The one training loop: every training runs through it, with or without safety domains.

With them it is Algorithm 1 of the paper: a step goes down the loss of a batch of data plus that of a batch of domains.
As printed, the algorithm ends when the least number of epochs is done *or* the safety bound is at most δ; here it ends
when both hold, or when no epochs are left. Training without domains is the case without a safety term.
"""

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
from sdt_tools.frames import FORWARD_CLASSES
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.training.record import EpochRecord
from sdt_tools.training.safety import SafetyRecord
from sdt_tools.training.schedule import LearningRateConfig, learning_rate
from sdt_tools.training.snapshot import SnapshotFile


class LoopConfig(Config):
    """How long and how carefully: Adam with decoupled weight decay, its steps bounded by ``gradient_norm``.

    ``epochs`` are always done; up to ``extra_epochs`` follow while the safety bound is above δ.
    """

    epochs: int = Field(default=80, ge=1)
    extra_epochs: int = Field(default=40, ge=0)
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
    """Training data in batches."""

    def __len__(self) -> int:
        """Batches in an epoch."""
        ...

    def epoch(self, number: int) -> Iterator[Batch]:
        """The batches of epoch ``number``, which depend on nothing drawn before."""
        ...


@runtime_checkable
class Safety(Protocol):
    """Safety domains as the loop sees them."""

    @property
    def clean_weight(self) -> float:
        """What the loss on the data counts."""
        ...

    def begin(self, epoch: int) -> None:
        """Make the draws of ``epoch``, whatever was drawn before."""
        ...

    def loss(self, progress: float) -> Float[Tensor, ""]:
        """What is added to the loss of a step, λ included, when the share ``progress`` of the planned steps is done."""
        ...

    def measure(self) -> SafetyRecord:
        """How the network stands to its domains."""
        ...

    def satisfied(self, record: SafetyRecord) -> bool:
        """Whether training may end."""
        ...


@dataclass(frozen=True)
class LoopResult:
    """The epochs, and whether the safety bound is at most δ; None where there are no domains."""

    history: tuple[EpochRecord, ...]
    satisfied: bool | None


def run_loop(
    network: nn.Module,
    batches: Batches,
    validation: Batch,
    config: LoopConfig,
    seed: int,
    on_epoch: Callable[[EpochRecord], None],
    safety: Safety | None = None,
    snapshot: SnapshotFile[EpochRecord] | None = None,
) -> LoopResult:
    """Train ``network`` in place, on one thread; the same inputs give the same weights on the same machine.

    The weights of the last epoch stand: the learning rate has run out by then, and choosing an epoch by its validation
    accuracy would make that accuracy too good to be true. With a ``snapshot``, the state is kept after each epoch, and
    a training that was interrupted goes on from there to the same weights.
    Raises RunError when the loss is no longer finite.
    """
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=config.learning_rate.peak, weight_decay=config.weight_decay, foreach=True
    )
    history = snapshot.restore(network, optimizer) if snapshot else []
    satisfied = safety.satisfied(_safety_record(history[-1])) if safety and history else None
    with one_torch_thread(), torch.random.fork_rng(devices=[]):
        try:
            for epoch in range(len(history) + 1, config.epochs + config.extra_epochs + 1):
                if epoch > config.epochs and satisfied is not False:
                    break
                torch.manual_seed(1_000_003 * seed + epoch)
                record, satisfied = _epoch(network, batches, validation, config, optimizer, epoch, safety)
                history.append(record)
                if snapshot:
                    snapshot.save(network, optimizer, history)
                on_epoch(record)
        finally:
            network.eval()
    return LoopResult(tuple(history), satisfied)


def _epoch(
    network: nn.Module,
    batches: Batches,
    validation: Batch,
    config: LoopConfig,
    optimizer: torch.optim.Optimizer,
    epoch: int,
    safety: Safety | None,
) -> tuple[EpochRecord, bool | None]:
    """Train for one epoch and look at what it brought; with domains, say whether they are satisfied."""
    started = time.monotonic()
    rate, loss, accuracy = _descend(network, batches, config, optimizer, epoch, safety)
    if not math.isfinite(loss):
        raise RunError(f"training diverged in epoch {epoch}: the loss is not finite; lower learning_rate.peak")
    network.eval()
    val_loss, val_accuracy, val_forward_recall = _validate(network, validation)
    safe = safety.measure() if safety else None
    if safe and math.isnan(safe.bound):
        raise RunError(f"training diverged in epoch {epoch}: the safety bound is no number; lower learning_rate.peak")
    record = EpochRecord(
        epoch=epoch,
        learning_rate=rate,
        train_loss=loss,
        train_accuracy=accuracy,
        val_loss=val_loss,
        val_accuracy=val_accuracy,
        val_forward_recall=val_forward_recall,
        seconds=time.monotonic() - started,
        **(vars(safe) if safe else {}),
    )
    return record, safety.satisfied(safe) if safety and safe else None


def _safety_record(record: EpochRecord) -> SafetyRecord:
    """What an epoch with domains noted of them."""
    assert record.bound is not None
    assert record.certified_share is not None
    assert record.worst_margin is not None
    return SafetyRecord(record.bound, record.certified_share, record.worst_margin)


def _descend(
    network: nn.Module,
    batches: Batches,
    config: LoopConfig,
    optimizer: torch.optim.Optimizer,
    epoch: int,
    safety: Safety | None,
) -> tuple[float, float, float]:
    """The steps of one epoch: the last learning rate, and loss and accuracy on the data."""
    network.train()
    if safety:
        safety.begin(epoch)
    total_loss, correct, frames, rate = 0.0, 0, 0, 0.0
    for place, batch in enumerate(batches.epoch(epoch)):
        progress = (epoch - 1 + place / len(batches)) / config.epochs
        rate = learning_rate(config.learning_rate, progress)
        for group in optimizer.param_groups:
            group["lr"] = rate
        logits = network(batch.ranges_m)
        loss = functional.cross_entropy(logits, batch.labels, label_smoothing=config.label_smoothing)
        if safety:
            loss = safety.clean_weight * loss + safety.loss(progress)
        optimizer.zero_grad()
        torch.autograd.backward(loss)
        nn.utils.clip_grad_norm_(network.parameters(), config.gradient_norm)
        optimizer.step()
        size = len(batch.labels)
        total_loss += float(functional.cross_entropy(logits.detach(), batch.labels)) * size
        correct += int((logits.argmax(1) == batch.labels).sum())
        frames += size
    return rate, total_loss / frames, correct / frames


def _validate(network: nn.Module, validation: Batch) -> tuple[float, float, float]:
    """Loss, accuracy, and forward recall, which is NaN where no frame has a forward label."""
    forward = torch.tensor([int(motion) for motion in sorted(FORWARD_CLASSES)])
    with torch.inference_mode():
        logits = network(validation.ranges_m)
        loss = functional.cross_entropy(logits, validation.labels)
        answers = logits.argmax(1)
        due = torch.isin(validation.labels, forward)
        recall = torch.isin(answers[due], forward).float().mean()
    return float(loss), float((answers == validation.labels).float().mean()), float(recall)
