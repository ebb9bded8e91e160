import numpy as np
import polars as pl

from sdt_tools.error_analysis.conditions.search import find_conditions
from sdt_tools.error_analysis.definitions import ErrorOptions, Tag
from sdt_tools.error_analysis.explain import explain
from sdt_tools.error_analysis.selftest.material import Material, with_errors
from sdt_tools.error_analysis.spaces import scan_space
from sdt_tools.error_analysis.tagging import error_neighbours, tag_errors

OPTIONS = ErrorOptions()


def drives(seed: int, recordings: int = 20, frames: int = 100) -> tuple[pl.DataFrame, np.ndarray]:
    """Predictions without errors, and their situations."""
    return Material(recordings=recordings, frames=frames).table_and_scans(np.random.default_rng(seed), OPTIONS)


def line(positions_m: list[float], wrong: list[int], seconds: float = 0.1, **options: object):
    """Tags of one recording with a flat scan a frame, under ε = 0.1 m."""
    rows, _ = drives(0, 1, 2 * len(positions_m))
    rows = rows.head(len(positions_m))
    rows = rows.with_columns(stamp_ns=(np.arange(len(positions_m)) * seconds * 1e9).astype(np.int64))
    frames = with_errors(rows, np.isin(np.arange(len(positions_m)), wrong), OPTIONS)
    scans = np.repeat(np.array(positions_m)[:, None], 4, axis=1).astype(np.float32)
    return explain(frames, scan_space(scans), ErrorOptions(epsilon_m=0.1, **options)).tagged


def test_a_model_that_is_always_wrong_is_systematically_wrong() -> None:
    rows, scans = drives(11, recordings=8, frames=40)
    tagged = explain(with_errors(rows, np.ones(len(rows), bool), OPTIONS), scan_space(scans), OPTIONS).tagged
    assert tagged.count(Tag.SYSTEMATIC) == len(rows)
    assert set(tagged.selection) == {"all"}


def test_a_scenario_that_is_always_wrong_is_named() -> None:
    rows, scans = drives(12, recordings=9, frames=40)
    wrong = (rows["scenario"] == "through_gate").to_numpy()
    tagged = explain(with_errors(rows, wrong, OPTIONS), scan_space(scans), OPTIONS).tagged
    assert np.array_equal(np.array(tagged.tag) == Tag.SYSTEMATIC, wrong)
    assert set(tagged.selection) == {"", "scenario = through_gate"}


def test_right_frames_in_a_systematic_selection_stay_correct() -> None:
    rows, scans = drives(13, recordings=4, frames=40)
    wrong = (rows["recording"] == "drive_001").to_numpy()
    wrong[np.flatnonzero(wrong)[7]] = False
    tagged = explain(with_errors(rows, wrong, OPTIONS), scan_space(scans), ErrorOptions(tau=0.05)).tagged
    assert np.array_equal(np.array(tagged.tag) == Tag.SYSTEMATIC, wrong)


def test_a_selection_of_few_frames_is_not_called_systematic() -> None:
    assert line([0.0, 0.05, 0.9], [0, 1, 2]).count(Tag.SYSTEMATIC) == 0


def test_a_lone_error_among_right_neighbours_is_transient() -> None:
    tagged = line([0.0, 0.04, 0.08, 0.12, 0.16], [2])
    assert tagged.tag[2] is Tag.TRANSIENT
    assert (tagged.neighbours[2], tagged.right_neighbours[2]) == (4, 4)


def test_an_error_with_a_wrong_neighbour_elsewhere_in_time_is_not_transient() -> None:
    tagged = line([0.0, 0.05, 0.1, 0.9, 0.8, 0.11], [1, 5])
    assert tagged.tag[1] is Tag.UNEXPLAINED
    assert not tagged.transient_by_definition[1]


def test_an_error_beyond_epsilon_of_everything_is_isolated() -> None:
    assert line([0.0, 0.05, 0.9, 0.1, 0.15], [2]).tag[2] is Tag.ISOLATED


def test_the_guard_keeps_fast_turns_from_being_transient() -> None:
    positions = [0.0, 0.05, 0.9, 0.1, 0.12]  # the turn carries frame 2 beyond ε; frames 1 and 2 fail together
    tagged = line(positions, [1, 2])
    assert tagged.transient_by_definition[1]
    assert tagged.tag[1] is Tag.UNEXPLAINED
    assert tagged.tag[2] is Tag.UNEXPLAINED
    assert line(positions, [1, 2], guard=False).tag[1] is Tag.TRANSIENT


