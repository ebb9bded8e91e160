import math

import numpy as np
import pytest

from sdt_tools.frames import MotionClass
from sdt_tools.training.metrics import score

F, LF, RF, STAY = MotionClass.FORWARD, MotionClass.LEFT_FORWARD, MotionClass.RIGHT_FORWARD, MotionClass.STAY


def answers(*classes: MotionClass) -> np.ndarray:
    return np.eye(7, dtype=np.float32)[list(classes)]


def test_metrics_of_a_handful_of_frames_counted_by_hand() -> None:
    of = score(answers(F, LF, STAY, STAY, RF), np.array([F, F, LF, STAY, RF], np.int64))
    assert of.accuracy == pytest.approx(3 / 5)
    assert of.forward_recall == pytest.approx(3 / 4)
    assert of.recall["forward"] == pytest.approx(1 / 2)
    assert of.recall["left_forward"] == 0.0
    assert math.isnan(of.recall["backward"])
    assert of.confusion[LF, STAY] == 1
    assert of.confusion[STAY, LF] == 0


def test_metrics_for_the_card_leave_out_what_was_not_measured() -> None:
    metrics = score(answers(STAY, F), np.array([STAY, STAY], np.int64)).as_metrics("val")
    assert metrics["val_recall"] == {"stay": 0.5}
    assert "val_forward_recall" not in metrics
    assert metrics["val_frames"] == 2
