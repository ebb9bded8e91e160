"""The loop on a problem small enough to solve by hand."""

from collections.abc import Iterator

import pytest
import torch
from jaxtyping import Float
from torch import Tensor, nn

from sdt_tools.training.loop import Batch, LoopConfig, LoopResult, run_loop
from sdt_tools.training.record import EpochRecord
from sdt_tools.training.safety import SafetyRecord
from sdt_tools.training.schedule import LearningRateConfig

SIGNS = Batch(torch.tensor([[1.0], [-1.0], [2.0], [-2.0]]), torch.tensor([1, 0, 1, 0]))
CONFIG = LoopConfig(epochs=30, extra_epochs=5, learning_rate=LearningRateConfig(peak=0.1))


class OneBatch:
    """Every epoch is the one batch."""

    def __len__(self) -> int:
        return 1

    def epoch(self, number: int) -> Iterator[Batch]:
        yield SIGNS


class Forbid:
    """Pushes the second class down everywhere; notes when it was asked. Satisfied from an epoch on."""

    clean_weight = 1.0

    def __init__(self, network: nn.Module, satisfied_at: int = 1) -> None:
        self.asked: list[float] = []
        self.begun: list[int] = []
        self._network = network
        self._satisfied_at = satisfied_at

    def begin(self, epoch: int) -> None:
        self.begun.append(epoch)

    def loss(self, progress: float) -> Float[Tensor, ""]:
        self.asked.append(progress)
        logits = self._network(torch.zeros(1, 1))
        return 50.0 * nn.functional.softplus(logits[0, 1] - logits[0, 0])

    def measure(self) -> SafetyRecord:
        return SafetyRecord(bound=0.5, certified_share=1.0, worst_margin=2.0)

    def satisfied(self, record: SafetyRecord) -> bool:
        return self.begun[-1] >= self._satisfied_at


def train(network: nn.Module, safety: Forbid | None = None) -> tuple[LoopResult, list[EpochRecord]]:
    seen: list[EpochRecord] = []
    return run_loop(network, OneBatch(), SIGNS, CONFIG, 0, seen.append, safety), seen


def linear() -> nn.Linear:
    torch.manual_seed(0)
    return nn.Linear(1, 2)


def second_over_first_at_zero(network: nn.Module) -> float:
    with torch.inference_mode():
        first, second = network(torch.zeros(1, 1))[0].tolist()
    return second - first


def test_the_last_epoch_stands() -> None:
    network = linear()
    result, seen = train(network)
    assert len(seen) == 30
    assert list(result.history) == seen
    assert result.satisfied is None
    assert network(SIGNS.ranges_m).argmax(1).tolist() == SIGNS.labels.tolist()
    assert not network.training


def test_a_safety_term_is_asked_each_step_and_shapes_the_answer() -> None:
    free, bound = linear(), linear()
    term = Forbid(bound)
    train(free)
    train(bound, term)
    assert term.asked == pytest.approx([step / 30 for step in range(30)])
    assert second_over_first_at_zero(bound) < second_over_first_at_zero(free) - 0.5


def test_the_history_tells_the_clean_loss_alone_and_the_bound_beside_it() -> None:
    network = linear()
    with torch.no_grad():
        expected = float(nn.functional.cross_entropy(network(SIGNS.ranges_m), SIGNS.labels))
    _, seen = train(network, Forbid(network))
    assert seen[0].train_loss == pytest.approx(expected)
    assert (seen[0].bound, seen[0].certified_share, seen[0].worst_margin) == (0.5, 1.0, 2.0)


@pytest.mark.parametrize(("satisfied_at", "epochs"), [(3, 30), (34, 34), (100, 35)])
def test_training_ends_after_its_epochs_once_the_bound_is_reached_or_none_are_left(
    satisfied_at: int, epochs: int
) -> None:
    network = linear()
    result, seen = train(network, Forbid(network, satisfied_at))
    assert len(seen) == epochs
    assert result.satisfied is (satisfied_at <= 35)


def test_forward_recall_is_that_of_frames_with_a_forward_label() -> None:
    network = linear()
    with torch.no_grad():
        network.weight.copy_(torch.tensor([[0.0], [1.0]]))
        network.bias.copy_(torch.tensor([1.5, 0.0]))  # class 1, forward, from 1.5 on: one of the two frames
    still = LearningRateConfig(peak=1e-12)
    result = run_loop(network, OneBatch(), SIGNS, LoopConfig(epochs=1, learning_rate=still), 0, [].append)
    assert result.history[0].val_forward_recall == pytest.approx(0.5)
