"""The follow study's tables and report, from networks and runs made up so that the answers are known."""

import json
from pathlib import Path

import polars as pl
import pytest

from sdt_tools.paper.follow_config import FollowStudyConfig
from sdt_tools.paper.follow_models import MAIN, Family, settings, swept
from sdt_tools.paper.follow_report import FAMILIES, write_follow_report
from sdt_tools.paper.follow_tables import (
    FollowTables,
    cost_rows,
    failures_by_motion,
    level_rows,
    nesting_rows,
    scenario_counts,
    sweep_rows,
)
from sdt_tools.paper.printed import LEVELS
from sdt_tools.scene.scenario import STANDARD_FOLLOW

SEEDS = (0, 1)
RUNS = range(1000, 1004)


def failed(family: str, scenario: str, run: int) -> bool:
    """The plain network of level k fails the gate in its first k worlds: nested by construction."""
    level = int(family[-1])
    return family.startswith("paper-plain") and scenario == "through_gate" and run < 1000 + level


@pytest.fixture(scope="module")
def tables() -> FollowTables:
    networks, runs, traces = [], [], []
    everything = [(family, None) for family in FAMILIES] + [(f"paper-plain-level{k}-lambda0.3", 0.3) for k in (1, 2, 3)]
    for family, weight in everything:
        size, arch, level = family.split("-")[:3]
        for seed in SEEDS:
            networks.append(
                {
                    "network": f"{family}-seed{seed}",
                    "family": family,
                    "size": size,
                    "arch": arch,
                    "level": int(level[-1]),
                    "weight": weight,
                    "effective_weight": weight or 1.0,
                    "seed": seed,
                    "train_accuracy": 0.9,
                    "val_accuracy": 0.8 + 0.02 * seed,
                    "train_forward_recall": 0.95,
                    "val_forward_recall": 0.9,
                    "seconds": 40.0,
                    "domains": 240,
                    "certified": 0 if level[-1] == "0" else 240 - seed,
                    "violated": 240 if level[-1] == "0" else 0,
                    "unknown": 0,
                    "error": 0,
                    "min_margin": 2.0 - seed,
                }
            )
            if weight is not None:
                continue
            known = {"policy": f"policy:{family}-seed{seed}", "network": f"{family}-seed{seed}", "family": family}
            for scenario in STANDARD_FOLLOW:
                for run in RUNS:
                    key = {**known, "training_seed": seed, "scenario": scenario, "seed": run}
                    outcome = "contact" if failed(family, scenario, run) else "ok"
                    runs.append({**key, "model": known["network"], "outcome": outcome})
                    traces += [
                        {
                            **key,
                            "model": known["network"],
                            "time_s": step / 2,
                            "motion": "forward",
                            "front_range_m": 1.0 - step / 10,
                            "robot_x_m": step / 5,
                            "robot_y_m": 0.0,
                            "operator_x_m": 1.0 + step / 5,
                            "operator_y_m": 0.0,
                        }
                        for step in range(5)
                    ]
    searched = {"model": "large-gate-level4-seed0", "config": {"attack": {"restarts": 1000}}, "error": 0}
    rates = {"pasted_forward": (0.0, 0.1), "clear_forward": (0.9, 0.8), "clear_forward_clipped_4m": (0.85, 0.8)}
    check = {name: {"median": median, "worst": worst} for name, (median, worst) in rates.items()}
    checks = dict.fromkeys(FAMILIES, check)
    return FollowTables(pl.DataFrame(networks), pl.DataFrame(runs), pl.DataFrame(traces), searched, checks, 300.0)


def test_families_are_told_by_least_median_and_largest(tables: FollowTables) -> None:
    row = next(row for row in level_rows(tables, list(FAMILIES)) if row["family"] == "paper-plain-level2")
    assert row["val_accuracy"] == pytest.approx([0.80, 0.81, 0.82])
    assert (row["least_certified"], row["least_margin"]) == (239, 1.0)


def test_runs_are_pooled_over_training_seeds(tables: FollowTables) -> None:
    counts = scenario_counts(tables, list(FAMILIES))
    assert counts["paper-plain-level3"]["through_gate"] == {"ok": 2, "runs": 8}
    assert counts["paper-plain-level3"]["total"] == {"ok": 50, "runs": 56}
    assert counts["large-gate-level4"]["total"] == {"ok": 56, "runs": 56}


def test_nesting_is_found_and_chance_told(tables: FollowTables) -> None:
    rows = nesting_rows(tables)
    assert [(row["failed_first"], row["both"]) for row in rows] == [(0, 0), (2, 2), (4, 4)]
    assert [row["expected_share"] for row in rows] == pytest.approx([0.0, 0.5, 0.75])


def test_failures_are_told_by_what_was_driven(tables: FollowTables) -> None:
    rows = {row["family"]: row for row in failures_by_motion(tables, list(FAMILIES))}
    assert (rows["paper-plain-level2"]["failures"], rows["paper-plain-level2"]["forward"]) == (4, 4)
    assert rows["paper-plain-level2"]["median_front_range_m"] == pytest.approx(0.6)
    assert rows["paper-plain-level0"]["failures"] == 0


def test_the_sweep_holds_the_recipes_weight_too(tables: FollowTables) -> None:
    assert [(row["level"], row["weight"], row["networks"]) for row in sweep_rows(tables)] == [
        (level, weight, 2) for level in (1, 2, 3) for weight in (0.3, 1.0)
    ]


def test_the_report_says_it_all_and_its_figures_are_there(tables: FollowTables, tmp_path: Path) -> None:
    report = write_follow_report(tables, tmp_path)
    text = report.read_text()
    assert "98.8 %, 84.7 %" in text
    assert "| through gate | 8 of 8 [passed] | 6 of 8 [passed] | 4 of 8 [failed] |" in text
    assert "239 of 240 in the worst seed" in text
    for figure in ("follow_scenarios.png", "follow_lambda.png", "follow_trade.png"):
        assert figure in text
        assert (tmp_path / figure).stat().st_size > 10_000
    assert json.loads((tmp_path / "follow.json").read_text())["real_time_factor"] == 300.0


def test_the_paper_passes_seven_five_four_and_none() -> None:
    assert [len(LEVELS[level].passed) for level in range(4)] == [7, 5, 4, 0]


def test_each_main_family_has_a_place_in_the_report() -> None:
    assert [family.name for family in MAIN] == list(FAMILIES)


def test_families_differ_in_what_they_are_named_after() -> None:
    config = FollowStudyConfig()
    large, small = (settings(Family(size, "gate", 4), 3, config) for size in ("large", "paper"))
    assert (large.seed, large.arch, large.specification.level) == (3, "gate", 4)
    assert large.architecture == config.large_architecture != small.architecture
    assert (large.loop.epochs, small.loop.epochs) == (config.large_epochs, config.paper_epochs)
    plain = [settings(Family("paper", "plain", level), 0, config) for level in (1, 2, 3)]
    assert len({one.safety.model_dump_json() for one in plain}) == 1
    assert {family.weight for family in swept(config)} == set(config.swept_weights)


def test_what_level_four_costs_is_said_for_both_sizes_of_data(tables: FollowTables) -> None:
    rows = cost_rows(tables)
    assert [row["size"] for row in rows] == ["paper", "large"]
    assert rows[0]["accuracy_loss"] == pytest.approx(0.0)
    assert rows[0]["pasted_forward"] == 0.1
    assert rows[0]["clip_loss"] == pytest.approx(0.05)
