"""The loop on a problem small enough to solve by hand."""

import pytest
import torch
from jaxtyping import Float
from torch import Tensor, nn

from sdt_tools.training.loop import Batch, EpochRecord, LoopConfig, LoopResult, run_loop
from sdt_tools.training.schedule import LearningRateConfig

SIGNS = Batch(torch.tensor([[1.0], [-1.0], [2.0], [-2.0]]), torch.tensor([1, 0, 1, 0]))
CONFIG = LoopConfig(epochs=30, learning_rate=LearningRateConfig(peak=0.1))


class Forbid:
    """Pushes the second class down everywhere; notes when it was asked."""

    def __init__(self) -> None:
        self.asked: list[float] = []

    def __call__(self, network: nn.Module, progress: float) -> Float[Tensor, ""]:
        self.asked.append(progress)
        logits = network(torch.zeros(1, 1))
        return 50.0 * nn.functional.softplus(logits[0, 1] - logits[0, 0])


def train(network: nn.Module, term: Forbid | None = None) -> tuple[LoopResult, list[EpochRecord]]:
    seen: list[EpochRecord] = []
    return run_loop(network, [SIGNS], SIGNS, CONFIG, 0, seen.append, term), seen


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
    assert result.kept_epoch == 30
    assert list(result.history) == seen
    assert network(SIGNS.ranges_m).argmax(1).tolist() == SIGNS.labels.tolist()
    assert not network.training


def test_a_safety_term_is_asked_each_step_and_shapes_the_answer() -> None:
    free, bound, term = linear(), linear(), Forbid()
    train(free)
    train(bound, term)
    assert term.asked == pytest.approx([step / 30 for step in range(30)])
    assert second_over_first_at_zero(bound) < second_over_first_at_zero(free) - 0.5


def test_the_history_tells_the_clean_loss_alone() -> None:
    network = linear()
    with torch.no_grad():
        expected = float(nn.functional.cross_entropy(network(SIGNS.ranges_m), SIGNS.labels))
    _, seen = train(network, Forbid())
    assert seen[0].train_loss == pytest.approx(expected)
