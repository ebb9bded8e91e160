import math
from dataclasses import replace

import pytest

from sdt_tools.evaluation.outcome import Judge, Outcome, Situation, SuccessConfig, Verdict
from sdt_tools.frames import Pose2D

FOLLOWING = Situation(
    time_s=0.0,
    robot=Pose2D(0.0, 0.0, 0.0),
    operator_range_m=1.0,
    operator_bearing_rad=0.0,
    operator_visible=True,
    operator_standing=False,
    operator_ended=False,
    contact=None,
)


def watch(changes: dict[str, object], until_s: float, timeout_s: float = 90.0) -> tuple[Verdict | None, float]:
    """The verdict on a run that looks the same from its start, and when it fell."""
    judge = Judge(timeout_s, SuccessConfig())
    time_s = 0.0
    while time_s <= until_s:
        verdict = judge.see(replace(FOLLOWING, **changes, time_s=time_s))
        if verdict:
            return verdict, time_s
        time_s += 0.1
    return None, time_s


def test_touching_anything_ends_the_run() -> None:
    verdict, _ = watch({"contact": "wall"}, 1.0)
    assert verdict == Verdict(Outcome.CONTACT, "touched wall")


@pytest.mark.parametrize("changes", [{"operator_range_m": 3.2}, {"operator_visible": False}])
def test_an_operator_out_of_reach_is_lost_after_three_seconds(changes: dict[str, object]) -> None:
    verdict, at_s = watch(changes, 10.0)
    assert verdict is not None
    assert verdict.outcome is Outcome.LOST
    assert at_s == pytest.approx(3.1, abs=0.11)


def test_an_operator_who_comes_back_in_time_is_not_lost() -> None:
    judge = Judge(90.0, SuccessConfig())
    for step in range(100):
        away = step % 30 < 25
        verdict = judge.see(replace(FOLLOWING, time_s=step / 10, operator_range_m=3.5 if away else 2.0))
        assert verdict is None


def test_arriving_counts_only_after_the_operator_has_ended_his_path() -> None:
    assert watch({}, 20.0)[0] is None
    assert watch({"operator_ended": True}, 1.0)[0] == Verdict(Outcome.OK, "arrived")


@pytest.mark.parametrize(
    "changes",
    [
        {"operator_bearing_rad": math.radians(26)},
        {"operator_range_m": 0.55},
        {"operator_range_m": 1.55},
    ],
)
def test_ending_elsewhere_is_stuck_after_ten_seconds(changes: dict[str, object]) -> None:
    verdict, at_s = watch({"operator_ended": True, **changes}, 20.0)
    assert verdict is not None
    assert verdict.outcome is Outcome.STUCK
    assert at_s == pytest.approx(10.1, abs=0.11)


def test_standing_still_before_a_waiting_operator_is_stuck() -> None:
    verdict, at_s = watch({"operator_standing": True, "operator_range_m": 1.8}, 30.0)
    assert verdict is not None
    assert verdict.outcome is Outcome.STUCK
    assert at_s == pytest.approx(15.1, abs=0.2)


def test_a_run_without_end_times_out() -> None:
    verdict, at_s = watch({}, 40.0, timeout_s=20.0)
    assert verdict == Verdict(Outcome.TIMEOUT, "not finished after 20 s")
    assert at_s == pytest.approx(20.0, abs=0.11)
