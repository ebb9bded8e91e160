"""The vision study's report: Markdown tables with what the paper prints beside what was measured, and figures."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any, Final

import polars as pl

from sdt_tools.evaluation.vision.figure import errors_figure
from sdt_tools.evaluation.vision.results import VisionTally
from sdt_tools.evaluation.vision.spread import Evenness
from sdt_tools.paper.markdown import counted, ranged, table_line
from sdt_tools.paper.printed import EPSILONS, MODE_ERRORS
from sdt_tools.paper.vision_config import VisionStudyConfig
from sdt_tools.paper.vision_models import CONTROL
from sdt_tools.scene.scenario import STANDARD_VISION

REPORT: Final = "vision.md"
EXHIBIT: Final = "vision_attack.png"
_ERRORS: Final = "vision_errors.png"


@dataclass(frozen=True, eq=False)
class VisionTables:
    """All tables of the study.

    ``networks``: one row a trained network. ``rates``: attacks on each, by method, ε and aim. ``baseline``: validation
    accuracies of logistic regressions on small images. By ε: ``modes`` by scenario, their ``totals``, how evenly errors
    ``spread``, and what the operator was doing meanwhile. ``follow`` was at the wheel.
    """

    networks: pl.DataFrame
    rates: pl.DataFrame
    baseline: Sequence[float]
    modes: Mapping[int, Mapping[str, VisionTally]]
    totals: Mapping[int, VisionTally]
    spread: Mapping[int, Evenness]
    errors_while: Mapping[int, Mapping[str, int]]
    follow: str


def write_vision_report(tables: VisionTables, config: VisionStudyConfig, out: Path) -> Path:
    """Write ``vision.md``, ``vision.json`` with the same numbers, and figures, to ``out``; return the report."""
    errors_figure({f"ε = {epsilon}": tally for epsilon, tally in tables.modes.items()}, MODE_ERRORS, out / _ERRORS)
    sections = [_opening(tables, config), _accuracies(tables), _attacks(tables), _scenarios(tables, config)]
    (out / REPORT).write_text("\n\n".join(sections) + "\n", encoding="utf-8")
    document = {
        "accuracies": accuracy_rows(tables.networks),
        "baseline_val_accuracy": list(tables.baseline),
        "attacks": rate_rows(tables.rates),
        "mode_errors": {
            f"epsilon{epsilon}": {scenario: asdict(one) for scenario, one in by_scenario.items()}
            for epsilon, by_scenario in tables.modes.items()
        },
        "totals": {f"epsilon{epsilon}": asdict(one) for epsilon, one in tables.totals.items()},
        "spread": {f"epsilon{epsilon}": asdict(one) for epsilon, one in tables.spread.items()},
        "errors_while": {f"epsilon{epsilon}": dict(counts) for epsilon, counts in tables.errors_while.items()},
    }
    (out / REPORT).with_suffix(".json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return out / REPORT


def accuracy_rows(networks: pl.DataFrame) -> list[dict[str, Any]]:
    """For each family the least, median and largest of what its networks reached."""
    rows = []
    for (family,), group in networks.group_by("family", maintain_order=True):
        row: dict[str, Any] = {"family": family, "epsilon": group["epsilon"][0], "networks": len(group)}
        spread = [name for name in group.columns if "accuracy" in name or "recall" in name or name == "seconds"]
        row |= {name: [group[name].min(), group[name].median(), group[name].max()] for name in spread}
        rows.append(row)
    return rows


def rate_rows(rates: pl.DataFrame) -> list[dict[str, Any]]:
    """Attacks of each kind on all networks of a family, pooled."""
    pooled = rates.group_by("family", "method", "epsilon", "target", maintain_order=True).agg(
        pl.col("images").sum(), pl.col("succeeded").sum()
    )
    return pooled.to_dicts()


def _opening(tables: VisionTables, config: VisionStudyConfig) -> str:
    networks = tables.networks
    size = config.data.train_frames
    return f"""# The vision network under adversarial training

