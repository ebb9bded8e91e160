"""The vision study's report, from networks and runs made up so that the answers are known."""

import json
from collections.abc import Mapping
from pathlib import Path

import polars as pl
import pytest

from sdt_tools.evaluation.vision.results import VisionTally
from sdt_tools.evaluation.vision.spread import Evenness
from sdt_tools.paper.printed import EPSILONS, MODE_ERRORS
from sdt_tools.paper.vision_config import VisionStudyConfig
from sdt_tools.paper.vision_models import CONTROL, vision_settings
from sdt_tools.paper.vision_report import VisionTables, accuracy_rows, rate_rows, write_vision_report
from sdt_tools.scene.scenario import STANDARD_VISION

ACCURACIES = {"epsilon0": (0.97, 0.98, 0.99), "epsilon1": (0.9, 0.8, 0.7), CONTROL: (0.95, 0.96, 0.97)}


def tally(errors: int, runs: int) -> VisionTally:
    per_run = errors / runs
    return VisionTally(
        mode_errors=errors,
        missed=1,
        runs=runs,
        per_run=per_run,
        interval=(per_run / 2, per_run * 2),
        runs_with_errors=min(errors, runs),
        commands=40,
        moot=0,
        reaction_s=0.4,
        misread=errors,
        decisions=4000,
        unreadable=0,
        ok=runs - min(errors, runs),
        ok_wilson=(0.0, 1.0),
        outcomes={"ok": runs},
    )


@pytest.fixture(scope="module")
def tables() -> VisionTables:
    networks = pl.DataFrame(
        [
            {
                "network": f"{family}-seed{1000 + place}",
                "family": family,
                "seed": 1000 + place,
                "epsilon": 1 if family == "epsilon1" else 0,
                "adversarial_train_accuracy": accuracy / 2,
                "train_accuracy": 1.0,
                "val_accuracy": accuracy,
                "val_recall_idle": 0.9,
                "val_recall_enable": 0.8,
                "val_recall_disable": 0.7,
                "val_images": 900,
                "epochs": 7,
                "seconds": 100.0 + place,
            }
            for family, accuracies in ACCURACIES.items()
            for place, accuracy in enumerate(accuracies)
        ]
    )
    rates = pl.DataFrame(
        [
            {"family": "epsilon0", "seed": seed, "method": "pgd", "epsilon": 2, "target": target, "images": 10} | turned
            for seed in (1000, 1001)
            for target, turned in (("any other", {"succeeded": 9}), ("enable", {"succeeded": seed - 1000}))
        ]
    )
    modes: Mapping[int, Mapping[str, VisionTally]] = {
        0: {scenario: tally(0, 20) for scenario in STANDARD_VISION},
        2: {scenario: tally(30, 20) for scenario in STANDARD_VISION},
    }
    return VisionTables(
        networks=networks,
        rates=rates,
        baseline=(0.41, 0.39),
        modes=modes,
        totals={0: tally(0, 140), 2: tally(210, 140)},
        spread={0: Evenness(0, (0.0,) * 7, None), 2: Evenness(210, (30.0,) * 7, 0.25)},
        errors_while={0: {}, 2: {"carry_box": 200, "nothing else": 10}},
        follow="follow-0",
    )


def test_accuracies_are_medians_with_least_and_largest_beside_the_papers(tables: VisionTables, tmp_path: Path) -> None:
    rows = {row["family"]: row for row in accuracy_rows(tables.networks)}
    report = write_vision_report(tables, VisionStudyConfig(), tmp_path).read_text(encoding="utf-8")

    assert rows["epsilon1"]["val_accuracy"] == [0.7, 0.8, 0.9]
    assert (
        "| ε = 1 | 52.0 %, 92.8 % | 40.0% (35.0% to 45.0%) | 100.0% (100.0% to 100.0%) | 80.0% (70.0% to 90.0%) |"
        in report
    )
    assert "| plain, on the attacked schedule |  | 48.0%" in report
    assert "39.0% to 41.0% of the validation images" in report


def test_attacks_are_pooled_over_training_seeds(tables: VisionTables, tmp_path: Path) -> None:
    rows = {row["target"]: (row["succeeded"], row["images"]) for row in rate_rows(tables.rates)}
    report = write_vision_report(tables, VisionStudyConfig(), tmp_path).read_text(encoding="utf-8")

    assert rows == {"any other": (18, 20), "enable": (1, 20)}
    assert "| ε = 0 | PGD | ±2 | 18 of 20 (70% to 97%) | 1 of 20 (1% to 24%) |" in report


def test_mode_errors_stand_beside_the_papers_one_run(tables: VisionTables, tmp_path: Path) -> None:
    report = write_vision_report(tables, VisionStudyConfig(), tmp_path).read_text(encoding="utf-8")

    assert "| forward backward | 0.00 (0.00 to 0.00) [1] | 1.50 (0.75 to 3.00) [5] |" in report
    assert "| **all seven** | 0.00 (0.00 to 0.00) [2] | 10.50 (5.25 to 21.00) [18] |" in report
    assert "| even over scenarios? p | no error | 0.250 |" in report
    assert "| most errors while |  | carry box 200, nothing else 10 |" in report
    assert (tmp_path / "vision_errors.png").stat().st_size > 10_000


def test_the_document_holds_the_same_numbers(tables: VisionTables, tmp_path: Path) -> None:
    report = write_vision_report(tables, VisionStudyConfig(), tmp_path)
    document = json.loads(report.with_suffix(".json").read_text(encoding="utf-8"))

    assert document["mode_errors"]["epsilon2"]["staying_idle"]["mode_errors"] == 30
    assert document["spread"]["epsilon2"]["p_value"] == 0.25


def test_the_control_differs_from_attacked_networks_in_the_attack_alone() -> None:
    config = VisionStudyConfig()
    attacked, control = (vision_settings(*family, 1000, config) for family in (("epsilon2", 2), (CONTROL, 0)))

    assert (attacked.adversarial.epsilon, control.adversarial.epsilon) == (2, 0)
    assert control.model_copy(update={"adversarial": attacked.adversarial}) == attacked


def test_what_the_paper_prints() -> None:
    assert [EPSILONS[epsilon].val_percent for epsilon in (0, 1, 2)] == [98.4, 92.8, 71.9]
    assert [sum(MODE_ERRORS[epsilon].values()) for epsilon in (0, 1, 2)] == [2, 2, 18]
