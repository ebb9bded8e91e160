import pytest
from pydantic import ValidationError

from sdt_tools.training.schedule import LearningRateConfig, learning_rate

CONFIG = LearningRateConfig(peak=2.0, warm_up_share=0.1, decay_share=0.4)


@pytest.mark.parametrize(
    ("progress", "rate"), [(0.05, 1.0), (0.1, 2.0), (0.3, 2.0), (0.6, 2.0), (0.8, 1.0), (0.9, 0.29289321881345254)]
)
def test_the_rate_warms_up_rests_and_decays(progress: float, rate: float) -> None:
    assert learning_rate(CONFIG, progress) == pytest.approx(rate)


def test_the_first_step_learns_and_the_last_hardly_does() -> None:
    assert 0.0 < learning_rate(CONFIG, 0.0) < 0.01
    assert 0.0 < learning_rate(CONFIG, 0.999) < 1e-4


def test_shares_of_0_mean_none() -> None:
    flat = LearningRateConfig(peak=2.0, warm_up_share=0.0, decay_share=0.0)
    assert [learning_rate(flat, progress) for progress in (0.0, 0.5, 0.999)] == [2.0, 2.0, 2.0]


def test_shares_that_overlap_are_refused() -> None:
    with pytest.raises(ValidationError, match="together exceed 1"):
        LearningRateConfig(warm_up_share=0.7, decay_share=0.5)