{len(networks)} networks, {networks["seed"].n_unique()} training seeds a family. Each seed draws {size:,} training
images of its own, in equal numbers a gesture, from {config.practice.worlds} recordings of people in rooms with seeds
below 1,000, and about {median(networks["val_images"].to_list()):,.0f} validation images from {config.unseen.worlds}
recordings of other people in other rooms; nothing is left out that looks like a gesture, nor arms on their way.
ε counts steps of 8-bit colour, training attacks are by the fast gradient sign, and only the last blocks of
EfficientNet-Lite0 are trained, at {config.width}×{config.height} pixels. The control is trained plainly on the schedule
of the attacked networks. Accuracies are medians over training seeds, with the least and the largest. Everything here
comes from one command, `sdt paper vision`."""


def _accuracies(tables: VisionTables) -> str:
    lines = [
        "## Accuracies (the paper's Table I)",
        "",
        "| networks | paper: training (attacked), validation (clean) | training, attacked by its ε | training, clean | "
        "validation, clean | recall of idle, enable, disable | seconds of training |",
        "|---|---|---|---|---|---|---:|",
    ]
    for row in accuracy_rows(tables.networks):
        printed = EPSILONS.get(row["epsilon"]) if row["family"] != CONTROL else None
        paper = f"{printed.attacked_train_percent} %, {printed.val_percent} %" if printed else ""
        spreads = [ranged(row[name]) for name in ("adversarial_train_accuracy", "train_accuracy", "val_accuracy")]
        recalls = ", ".join(f"{row[f'val_recall_{gesture}'][1]:.1%}" for gesture in ("idle", "enable", "disable"))
        lines.append(table_line([_title(row["family"]), paper, *spreads, recalls, f"{row['seconds'][1]:.0f}"]))
    guesses = sorted(tables.baseline)
    lines += [
        "",
        f"Logistic regression on the same images at 32×32 pixels reaches {guesses[0]:.1%} to {guesses[-1]:.1%} of the "
        "validation images; a third is chance.",
    ]
    return "\n".join(lines)


def _attacks(tables: VisionTables) -> str:
    lines = [
        "## Attacks on validation images",
        "",
        "Of the images that a network answers rightly, how many are turned, all training seeds together. Into enable: "
        "disable images alone.",
        "",
        "| networks | by | at | into another gesture | into enable |",
        "|---|---|---|---|---|",
    ]
    rows = {(row["family"], row["method"], row["epsilon"], row["target"]): row for row in rate_rows(tables.rates)}
    for family, method, epsilon in dict.fromkeys(key[:3] for key in rows):
        cells = [rows[family, method, epsilon, target] for target in ("any other", "enable")]
        rates = [counted(cell["succeeded"], cell["images"]) for cell in cells]
        lines.append(table_line([_title(family), method.upper(), f"±{epsilon}", *rates]))
    lines += ["", f"![A disable image and what the attack makes of it]({EXHIBIT})"]
    return "\n".join(lines)


def _scenarios(tables: VisionTables, config: VisionStudyConfig) -> str:
    first = config.first_reported_seed
    lines = [
        "## Mode errors in the scenarios (the paper's Table V)",
        "",
        f"Runs of the whole controller with the first training seed's networks, seeds {first} to "
        f"{first + config.runs - 1}, `{tables.follow}` at the wheel while active. A mode error is a switch by a "
        "gesture that was not shown. Errors a run, with 95 % intervals over runs; in brackets the paper's one run.",
        "",
        "| scenario | " + " | ".join(f"ε = {epsilon}" for epsilon in tables.modes) + " |",
        "|---|" + "---|" * len(tables.modes),
    ]
    for scenario in STANDARD_VISION:
        cells = [_errors(one[scenario], MODE_ERRORS.get(eps, {}).get(scenario)) for eps, one in tables.modes.items()]
        lines.append(table_line([scenario.replace("_", " "), *cells]))
    cells = [
        _errors(one, sum(MODE_ERRORS.get(eps, {}).values()), len(STANDARD_VISION)) for eps, one in tables.totals.items()
    ]
    lines.append(table_line(["**all seven**", *cells]))
    totals = list(tables.totals.values())
    lines.append(table_line(["commands missed", *(f"{one.missed} of {one.commands}" for one in totals)]))
    lines.append(table_line(["runs that did all that was commanded", *(counted(one.ok, one.runs) for one in totals)]))
    lines.append(table_line(["even over scenarios? p", *(_evenness(one) for one in tables.spread.values())]))
    doing = [
        ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in list(one.items())[:4])
        for one in tables.errors_while.values()
    ]
    lines.append(table_line(["most errors while", *doing]))
    lines += ["", f"![Mode errors by scenario]({_ERRORS})"]
    return "\n".join(lines)


def _errors(tally: VisionTally, printed: int | None, scale: int = 1) -> str:
    low, high = tally.interval
    paper = "" if printed is None else f" [{printed}]"
    return f"{scale * tally.per_run:.2f} ({scale * low:.2f} to {scale * high:.2f}){paper}"


def _evenness(spread: Evenness) -> str:
    if spread.p_value is None:
        return "no error"
    return f"{spread.p_value:.3f}" + ("" if spread.decided else ", too few errors to tell")


def _title(family: str) -> str:
    return "plain, on the attacked schedule" if family == CONTROL else f"ε = {family.removeprefix('epsilon')}"
