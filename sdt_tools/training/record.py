"""What is noted of an epoch."""

from dataclasses import Field, dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable


@runtime_checkable
class Record(Protocol):
    """A dataclass that something is noted in."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


@dataclass(frozen=True)
class EpochRecord:
    """One epoch: means over its batches as they were trained on (varied, with dropout), and the validation after it.

    Both losses are plain cross-entropies, without label smoothing and safety term. ``bound`` is the largest worst-case
    loss of a safety domain, in nats; it, ``certified_share`` and ``worst_margin`` are None without domains.
    """

    epoch: int
    learning_rate: float
    train_loss: float
    train_accuracy: float
    val_loss: float
    val_accuracy: float
    val_forward_recall: float
    seconds: float
    bound: float | None = None
    certified_share: float | None = None
    worst_margin: float | None = None