def test_frames_beyond_a_gap_are_not_just_before_or_after() -> None:
    positions = [0.0, 0.05, 0.9, 0.1, 0.12]
    assert line(positions, [1, 2], seconds=2.0).tag[1] is Tag.TRANSIENT


def test_inside_a_condition_only_an_implausible_lone_error_is_transient() -> None:
    rows = pl.concat(by_recording.head(60) for by_recording in drives(0, 2, 100)[0].partition_by("recording"))
    wrong = np.zeros(120, bool)
    wrong[5] = True
    wrong[60::3] = True  # the condition's errors, among them frame 90
    frames = with_errors(rows, wrong, OPTIONS)
    at = np.concatenate([np.linspace(0, 0.08, 60), 1.0 + np.arange(60)])
    at[89], at[91] = at[90] - 0.05, at[90] + 0.05
    scans = np.repeat(at[:, None], 4, axis=1).astype(np.float32)
    inside = np.ones((1, 120), bool)
    neighbours = error_neighbours(scan_space(scans), frames, inside, 0.1)
    tagged = tag_errors(frames, neighbours, inside, OPTIONS)
    assert tagged.transient_by_definition[[5, 90]].all()
    assert tagged.tag[5] is Tag.TRANSIENT  # 59 right neighbours, although one in six fails under the condition
    assert tagged.tag[90] is Tag.CONDITIONAL  # two right neighbours say little


def test_with_few_recordings_nothing_is_confirmed_and_that_is_said() -> None:
    rows, _ = drives(14, recordings=4, frames=60)
    search = find_conditions(with_errors(rows, (rows["operator_range_m"] < 1.0).to_numpy(), OPTIONS), OPTIONS)
    assert search.verdicts == ()
    assert "no condition can be confirmed with fewer than 8" in search.note


def test_the_same_seed_gives_the_same_conditions() -> None:
    rows, _ = drives(15)
    frames = with_errors(rows, (rows["operator_range_m"] < 1.0).to_numpy(), OPTIONS)
    first, second = (find_conditions(frames, OPTIONS).verdicts for _ in range(2))
    assert first == second


def test_the_order_of_rows_does_not_matter() -> None:
    rows, _ = drives(16)
    wrong = pl.Series("wrong", rows["operator_range_m"] < 1.0)
    mixed = rows.with_columns(wrong).sample(fraction=1.0, shuffle=True, seed=1)
    there = find_conditions(with_errors(rows, wrong.to_numpy(), OPTIONS), OPTIONS)
    here = find_conditions(with_errors(mixed, mixed["wrong"].to_numpy(), OPTIONS), OPTIONS)
    assert there.verdicts == here.verdicts


def test_an_epsilon_that_leaves_no_neighbours_leaves_lone_errors_isolated_and_bursts_unexplained() -> None:
    rows, scans = drives(13, recordings=4, frames=70)
    lone, burst = [20, 70, 120], [160, 161, 162]
    frames = with_errors(rows, np.isin(np.arange(len(rows)), lone + burst), OPTIONS)
    tagged = explain(frames, scan_space(scans), ErrorOptions(epsilon_m=1e-5)).tagged
    assert [tagged.tag[frame] for frame in lone] == [Tag.ISOLATED] * 3
    assert [tagged.tag[frame] for frame in burst] == [Tag.UNEXPLAINED] * 3
    assert not tagged.transient_by_definition.any()


def test_under_an_epsilon_larger_than_everything_only_a_single_error_is_transient() -> None:
    rows, scans = drives(14, recordings=4, frames=50)
    for wrong, tag in (([20], Tag.TRANSIENT), ([20, 120], Tag.UNEXPLAINED)):
        frames = with_errors(rows, np.isin(np.arange(len(rows)), wrong), OPTIONS)
        tagged = explain(frames, scan_space(scans), ErrorOptions(epsilon_m=100.0)).tagged
        assert [tagged.tag[frame] for frame in wrong] == [tag] * len(wrong)
        assert tagged.neighbours[20] == len(rows) - 1
