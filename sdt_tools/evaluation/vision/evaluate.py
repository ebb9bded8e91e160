"""Vision networks × scenarios × seeds: units of runs of the whole controller, and their tally."""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sdt_tools.config import dump_config
from sdt_tools.evaluation.grid import check_given, gather, identity, refuse_repeated
from sdt_tools.evaluation.policies import policy_for
from sdt_tools.evaluation.saving import SaveRuns
from sdt_tools.evaluation.vision.readers import reader_for
from sdt_tools.evaluation.vision.results import (
    DECISIONS_FILE,
    RUNS_FILE,
    VisionTally,
    errors_while,
    spreads,
    tallies,
    totals,
    write_runs,
)
from sdt_tools.evaluation.vision.run import VisionLoopConfig, drive_run
from sdt_tools.evaluation.vision.saving import KeptMessages, keep_run
from sdt_tools.evaluation.vision.spread import Evenness
from sdt_tools.runs.local import Progress, run_units
from sdt_tools.runs.unit import Unit
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.scenario import layout_for

SEEDS_A_UNIT: Final = 5
"""Runs of one unit: about half a minute, so that not much is lost by an interruption."""
_TIMING_FILE: Final = "timing.json"
_RECORDINGS: Final = "recordings"


@dataclass(frozen=True)
class VisionSummary:
    """Tallies by model (as it was named in the call) and scenario, and where tables and recordings lie.

    ``total`` pools a model's scenarios, ``spread`` tests whether its errors are as frequent in each. ``errors_while``
    counts them by what else the operator was doing. ``run_s`` is the mean processor time of a run.
    """

    models: Mapping[str, Mapping[str, VisionTally]]
    total: Mapping[str, VisionTally]
    spread: Mapping[str, Evenness]
    errors_while: Mapping[str, Mapping[str, int]]
    run_s: float
    runs: Path
    decisions: Path
    recordings: tuple[Path, ...]


def evaluate_vision(
    models: Sequence[str],
    follow: str,
    scenarios: Sequence[str],
    seeds: Sequence[int],
    config: VisionLoopConfig,
    out: Path,
    save: SaveRuns = SaveRuns.NONE,
    workers: int = 1,
    progress: Progress | None = None,
) -> VisionSummary:
    """Drive every scenario with every seed, switched by each of ``models``, ``follow`` at the wheel while active.

    ``models`` are checkpoint folders, ``truth`` or ``constant:<gesture>``; ``follow`` is what ``policy_for`` knows;
    ``scenarios`` are names or files. Runs that ``out`` has are not driven again. Raises UsageError for empty or
    repeated arguments and what loading a model or a scenario raises, before any run.
    """
    check_given({"model": models, "scenario": scenarios, "seed": seeds})
    drawn = [[layout_for(scenario, seed) for seed in seeds] for scenario in scenarios]
    refuse_repeated("scenario", [layouts[0].name for layouts in drawn])
    wheel = f"{policy_for(follow).name.replace(':', '-')}-{identity(follow.removeprefix('policy:'))}"
    names = {model: f"{reader_for(model)[0].replace(':', '-')}-{identity(model)}" for model in models}
    refuse_repeated("model", list(names.values()))
    units = {
        model: [
            unit
            for layouts in drawn
            for unit in _units(f"{names[model]}/{wheel}", model, follow, layouts, config, save)
        ]
        for model in models
    }
    folders = iter(run_units([unit for group in units.values() for unit in group], out, workers, progress))
    by_model = {model: [next(folders) for _ in group] for model, group in units.items()}
    every = [folder for group in by_model.values() for folder in group]
    runs = gather(by_model, RUNS_FILE, out)
    decisions = gather(by_model, DECISIONS_FILE, out)
    return VisionSummary(
        models=tallies(runs),
        total=totals(runs),
        spread=spreads(runs),
        errors_while=errors_while(decisions, models),
        run_s=_busy_s(every) / len(runs),
        runs=out / RUNS_FILE,
        decisions=out / DECISIONS_FILE,
        recordings=tuple(sorted(path for folder in every for path in (folder / _RECORDINGS).glob("*.mcap"))),
    )


def run_vision_block(
    out: Path, model: str, follow: str, layouts: Sequence[Layout], config: VisionLoopConfig, save: SaveRuns
) -> None:
    """One unit: a block of one model's runs in one scenario."""
    name, eyes_for = reader_for(model)
    policy = policy_for(follow)
    driver, config_toml = f"{name}+{policy.name}", dump_config(config)
    started_s = time.process_time()
    runs, recordings = [], []
    for layout in layouts:
        kept = KeptMessages()
        runs.append(drive_run(layout, eyes_for, policy, config, [] if save is SaveRuns.NONE else [kept]))
        recordings.append(keep_run(out / _RECORDINGS, layout, driver, kept, runs[-1], save, config_toml))
    busy_s = time.process_time() - started_s
    write_runs(out, runs, recordings)
    (out / _TIMING_FILE).write_text(json.dumps({"busy_s": busy_s}) + "\n", encoding="utf-8")


def _units(
    name: str, model: str, follow: str, layouts: Sequence[Layout], config: VisionLoopConfig, save: SaveRuns
) -> list[Unit]:
    blocks = [layouts[start : start + SEEDS_A_UNIT] for start in range(0, len(layouts), SEEDS_A_UNIT)]
    return [
        Unit(
            f"{name}/{block[0].name}/{block[0].seed}-{block[-1].seed}",
            run_vision_block,
            {"model": model, "follow": follow, "layouts": tuple(block), "config": config, "save": save},
        )
        for block in blocks
    ]


def _busy_s(folders: Sequence[Path]) -> float:
    return float(sum(json.loads((folder / _TIMING_FILE).read_text(encoding="utf-8"))["busy_s"] for folder in folders))
