"""The training loop of the vision network: one for plain and for adversarial training, which is plain where ε is 0."""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import torch
from jaxtyping import Float16, Int64
from torch import Tensor, nn
from torch.nn import functional

from sdt_tools.errors import RunError
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.models.vision.net import VisionNet, tune_last
from sdt_tools.training.schedule import learning_rate
from sdt_tools.training.snapshot import SnapshotFile
from sdt_tools.training.vision.batches import FeatureBatch, GestureBatches, trunk_features
from sdt_tools.training.vision.config import VisionTrainingConfig
from sdt_tools.training.vision.data import VisionData


@dataclass(frozen=True)
class VisionEpoch:
    """One epoch: means over its batches as they were trained on, and the clean validation after it.

    Trained on are varied images, attacked by ``epsilon``, with dropout. Losses are plain cross-entropies.
    """

    epoch: int
    epsilon: int
    learning_rate: float
    train_loss: float
    train_accuracy: float
    val_loss: float
    val_accuracy: float
    seconds: float


def run_vision_loop(
    network: VisionNet,
    data: VisionData,
    config: VisionTrainingConfig,
    on_epoch: Callable[[VisionEpoch], None],
    snapshot: SnapshotFile[VisionEpoch] | None = None,
) -> tuple[VisionEpoch, ...]:
    """Train the last layers of ``network`` in place, on one thread; the same inputs give the same weights.

    The weights of the last epoch stand. With a ``snapshot``, the state is kept after each epoch, and a training that
    was interrupted goes on from there to the same weights. Raises RunError when the loss is no longer finite.
    """
    frozen = tune_last(network, config.last_blocks)
    trained = [parameter for parameter in network.parameters() if parameter.requires_grad]
    optimizer = torch.optim.AdamW(trained, lr=config.learning_rate.peak, weight_decay=config.weight_decay, foreach=True)
    history = snapshot.restore(network, optimizer) if snapshot else []
    batches = GestureBatches(network, frozen, data.train, config.batch_size, config.views, config.seed)
    network.eval()
    with one_torch_thread(), torch.random.fork_rng(devices=[]):
        kept = trunk_features(network, frozen, data.val.images_u8)
        labels = torch.from_numpy(data.val.labels)
        for epoch in range(len(history) + 1, config.epochs + 1):
            started = time.monotonic()
            torch.manual_seed(1_000_003 * config.seed + epoch)
            epsilon = config.adversarial.epsilon_in(epoch)
            if epsilon:
                drawn = batches.attacked(epoch, epsilon, config.adversarial.clean_share)
            else:
                drawn = batches.plain(epoch)
            try:
                rate, loss, accuracy = _descend(network, frozen, drawn, len(batches), config, optimizer, epoch)
            finally:
                network.eval()
            if not math.isfinite(loss):
                raise RunError(f"training diverged in epoch {epoch}: the loss is not finite; lower learning_rate.peak")
            val_loss, val_accuracy = _validate(network, frozen, kept, labels)
            seconds = time.monotonic() - started
            history.append(VisionEpoch(epoch, epsilon, rate, loss, accuracy, val_loss, val_accuracy, seconds))
            if snapshot:
                snapshot.save(network, optimizer, history)
            on_epoch(history[-1])
    network.requires_grad_(False)
    return tuple(history)


def _descend(
    network: VisionNet,
    frozen: int,
    drawn: Iterable[FeatureBatch],
    count: int,
    config: VisionTrainingConfig,
    optimizer: torch.optim.Optimizer,
    epoch: int,
) -> tuple[float, float, float]:
    """The steps of one epoch: the last learning rate, and loss and accuracy on what was trained on."""
    total_loss, correct, images, rate = 0.0, 0, 0, 0.0
    network.train()
    for place, batch in enumerate(drawn):
        rate = learning_rate(config.learning_rate, (epoch - 1 + place / count) / config.epochs)
        for group in optimizer.param_groups:
            group["lr"] = rate
        logits = network.tail(batch.features, frozen)
        loss = functional.cross_entropy(logits, batch.labels, label_smoothing=config.label_smoothing)
        optimizer.zero_grad()
        torch.autograd.backward(loss)
        nn.utils.clip_grad_norm_(optimizer.param_groups[0]["params"], config.gradient_norm)
        optimizer.step()
        size = len(batch.labels)
        total_loss += float(functional.cross_entropy(logits.detach(), batch.labels)) * size
        correct += int((logits.argmax(1) == batch.labels).sum())
        images += size
    return rate, total_loss / images, correct / images


def _validate(
    network: VisionNet,
    frozen: int,
    kept: Float16[Tensor, "images channels rows columns"],
    labels: Int64[Tensor, "images"],
) -> tuple[float, float]:
    with torch.inference_mode():
        logits = torch.cat([network.tail(part.float(), frozen) for part in torch.split(kept, 32)])
    loss = functional.cross_entropy(logits, labels)
    return float(loss), float((logits.argmax(1) == labels).float().mean())
