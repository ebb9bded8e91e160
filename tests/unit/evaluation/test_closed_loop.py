from importlib.resources import files
from pathlib import Path

import polars as pl
import pytest

from sdt_tools.config import dump_config
from sdt_tools.errors import ConfigError, UsageError
from sdt_tools.evaluation.closed_loop import ClosedLoopConfig, drive_closed_loop
from sdt_tools.evaluation.evaluate import evaluate_follow
from sdt_tools.evaluation.grid import parse_seeds
from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.evaluation.policies import ConstantPolicy, ExpertPolicy, policy_for
from sdt_tools.evaluation.saving import SaveRuns, recorder_factory
from sdt_tools.frames import LidarScan, MotionClass, MotionCommand
from sdt_tools.recording.reader import Recording
from sdt_tools.scene.scenario import layout_for

CONFIG = ClosedLoopConfig()


def test_the_expert_arrives_where_standing_still_does_not() -> None:
    layouts = [layout_for("plain", seed) for seed in (0, 1)]
    assert {run.outcome for run in drive_closed_loop(layouts, ExpertPolicy(), CONFIG)} == {Outcome.OK}
    stay = drive_closed_loop(layouts, ConstantPolicy(MotionClass.STAY), CONFIG)
    assert {run.outcome for run in stay} <= {Outcome.STUCK, Outcome.LOST}


def test_driving_blindly_ahead_ends_in_contact() -> None:
    (run,) = drive_closed_loop([layout_for("plain", 3)], ConstantPolicy(MotionClass.FORWARD), CONFIG)
    assert run.outcome is Outcome.CONTACT
    assert run.reason.startswith("touched ")


def test_a_run_does_not_depend_on_the_runs_beside_it() -> None:
    alone = drive_closed_loop([layout_for("around_boxes", 5)], ExpertPolicy(), CONFIG)
    beside = drive_closed_loop([layout_for("around_boxes", seed) for seed in (4, 5, 6)], ExpertPolicy(), CONFIG)
    assert beside[1] == alone[0]


def test_decisions_fall_ten_times_a_second() -> None:
    (run,) = drive_closed_loop([layout_for("plain", 0)], ConstantPolicy(MotionClass.STAY), CONFIG)
    times_s = [point.time_s for point in run.trace]
    assert times_s[:3] == pytest.approx([0.0, 0.1, 0.2])


def test_decisions_keep_their_rate_when_scans_come_half_as_often() -> None:
    config = ClosedLoopConfig.model_validate({"scene": {"rates": {"scan_hz": 25.0}}})
    (run,) = drive_closed_loop([layout_for("plain", 0)], ConstantPolicy(MotionClass.STAY), config)
    times_s = [point.time_s for point in run.trace]
    assert times_s[:5] == pytest.approx([0.0, 0.12, 0.2, 0.32, 0.4])


def test_an_edited_scenario_file_is_driven_again(tmp_path: Path) -> None:
    scenario = tmp_path / "own.toml"
    packaged = files("sdt_tools.scene").joinpath("scenarios/plain.toml").read_text()
    own = packaged.replace('name = "plain"', 'name = "own"')
    counts = []
    for text in (own, own.replace("timeout_s = 90", "timeout_s = 2")):
        scenario.write_text(text)
        summary = evaluate_follow(["expert"], [str(scenario)], [0], CONFIG, tmp_path / "out")
        counts.append(summary.models["expert"]["own"].outcomes)
    assert (counts[0]["ok"], counts[1]["timeout"]) == (1, 1)


def test_two_scenarios_of_one_name_are_not_mixed(tmp_path: Path) -> None:
    scenario = tmp_path / "mine.toml"
    scenario.write_text(files("sdt_tools.scene").joinpath("scenarios/plain.toml").read_text())
    with pytest.raises(UsageError, match="scenario plain is given twice"):
        evaluate_follow(["expert"], ["plain", str(scenario)], [0], CONFIG, tmp_path / "out")


def test_a_saved_run_is_an_ordinary_recording_with_the_experts_advice(tmp_path: Path) -> None:
    factory = recorder_factory(tmp_path, "constant:stay", SaveRuns.FAILED, dump_config(CONFIG))
    (run,) = drive_closed_loop([layout_for("plain", 1)], ConstantPolicy(MotionClass.STAY), CONFIG, factory)
    assert run.recording is not None
    messages = [received.message for received in Recording.open(tmp_path / run.recording).messages()]
    commands = [message for message in messages if isinstance(message, MotionCommand)]
    scans = {message.stamp_ns for message in messages if isinstance(message, LidarScan)}
    assert len(commands) == len(run.trace)
    assert {command.motion for command in commands} == {MotionClass.STAY}
    assert None not in {command.expert for command in commands}
    assert len({command.expert for command in commands}) > 1
    assert {command.stamp_ns for command in commands} <= scans


def test_runs_that_are_ok_are_not_kept_among_the_failed(tmp_path: Path) -> None:
    factory = recorder_factory(tmp_path, "expert", SaveRuns.FAILED, dump_config(CONFIG))
    (run,) = drive_closed_loop([layout_for("plain", 1)], ExpertPolicy(), CONFIG, factory)
    assert run.recording is None
    assert list(tmp_path.iterdir()) == []


def test_an_evaluation_counts_by_model_and_scenario_and_is_not_run_twice(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    for _ in range(2):
        summary = evaluate_follow(
            ["expert", "constant:stay"],
            ["plain"],
            [0, 1],
            CONFIG,
            tmp_path,
            progress=lambda done, total: seen.append((done, total)),
        )
    assert (summary.models["expert"]["plain"].ok, summary.models["constant:stay"]["plain"].ok) == (2, 0)
    assert summary.real_time_factor > 0
    assert len(pl.read_parquet(summary.runs)) == 4
    assert seen == [(0, 2), (1, 2), (2, 2), (2, 2)]


@pytest.mark.parametrize(
    ("models", "scenario", "message"),
    [
        (["constant:fly"], "plain", "'fly': no such motion class; the classes are stay, forward"),
        (["expert"], "plane", "plane"),
        (["expert", "expert"], "plain", "model expert is given twice"),
        ([], "plain", "no model given"),
    ],
)
def test_a_wrong_call_is_refused_before_anything_runs(
    tmp_path: Path, models: list[str], scenario: str, message: str
) -> None:
    with pytest.raises((UsageError, ConfigError), match=message):
        evaluate_follow(models, [scenario], [0], CONFIG, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_missing_model_is_named() -> None:
    with pytest.raises(UsageError, match="nowhere"):
        policy_for("nowhere")


def test_seeds_are_parsed_as_written() -> None:
    assert parse_seeds("7") == [7]
    assert parse_seeds("1000-1003, 5") == [1000, 1001, 1002, 1003, 5]


@pytest.mark.parametrize("text", ["", "a", "3-1", "1-", "-4"])
def test_malformed_seeds_are_refused_with_the_text(text: str) -> None:
    with pytest.raises(UsageError, match="give seeds as"):
        parse_seeds(text)
