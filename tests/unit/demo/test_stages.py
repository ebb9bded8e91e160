from pathlib import Path

import pytest

from sdt_tools.demo import stages
from sdt_tools.runs.unit import Unit, execute, finished
from sdt_tools.training.follow import FollowTrainingConfig


def test_a_training_that_was_interrupted_is_not_taken_for_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(stages, "train_follow", interrupt)
    unit = Unit("model", stages.train_stage, {"dataset": tmp_path / "data", "config": FollowTrainingConfig()})
    with pytest.raises(KeyboardInterrupt):
        execute(unit, tmp_path)
    assert not finished(unit, tmp_path)
    assert not (tmp_path / "model").exists()
