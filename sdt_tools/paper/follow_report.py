"""The follow study's report: Markdown tables with what the paper prints beside what was measured, and figures."""

import json
from pathlib import Path
from typing import Final

import polars as pl

from sdt_tools.paper.follow_figures import margins_overview, scenarios_overview, sweep_figure
from sdt_tools.paper.follow_tables import (
    FollowTables,
    cost_rows,
    failures_by_motion,
    level_rows,
    nesting_rows,
    scenario_counts,
    sweep_rows,
)
from sdt_tools.paper.markdown import counted, ranged, table_line
from sdt_tools.paper.printed import LEVELS, TRAINING_FRAMES, VALIDATION_FRAMES
from sdt_tools.scene.scenario import STANDARD_FOLLOW

REPORT: Final = "follow.md"
FAMILIES: Final = {
    "paper-plain-level0": "plain, level 0",
    "paper-plain-level1": "plain, level 1",
    "paper-plain-level2": "plain, level 2",
    "paper-plain-level3": "plain, level 3",
    "paper-gate-level4": "gate, level 4",
    "large-plain-level0": "plain, level 0, large data",
    "large-gate-level4": "gate, level 4, large data",
}
"""The main families by name, in the order of the tables, as readers see them."""


def write_follow_report(tables: FollowTables, out: Path) -> Path:
    """Write ``follow.md``, ``follow.json`` with the same numbers, and the figures, to ``out``; return the report."""
    scenarios_overview(tables, FAMILIES, out / "follow_scenarios.png")
    sweep_figure(tables, out / "follow_lambda.png")
    margins_overview(tables, FAMILIES, out / "follow_trade.png")
    sections = [
        _opening(tables),
        _levels(tables),
        _cost(tables),
        _scenarios(tables),
        _failures(tables),
        _sweep(tables),
        _searched(tables),
        _checks(tables),
    ]
    (out / REPORT).write_text("\n\n".join(sections) + "\n", encoding="utf-8")
    document = {
        "levels": level_rows(tables, list(FAMILIES)),
        "cost": cost_rows(tables),
        "scenarios": scenario_counts(tables, list(FAMILIES)),
        "nesting": nesting_rows(tables),
        "failures_by_motion": failures_by_motion(tables, list(FAMILIES)),
        "lambda": sweep_rows(tables),
        "searched": tables.searched,
        "checks": tables.checks,
        "real_time_factor": tables.real_time_factor,
    }
    (out / "follow.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return out / REPORT


def _opening(tables: FollowTables) -> str:
    networks = tables.networks
    runs = tables.runs
    drawn = runs["seed"].to_list()
    seeds = f"{min(drawn)} to {max(drawn)}"
    return f"""# The follow network under safety domains

{len(networks)} networks, {networks["seed"].n_unique()} training seeds a family, {len(runs):,} closed-loop runs on the
seven scenarios, seeds {seeds}, none of which took part in training or tuning. Scans at 50 Hz with noise and codes,
decisions at 10 Hz. Small data are the paper's {TRAINING_FRAMES:,} training and {VALIDATION_FRAMES} validation frames,
each training seed from recordings of its own; all validation frames come from practice worlds with seeds from 1,000 on,
in equal numbers a class. Accuracies are medians over training seeds, with the least and the largest; rates have Wilson
intervals, which take runs for independent: networks of one family share their worlds, so the true ones are wider.
Everything here comes from one command, `sdt paper follow`."""


def _levels(tables: FollowTables) -> str:
    lines = [
        "## Accuracies and certificates (the paper's Table III)",
        "",
        "| networks | paper: training, validation | training | validation | forward recall | certified domains | "
        "least margin | seconds of training |",
        "|---|---|---|---|---|---|---:|---:|",
    ]
    for row in level_rows(tables, list(FAMILIES)):
        printed = LEVELS.get(row["level"]) if row["size"] == "paper" else None
        paper = f"{printed.train_percent} %, {printed.val_percent} %" if printed else ""
        certified = "" if row["level"] == 0 else f"{row['least_certified']} of {row['domains']} in the worst seed"
        margin = "" if row["level"] == 0 else f"{row['least_margin']:.2f}"
        spreads = [ranged(row[name]) for name in ("train_accuracy", "val_accuracy", "val_forward_recall")]
        cells = [FAMILIES[row["family"]], paper, *spreads, certified, margin, f"{row['seconds'][1]:.0f}"]
        lines.append(table_line(cells))
    lines += ["", "![Accuracy against strictness](follow_trade.png)"]
    return "\n".join(lines)


def _cost(tables: FollowTables) -> str:
    lines = [
        "## What level 4 costs",
        "",
        "The gate, certified at level 4, against the plain network at level 0: medians, and the worst network with an "
        "object pasted 10 cm ahead.",
        "",
        "| data | accuracy lost | forward recall lost | forward to a pasted object | forward lost by a 4 m clip |",
        "|---|---:|---:|---:|---:|",
    ]
    for row in cost_rows(tables):
        losses = [f"{100 * row[name]:.1f} points" for name in ("accuracy_loss", "forward_recall_loss")]
        lines.append(
            table_line([row["size"], *losses, f"{row['pasted_forward']:.1%}", f"{100 * row['clip_loss']:.1f} points"])
        )
    return "\n".join(lines)


def _scenarios(tables: FollowTables) -> str:
    counts = scenario_counts(tables, list(FAMILIES))
    lines = [
        "## Scenarios (the paper's Table IV)",
        "",
        "Runs that ended well, pooled over training seeds; in brackets the paper's one run a level.",
        "",
        "| scenario | " + " | ".join(FAMILIES.values()) + " |",
        "|---|" + "---|" * len(FAMILIES),
    ]
    for scenario in STANDARD_FOLLOW:
        cells = [_cell(counts[family][scenario], family, scenario) for family in FAMILIES]
        lines.append(f"| {scenario.replace('_', ' ')} | " + " | ".join(cells) + " |")
    totals = [counts[family]["total"] for family in FAMILIES]
    lines.append("| **all** | " + " | ".join(counted(total["ok"], total["runs"]) for total in totals) + " |")
    lines += ["", "![Driven paths](follow_scenarios.png)"]
    return "\n".join(lines)


def _cell(count: dict[str, int], family: str, scenario: str) -> str:
    size, _, level = family.split("-")
    printed = LEVELS.get(int(level[-1])) if size == "paper" else None
    mark = "" if printed is None else " [passed]" if scenario in printed.passed else " [failed]"
    return f"{count['ok']} of {count['runs']}{mark}"


def _failures(tables: FollowTables) -> str:
    lines = [
        "## Which failures, and where",
        "",
        "| fails at | also fails at | share | expected by chance |",
        "|---|---|---|---|",
    ]
    lines += [
        table_line(
            [
                row["first"],
                row["second"],
                counted(row["both"], row["failed_first"]),
                f"{row['expected_share']:.0%}",
            ]
        )
        for row in nesting_rows(tables)
    ]
    lines += ["", "The motion that was driven when a run failed, and the nearest range ahead at that moment:", ""]
    lines += ["| networks | failures | driving forward | median front range |", "|---|---:|---:|---:|"]
    for row in failures_by_motion(tables, list(FAMILIES)):
        near = f"{row['median_front_range_m']:.2f} m" if row["failures"] else ""
        lines.append(table_line([FAMILIES[row["family"]], str(row["failures"]), str(row["forward"]), near]))
    return "\n".join(lines)


def _sweep(tables: FollowTables) -> str:
    lines = [
        "## Strictness against accuracy: λ",
        "",
        "| level | λ | networks | validation | forward recall | certified domains |",
        "|---|---:|---:|---|---|---|",
    ]
    for row in sweep_rows(tables):
        certified = f"{row['least_certified']} to {row['most_certified']}"
        spreads = [ranged(row[name]) for name in ("val_accuracy", "val_forward_recall")]
        lines.append(table_line([str(row["level"]), f"{row['weight']:g}", str(row["networks"]), *spreads, certified]))
    lines += ["", "![Accuracy by λ and level](follow_lambda.png)"]
    return "\n".join(lines)


def _searched(tables: FollowTables) -> str:
    networks = tables.networks
    zero = networks.filter(pl.col("level") == 0)
    held = networks.filter((pl.col("level") > 0) & pl.col("weight").is_null())
    violated = zero["violated"].to_list()
    return f"""## Violations

Projected gradient violates {min(violated)} to {max(violated)} of 240 level-3 domains of networks of
level 0. In the {int(held["certified"].sum())} domains that are certified in networks of levels 1 to 4 it found
{int(held["error"].sum())} violations; in `{tables.searched["model"]}`, searched with
{tables.searched["config"]["attack"]["restarts"]} restarts a domain, {tables.searched["error"]}."""


def _checks(tables: FollowTables) -> str:
    names = list(next(iter(tables.checks.values()))) if tables.checks else []
    lines = [
        "## Standing checks",
        "",
        "Median over training seeds, and the worst.",
        "",
        "| networks | " + " | ".join(name.replace("_", " ") for name in names) + " |",
        "|---|" + "---|" * len(names),
    ]
    for family, title in FAMILIES.items():
        values = tables.checks.get(family, {})
        cells = [f"{values[name]['median']:.1%}, {values[name]['worst']:.1%}" for name in names]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    return "\n".join(lines)
