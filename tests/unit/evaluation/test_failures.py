"""What failures have in common, from tables small enough to read."""

import polars as pl
import pytest

from sdt_tools.evaluation.failures import failure_table, nesting, where_failed

OUTCOMES = {
    "mild": ["contact", "ok", "ok", "ok"],
    "strict": ["contact", "stuck", "ok", "ok"],
    "other": ["ok", "ok", "lost", "ok"],
}


def runs() -> pl.DataFrame:
    return pl.DataFrame(
        [
            {"model": model, "scenario": "plain", "seed": seed, "outcome": outcome, "reason": "", "recording": None}
            for model, outcomes in OUTCOMES.items()
            for seed, outcome in enumerate(outcomes)
        ],
        schema_overrides={"recording": pl.String},
    )


def traces() -> pl.DataFrame:
    """Five seconds a run; forward until the last half second, things coming nearer all the time."""
    return pl.DataFrame(
        [
            {
                "model": model,
                "scenario": "plain",
                "seed": seed,
                "time_s": step / 10,
                "motion": "forward" if step < 45 and model == "mild" else "stay",
                "watched_range_m": 5.0 - step / 10,
                "level3_rms_m": 0.2,
                "level4_rms_m": 0.1,
                "operator_range_m": 1.0,
                "operator_bearing_rad": 0.0,
                "robot_x_m": step / 10,
                "robot_y_m": 0.0,
            }
            for model in OUTCOMES
            for seed in range(4)
            for step in range(50 if seed else 25)
        ]
    )


def test_failures_that_the_next_model_shares_are_nested() -> None:
    first, second = nesting(runs(), ["mild", "strict", "other"])
    assert (first.failed_by_first, first.failed_by_both, first.nested) == (1, 1, True)
    assert (second.failed_by_first, second.failed_by_both, second.nested) == (2, 0, False)


def test_chance_is_the_second_models_failure_rate() -> None:
    first, _ = nesting(runs(), ["mild", "strict", "other"])
    assert first.expected == pytest.approx(1 * 2 / 4)


def test_a_failed_run_is_told_by_its_last_second() -> None:
    table = failure_table(runs(), traces())
    assert table.select("model", "seed").rows() == [("mild", 0), ("other", 2), ("strict", 0), ("strict", 1)]
    mild = table.row(0, named=True)
    assert (mild["motion"], mild["forward"]) == ("forward", True)
    assert mild["watched_range_m"] == pytest.approx(2.6)
    assert mild["end_s"] == pytest.approx(2.4)
    assert mild["share_of_time"] == pytest.approx(1.0)
    assert table.row(3, named=True)["forward"] is False


def test_where_models_fail_is_summed_up() -> None:
    found = where_failed(failure_table(runs(), traces()), ["mild", "strict", "other"])
    assert [(one.model, one.failures, one.forward) for one in found] == [
        ("mild", 1, 1),
        ("strict", 2, 0),
        ("other", 1, 0),
    ]
    assert found[0].median_watched_range_m == pytest.approx(2.6)


def test_without_failures_there_is_no_median() -> None:
    fine = runs().with_columns(pl.lit("ok").alias("outcome"))
    (one,) = where_failed(failure_table(fine, traces()), ["mild"])
    assert (one.failures, one.median_watched_range_m) == (0, None)
